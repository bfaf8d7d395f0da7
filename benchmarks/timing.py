"""Timing of calls that alternate, so that a slow moment of the machine strikes them all."""

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from biogrip.arrays import Array

# Shorter calls are repeated within a round until it lasts so long.
_ROUND_S = 0.05

Result = TypeVar("Result")


@dataclass(frozen=True)
class Timed:
    """What alternating calls took.

    Parameters
    ----------
    seconds
        By name, the time of one call in every round.
    """

    seconds: Mapping[str, Array]

    def against(self, name: str, ours: str) -> dict[str, Any]:
        """Return a row's time and its ratio to ours, taken round by round."""
        ratios = self.seconds[name] / self.seconds[ours]
        return {
            "time_ms": 1e3 * float(np.median(self.seconds[name])),
            "times_ours": float(np.median(ratios)),
            "times_ours_lowest": float(ratios.min()),
            "times_ours_highest": float(ratios.max()),
        }


def alternate(calls: Mapping[str, Callable[[], object]], rounds: int) -> Timed:
    """Time calls in turn, round by round, after a warm-up of each."""
    repeats = {name: math.ceil(_ROUND_S / clocked(call)[0]) for name, call in calls.items()}

    def once(name: str) -> float:
        def several() -> None:
            for _ in range(repeats[name]):
                calls[name]()

        return clocked(several)[0] / repeats[name]

    rows = [[once(name) for name in calls] for _ in range(rounds)]
    return Timed(dict(zip(calls, np.array(rows).T, strict=True)))


def clocked(call: Callable[[], Result]) -> tuple[float, Result]:
    """Return how many seconds a call took, and what it returned."""
    start = time.perf_counter()
    result = call()
    return time.perf_counter() - start, result
