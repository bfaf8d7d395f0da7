"""The command ``biogrip verify``: results against their record and the study beside them."""

import os
from pathlib import Path

from biogrip.digits import counted
from biogrip.errors import BiogripError
from biogrip.products.catalogue import products
from biogrip.products.plan import Plan
from biogrip.running.manifest import STUDY, Manifest
from biogrip.running.provenance import Provenance, name_of
from biogrip.running.resolved import read_study
from biogrip.running.rules import files_of, make_rules


def verify(results: Path) -> str:
    """Compare every recorded file of a results folder with its record.

    If the study is there too, results must have been made for it.

    Returns
    -------
    str
        Summary with the number of files.

    Raises
    ------
    BiogripError
        Names every file that is missing, changed, or not made for the study.
    """
    manifest = Manifest(results)
    if not manifest.files:
        raise BiogripError(f"{results}: holds no record of a study.")
    problems = []
    for path in manifest.files:
        if not os.path.lexists(results / path):
            problems.append(f"{results / path}: is missing.")
        elif not manifest.is_whole(path, thoroughly=True):
            problems.append(f"{results / path}: is not what was written (edited, or damaged).")
    others = 0
    if not problems and manifest.knows(STUDY):
        rules = make_rules(products().values(), Plan(read_study(results), results))
        problems = [
            f"{results / name}: was made for other settings, by other code or of other files "
            f"than {results / STUDY} says."
            for name in sorted(Provenance(results, manifest).outdated(rules))
            if manifest.knows(name)
        ]
        others = len(manifest.others([*map(name_of, files_of(rules)), STUDY]))
    if problems:
        raise BiogripError("\n".join([*problems, "The next run makes them again."]))
    also = f" Of other studies than {results / STUDY}: {others}." if others else ""
    return f"{counted(len(manifest.files), 'file')} of {results} read: as written.{also}"
