"""Detection of results that are out of date: other settings, code or inputs than the study's."""

from collections import defaultdict
from collections.abc import Iterable
from fnmatch import fnmatch
from pathlib import Path, PurePosixPath

from biogrip.errors import BiogripError
from biogrip.products.catalogue import products
from biogrip.products.plan import Plan, Wildcards
from biogrip.running.journal import digest_of_files, hash_file
from biogrip.running.manifest import STUDY, Manifest
from biogrip.running.resolved import read_study
from biogrip.running.rules import ProductRule, inputs_of, make_rules

_RESULTS = "results"


class Provenance:
    """Digests of settings and inputs that the files of a results folder were made with.

    Parameters
    ----------
    results
        The results folder.
    manifest
        Manifest of the folder.
    """

    def __init__(self, results: Path, manifest: Manifest) -> None:
        self._results = results.absolute()
        self._manifest = manifest
        self._hashes: dict[str, str | None] = {}

    def made_otherwise(self, rules: Iterable[ProductRule]) -> list[str]:
        """Return results that were made with other settings, other code, or from other files.

        Parameters
        ----------
        rules
            All products and jobs of the study.

        Returns
        -------
        list of str
            Existing recorded files, relative to the results folder.
        """
        return [
            name
            for rule in rules
            for job in rule.jobs
            for name in self._of_job(rule, job)
            if (self._results / name).exists()
        ]

    def outdated(self, rules: Iterable[ProductRule]) -> set[str]:
        """Return recorded results that were made otherwise, or from any that were.

        Parameters
        ----------
        rules
            All products and jobs of the study.

        Returns
        -------
        set of str
            Relative to the results folder. A result that is gone counts, too, if it was
            made otherwise: others may have been made from it.
        """
        jobs = [(rule, job) for rule in rules for job in rule.jobs]
        found = {name for rule, job in jobs for name in self._of_job(rule, job)}
        followers: dict[str, set[str]] = defaultdict(set)
        for rule, job in jobs:
            outputs = set(_outputs(rule, job))
            for file in filter(is_result, inputs_of(rule, job)):
                followers[name_of(file)] |= outputs
        waiting = list(found)
        while waiting:
            new = followers[waiting.pop()] - found
            found |= new
            waiting += new
        return found

    def _of_job(self, rule: ProductRule, job: Wildcards) -> list[str]:
        recorded = [name for name in _outputs(rule, job) if self._manifest.knows(name)]
        if not recorded:
            return []
        settings, inputs = rule.digest(job), self._digest_of_inputs(rule, job)
        return [
            name
            for name in recorded
            if (last := self._manifest.last(name)).settings != settings
            or (inputs is not None and last.inputs != inputs)
        ]

    def _digest_of_inputs(self, rule: ProductRule, job: Wildcards) -> str | None:
        """Return a digest of a job's recorded inputs, or None if an input is unknown."""
        hashes = [self._hash_of(file) for file in inputs_of(rule, job)]
        return None if None in hashes else digest_of_files(hash_ for hash_ in hashes if hash_)

    def _hash_of(self, file: str) -> str | None:
        if file not in self._hashes:
            name = name_of(file) if is_result(file) else ""
            if self._manifest.knows(name):
                self._hashes[file] = self._manifest.last(name).sha256
            else:
                place = self._results.parent / file
                self._hashes[file] = hash_file(place) if place.is_file() else None
        return self._hashes[file]


def _outputs(rule: ProductRule, job: Wildcards) -> list[str]:
    """Return the files of a job, relative to the results folder."""
    return [*map(name_of, rule.files(job))]


def is_result(file: str) -> bool:
    """Return True if a file that a rule names is in the results folder."""
    return PurePosixPath(file).parts[0] == _RESULTS


def name_of(file: str) -> str:
    """Return a result's path relative to the results folder."""
    return PurePosixPath(file).relative_to(_RESULTS).as_posix()


def finished(results: Path, manifest: Manifest, only: str) -> list[str]:
    """Return all results of a finished study, except batches.

    Parameters
    ----------
    results, manifest
        The results folder, and its manifest.
    only
        Pattern for file names without suffix.

    Returns
    -------
    list of str
        Files relative to the results folder. They exist, are unchanged, and were made for the
        study recorded beside them.

    Raises
    ------
    BiogripError
        Names the first file for which this does not hold.
    """
    rules = make_rules(products().values(), Plan(read_study(results), results))
    found = [
        name
        for rule in rules
        for product in rule.products
        for job in rule.jobs
        if "batch" not in job
        for name in map(name_of, product.outputs(job).values())
        if fnmatch(PurePosixPath(name).stem, only)
    ]
    names = list(dict.fromkeys(found))
    for name in names:
        if not (results / name).is_file():
            raise BiogripError(
                f"{results}: found a study that is not finished ({name} is missing); "
                "allowed is one that is. To go on: biogrip run."
            )
    for name in (STUDY, *names):
        if not manifest.knows(name) or not manifest.is_whole(name, thoroughly=True):
            raise BiogripError(
                f"{results / name}: is not what was written (edited, or damaged). "
                "The next run makes it again."
            )
    outdated = Provenance(results, manifest).outdated(rules)
    for name in names:
        if name in outdated:
            raise BiogripError(
                f"{results / name}: was made for other settings, by other code or of other files "
                f"than {results / STUDY} says. The next run makes it again."
            )
    return names
