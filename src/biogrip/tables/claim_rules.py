"""Rules by which a claim of the paper is called replicated, in part, not, or impossible to tell."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import pandas as pd

from biogrip.arrays import Array

REPLICATED, IN_PART, NOT = "replicated", "in part", "not"
UNDECIDED = "cannot be told"

MOST, FEW = 0.9, 0.1
"""Shares from which, and up to which, something holds nearly always or hardly ever."""
CLOSE = 0.05
"""Relative difference up to which a number that the paper rounds agrees."""
FEWEST_SEEDS = 20
"""Seeds that shares and ranges take: with fewer, none is outside of the middle 90 %."""
HALF_A_DECADE = 0.5
"""Largest difference of common logarithms within an order of magnitude."""

RULES = (
    f"Of shares of seeds or of compared settings, {100 * MOST:g} % and more are replicated, up to "
    f"{100 * FEW:g} % not. A printed number that the paper rounds is replicated if it is within "
    f"{100 * CLOSE:g} % of ours; one of a single run if it is within the middle half of the seeds, "
    "in part if within the middle 90 %. An identified value is replicated if it is within the "
    "middle 90 % of the seeds and the typical seed is as close to the target as the limits of a "
    "trace without noise, in part if it is only within. The order of magnitude is half a decade "
    "on both sides. What is said of several samples, parameters or numbers is judged one by one: "
    "in part if they differ, or if it holds once a misprint is put right. It cannot be told if "
    "nothing here or in the paper can contradict it, or if the study lacks what it takes, as "
    f"{FEWEST_SEEDS} seeds."
)
"""The rules in words."""


@dataclass(frozen=True)
class Judged:
    """A verdict on a claim, with the evidence in words."""

    verdict: str
    evidence: str


def by_share(share: float) -> str:
    """Judge something that holds for a share of seeds or settings."""
    if share >= MOST:
        return REPLICATED
    return IN_PART if share > FEW else NOT


def by_number(printed: float, found: float) -> str:
    """Judge a number that the paper rounds."""
    return REPLICATED if abs(found / printed - 1) <= CLOSE else NOT


def by_range(printed: float, of_seeds: "pd.Series[float] | pd.Series[int]") -> str:
    """Judge the number of a single run by those of all seeds."""
    low, first, third, high = np.percentile(of_seeds.to_numpy(float), [5, 25, 75, 95])
    if first <= printed <= third:
        return REPLICATED
    return IN_PART if low <= printed <= high else NOT


def by_value(low: float, printed: float, high: float, *, is_close: bool) -> str:
    """Judge an identified value by the middle 90 % of the seeds, and the typical seed."""
    if not low <= printed <= high:
        return NOT
    return REPLICATED if is_close else IN_PART


def altogether(verdicts: Iterable[str]) -> str:
    """Return the verdict on something that is said of several things."""
    found = set(verdicts)
    return found.pop() if len(found) == 1 else IN_PART


def plain(value: float, digits: int = 3) -> str:
    """Return a number in words of evidence: with commas, not with an exponent, if it is large."""
    return f"{float(f'{value:.{digits}g}'):,g}"


def share_within_a_decade(values: "pd.Series[float]", target: float) -> float:
    """Return the share of values of the same order of magnitude as the target."""
    apart: Array = np.abs(np.log10(values.to_numpy(float) / target))
    return float(np.mean(apart <= HALF_A_DECADE))
