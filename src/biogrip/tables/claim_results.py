"""Results that claims of the paper are judged by."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from biogrip.experiment.truth import Truth
from biogrip.records.identifications import read_histories, read_identifications
from biogrip.records.rows import read_frame
from biogrip.study.study import Study
from biogrip.tables.claim_rules import FEWEST_SEEDS


class LackingError(Exception):
    """The study does not have what a claim is judged by."""


@dataclass(frozen=True)
class Runs:
    """The genetic algorithm's runs on one of the paper's samples."""

    case: str
    truth: Truth
    found: pd.DataFrame
    """Identifications, a row per seed."""
    history: pd.DataFrame
    """Best individual, a row per seed and generation."""

    def identified(self, name: str) -> "pd.Series[float]":
        """Return the identified values of a parameter, one a seed."""
        return self.found[self.column(name)]

    def at_generation(self, generation: int, name: str) -> "pd.Series[float]":
        """Return a parameter of the best individual of each seed in a generation.

        Of a run that has stopped before it is that of the last generation.
        """
        until = self.history[self.history["generation"] <= generation]
        return until.groupby("seed")[self.column(name)].last()

    @property
    def last_improvement(self) -> "pd.Series[float]":
        """Generation in which the best misfit fell for the last time, by seed."""
        falls = self.history.groupby("seed")["best_misfit"].diff() < 0
        return self.history["generation"].where(falls, 0).groupby(self.history["seed"]).max()

    def column(self, name: str) -> str:
        """Return the column of a parameter."""
        return next(p.column for p in self.truth.model.parameters if p.name == name)


@dataclass(frozen=True)
class Results:
    """The study's results, as far as claims are judged by them."""

    study: Any
    """What the table of claims uses of the study."""
    tables: Mapping[str, pd.DataFrame]
    """Tables of the study by name."""
    runs: Mapping[int, Runs]
    """Runs by number of the paper's table."""
    sweeps: Mapping[str, Path]
    """Published tables of sweeps by name."""

    def table(self, name: str) -> pd.DataFrame:
        """Return a table.

        Raises
        ------
        LackingError
            If the study does not have it.
        """
        if name not in self.tables:
            raise LackingError(f"the study has no table {name}")
        return self.tables[name]

    def of_sweep(self, name: str) -> pd.DataFrame:
        """Return a published table of a sweep."""
        return pd.read_csv(self.sweeps[name])

    def runs_of(self, number: int) -> Runs:
        """Return the runs on the sample of a table of the paper.

        Raises
        ------
        LackingError
            If the study has none, or too few to tell a share or a range.
        """
        if number not in self.runs:
            raise LackingError(f"the study has no runs of the algorithm for Table {number}")
        if (seeds := len(self.runs[number].found)) < FEWEST_SEEDS:
            raise LackingError(f"the study has {seeds} seeds, and it takes {FEWEST_SEEDS}")
        return self.runs[number]

    def case_of(self, number: int) -> str:
        """Return the name of the case of a table of the paper.

        Raises
        ------
        LackingError
            If the study has none.
        """
        for name, case in self.study.cases.items():
            if case.truth.published.table == number:
                return str(name)
        raise LackingError(f"the study has no case of Table {number}")


def read_results(
    study: Study,
    identifications: list[Path],
    histories: list[Path],
    tables: list[Path],
    sweeps: list[Path],
) -> Results:
    """Read results from the files of all the paper's cases, in their order, and from tables."""
    found = {path.stem: read_frame(path, "a table", ()) for path in tables}
    runs = {}
    for (name, case), identified, history in zip(
        study.cases.items(), identifications, histories, strict=True
    ):
        number = case.truth.published.table
        if study.shown == "genetic" and number is not None:
            runs[number] = _runs(name, case.truth, identified, history)
    return Results(study, found, runs, {file.stem: file for file in sweeps})


def _runs(name: str, truth: Truth, identified: Path, history: Path) -> Runs:
    columns = ["best_misfit", *(p.column for p in truth.model.parameters)]
    found = read_identifications(identified, "genetic")
    return Runs(name, truth, found, read_histories(history, "genetic", columns))
