"""The jobs of a study: its cases, and their seeds in batches."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from biogrip.errors import BiogripError
from biogrip.products.batches import (
    Batch,
    existing_batches,
    parse_batch,
    plan_batches,
    seeds_a_batch,
)
from biogrip.study.study import Study

Wildcards = Mapping[str, str]
"""Which job: ``case``, ``method``, ``batch``, ``sweep``, ``seed``, as far as there are such."""


@dataclass(frozen=True)
class Plan:
    """The jobs of a study.

    Parameters
    ----------
    study
        What to do.
    results
        Folder of the results; what it already holds decides the batches.
    """

    study: Study
    results: Path
    _planned: dict[tuple[str, ...], list[Batch]] = field(default_factory=dict, init=False)

    def batches(self, stage: str, case: str, method: str = "") -> list[Batch]:
        """Batches of a stage's seeds of a case; those that have results are kept.

        Parameters
        ----------
        stage
            Folder of the results: ``identifications``, ``coverage`` or ``selection``.
        case, method
            Of what; identifications are by method.
        """
        folder = (stage, case, method) if method else (stage, case)
        # Listed once: a plan does not change while it is carried out.
        if folder not in self._planned:
            whose = self.study.case(case)
            seeds = whose.coverage_seeds if stage == "coverage" else whose.seeds
            existing = existing_batches(self.results.joinpath(*folder))
            size = self.study.batch_size or seeds_a_batch(seeds)
            self._planned[folder] = plan_batches(seeds, size, existing)
        return self._planned[folder]

    def batch_files(self, pattern: str, case: str) -> list[str]:
        """Fill ``{case}``, ``{method}`` and ``{batch}`` of a path for every batch of a case.

        A path without a method and of no stage of its own goes by the batches of the
        method that is shown.
        """
        stage = Path(pattern).parts[1]
        if stage in ("coverage", "selection"):
            batches = self.batches(stage, case)
            return [pattern.format(case=case, batch=batch.name) for batch in batches]
        methods = self.study.methods if "{method}" in pattern else [self.study.shown]
        return [
            pattern.format(case=case, method=method, batch=batch.name)
            for method in methods
            for batch in self.batches("identifications", case, method)
        ]

    def batch_of_seed(self, pattern: str, case: str, seed: int) -> str:
        """Fill ``{case}`` and ``{batch}`` of a path for the batch that holds a seed."""
        batches = self.batches("identifications", case, self.study.shown)
        found = [batch for batch in batches if batch.first <= seed <= batch.last]
        batch = found[0] if found else Batch(seed, seed)
        return pattern.format(case=case, batch=batch.name)

    def batch_jobs(self, stage: str, cases: Iterable[str]) -> list[Wildcards]:
        """Jobs of a stage whose batches have no method."""
        return [
            {"case": case, "batch": batch.name}
            for case in cases
            for batch in self.batches(stage, case)
        ]

    def method_jobs(self, cases: Iterable[str]) -> list[Wildcards]:
        """Jobs of the identification, a batch and method each."""
        return [
            {"case": case, "method": method, "batch": batch.name}
            for case in cases
            for method in self.study.methods
            for batch in self.batches("identifications", case, method)
        ]

    @staticmethod
    def seeds_of(batch: str) -> list[int]:
        """Seeds of a batch by its name.

        Raises
        ------
        BiogripError
            If it is no batch's name.
        """
        found = parse_batch(batch)
        if found is None or found.last < found.first:
            raise BiogripError(f"--batch: found '{batch}', allowed is seeds_FIRST-LAST.")
        return found.seeds
