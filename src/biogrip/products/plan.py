"""Plan of a study's jobs: cases, and batches of seeds."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from biogrip.errors import BiogripError
from biogrip.study.batches import (
    Batch,
    existing_batches,
    parse_batch,
    plan_batches,
    seeds_a_batch,
)
from biogrip.study.study import Study

Wildcards = Mapping[str, str]
"""Wildcards of a job, any of ``case``, ``method``, ``batch``, ``sweep``, ``seed``."""


@dataclass(frozen=True)
class Plan:
    """The jobs of a study."""

    study: Study
    """The study."""
    results: Path
    """Folder of the results; batches that have results there are kept."""
    _planned: dict[tuple[str, ...], list[Batch]] = field(default_factory=dict, init=False)

    def batches(self, stage: str, case: str, method: str = "") -> list[Batch]:
        """Return the batches of a case's seeds in a stage, keeping those that have results.

        The stage is the folder of the results, ``identifications`` (of a method), ``coverage`` or
        ``selection``.
        """
        folder = (stage, case, method) if method else (stage, case)
        # Cached: existing files are listed once per plan.
        if folder not in self._planned:
            whose = self.study.case(case)
            seeds = whose.coverage_seeds if stage == "coverage" else whose.seeds
            existing = existing_batches(self.results.joinpath(*folder))
            size = self.study.batch_size or seeds_a_batch(seeds)
            self._planned[folder] = plan_batches(seeds, size, existing)
        return self._planned[folder]

    def batch_files(self, pattern: str, case: str) -> list[str]:
        """Return a path pattern filled in for every batch of a case.

        A pattern without a method, and of no stage with batches of its own, uses the batches of
        the shown method.
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
        """Return a path pattern filled in with the batch that holds a seed."""
        batches = self.batches("identifications", case, self.study.shown)
        holding = (batch for batch in batches if batch.first <= seed <= batch.last)
        batch = next(holding, Batch(seed, seed))
        return pattern.format(case=case, batch=batch.name)

    def batch_jobs(self, stage: str, cases: Iterable[str]) -> list[Wildcards]:
        """Return the wildcards of every batch of a stage without methods."""
        return [
            {"case": case, "batch": batch.name}
            for case in cases
            for batch in self.batches(stage, case)
        ]

    def method_jobs(self, cases: Iterable[str]) -> list[Wildcards]:
        """Return the wildcards of every batch and method of the identification."""
        return [
            {"case": case, "method": method, "batch": batch.name}
            for case in cases
            for method in self.study.methods
            for batch in self.batches("identifications", case, method)
        ]

    @staticmethod
    def seeds_of(batch: str) -> list[int]:
        """Return the seeds of a batch, given its name.

        Raises
        ------
        BiogripError
            If the name has another form.
        """
        found = parse_batch(batch)
        if found is None or found.last < found.first:
            raise BiogripError(f"--batch: found '{batch}', allowed is seeds_FIRST-LAST.")
        return found.seeds
