"""Rules by which a claim of the paper is called replicated, in part, not, or impossible to tell.

Claims are functions under `@claim`, in the modules `claims_on_*`; this one has the rules that they
share, and the results that they are given.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import pandas as pd

from biogrip.arrays import BoolArray
from biogrip.fit.methods import share_with_limits
from biogrip.records.identifications import read_histories, read_identifications
from biogrip.records.rows import read_frame
from biogrip.study.study import Case, Study

REPLICATED, IN_PART, NOT = "replicated", "in part", "not"
OUTSIDE = "outside the printed encoding"
UNDECIDED = "cannot be told"

MOST, FEW = 0.9, 0.1
"""Shares from which, and up to which, something holds nearly always or hardly ever."""
CLOSE = 0.05
"""Relative difference up to which a number that the paper rounds agrees."""
FEWEST_SEEDS = 20
"""Seeds that shares and ranges take: with fewer, none is outside of the middle 90 %."""
NEAR = 0.1
"""Relative difference up to which a run's identified value counts as the paper's."""
HALF_A_DECADE = 0.5
"""Largest difference of common logarithms within an order of magnitude."""

RULES = (
    f"Of shares of seeds or of compared settings, {100 * MOST:g} % and more are replicated, up to "
    f"{100 * FEW:g} % not; 95 % limits of shares of seeds are in brackets. A printed number that "
    f"the paper rounds is replicated if it is within {100 * CLOSE:g} % of ours. An identified "
    f"value is judged by the share of the seeds within {100 * NEAR:g} % of it. It is {OUTSIDE} if "
    "the nearest value of the genes, rounded to its digits, is another: no run can reach it; so is "
    "an error below that of the value nearest to the target. The order of magnitude is half a "
    "decade on both sides. What is said of several samples, parameters or numbers is judged one by "
    "one: in part if some is replicated and some is not, or if it holds once a misprint is put "
    "right. It cannot be told if nothing here or in the paper can contradict it, as a value that "
    "no trace determines, if what it says was used to choose a setting, or if the study lacks what "
    f"it takes, as {FEWEST_SEEDS} seeds."
)
"""The rules in words."""


@dataclass(frozen=True)
class Judged:
    """A verdict on a claim, with the evidence in words."""

    verdict: str
    evidence: str


@dataclass(frozen=True)
class Claim:
    """A claim of the paper."""

    place: str
    """Section, table or figure."""
    words: str
    """The claim as the paper has it, shortened."""
    judge: Callable[["Results"], Judged]


CLAIMS: list[Claim] = []
"""All claims, in the order of the paper, which is that of their functions."""

_Judge = TypeVar("_Judge", bound=Callable[["Results"], Judged])


def claim(place: str, words: str) -> Callable[[_Judge], _Judge]:
    """Add a claim, with the decorated function as its rule, to `CLAIMS`."""

    def add(judge: _Judge) -> _Judge:
        CLAIMS.append(Claim(place, words, judge))
        return judge

    return add


def by_share(those: "BoolArray | pd.Series[bool] | float") -> str:
    """Judge something by the share of seeds or settings for which it holds."""
    share = np.mean(those)
    if share >= MOST:
        return REPLICATED
    return IN_PART if share > FEW else NOT


def by_number(printed: float, found: float) -> str:
    """Judge a number that the paper rounds."""
    return REPLICATED if abs(found / printed - 1) <= CLOSE else NOT


def by_value(near: BoolArray, *, encodable: bool, determined: bool) -> str:
    """Judge an identified value by the share of the seeds near it, if a run can come near.

    A value that the encoding has may still be one that no trace determines.
    """
    if not encodable:
        return OUTSIDE
    return by_share(near) if determined else UNDECIDED


def is_encodable(printed: float, nearest: float) -> bool:
    """Return whether the nearest value of the genes is the printed one, rounded to its digits."""
    exponent = int(Decimal(f"{printed:.15g}").as_tuple().exponent)
    return abs(nearest - printed) <= (0.5 + 1e-9) * 10.0**exponent


def altogether(verdicts: Iterable[str]) -> str:
    """Return the verdict on something that is said of several things."""
    found = set(verdicts)
    if found & {REPLICATED, IN_PART}:
        return found.pop() if len(found) == 1 else IN_PART
    return next((each for each in (NOT, OUTSIDE) if each in found), UNDECIDED)


def plain(value: float, digits: int = 3) -> str:
    """Return a number in words of evidence: with commas, not with an exponent, if it is large."""
    return f"{float(f'{value:.{digits}g}'):,g}"


def percent(share: float) -> str:
    """Return a share in words of evidence."""
    return f"{100 * share:.0f} %"


def of_seeds(those: "pd.Series[bool] | BoolArray") -> str:
    """Return a share of seeds, (n_seeds,), in words, with its 95 % limits."""
    share, low, high = share_with_limits(int(np.sum(those)), len(those))
    return f"{percent(share)} ({100 * low:.0f} to {100 * high:.0f})"


def within_a_decade(values: "pd.Series[float]", target: float) -> BoolArray:
    """Return whether values are of the same order of magnitude as the target, (n_seeds,)."""
    apart = np.abs(np.log10(values.to_numpy(float) / target))
    near: BoolArray = apart <= HALF_A_DECADE
    return near


class LackingError(Exception):
    """The study does not have what a claim is judged by."""


@dataclass(frozen=True)
class Runs:
    """The genetic algorithm's runs on one of the paper's samples."""

    case: Case
    found: pd.DataFrame
    """Identifications, a row per seed; parameters by name."""
    history: pd.DataFrame
    """Best individual, a row per seed and generation; parameters by name."""

    @property
    def last_improvement(self) -> "pd.Series[float]":
        """Generation in which the best misfit fell for the last time, by seed."""
        falls = self.history.groupby("seed")["best_misfit"].diff() < 0
        return self.history["generation"].where(falls, 0).groupby(self.history["seed"]).max()


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
        """Return a table; raise `LackingError` if the study does not have it."""
        if name not in self.tables:
            raise LackingError(f"the study has no table {name}")
        return self.tables[name]

    def of_sweep(self, name: str) -> pd.DataFrame:
        """Return a published table of a sweep."""
        return pd.read_csv(self.sweeps[name])

    def runs_of(self, number: int) -> Runs:
        """Return the runs on the sample of a table of the paper.

        Raise `LackingError` if the study has none, or too few to tell a share or a range.
        """
        if number not in self.runs:
            raise LackingError(f"the study has no runs of the algorithm for Table {number}")
        if (seeds := len(self.runs[number].found)) < FEWEST_SEEDS:
            raise LackingError(f"the study has {seeds} seeds, and it takes {FEWEST_SEEDS}")
        return self.runs[number]

    def case_of(self, number: int) -> str:
        """Return the name of the case of a table of the paper, else raise `LackingError`."""
        for name, case in self.study.cases.items():
            if case.published.table == number:
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
    runs = {}
    files = zip(study.cases.values(), identifications, histories, strict=True)
    for case, identified, history in files:
        number = case.published.table
        if study.shown == "genetic" and number is not None:
            names = {p.column: p.name for p in case.sample.model.parameters}
            found = read_identifications(identified, "genetic").rename(columns=names)
            best = read_histories(history, "genetic", ["best_misfit", *names])
            runs[number] = Runs(case, found, best.rename(columns=names))
    of_study = {path.stem: read_frame(path, "a table", ()) for path in tables}
    return Results(study, of_study, runs, {file.stem: file for file in sweeps})
