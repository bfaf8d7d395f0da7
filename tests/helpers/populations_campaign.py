"""How often populations hold the truth where errors are large and some cells are only bounded.

``python -m tests.helpers.populations_campaign [pairs]`` takes some minutes for 500 pairs a row, and
writes the table that the documentation shows. The test suite has a few.

A cell of log-stiffness y rotates by a exp(-y/a), read with normal noise of which the variance is
estimated, too: like a stiff sample. For a = 1 a cell that is stiffer than its noise lets see is
bounded below only; for a = 5 all cells are determined, and their profiles a little skewed.
"""

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np
import pandas as pd
from scipy.special import fdtri

from biogrip.groups.comparison import difference
from biogrip.groups.group_findings import CellProfile, population_of
from biogrip.groups.population import Population
from biogrip.identifiability.likelihood import CERTAIN
from biogrip.identifiability.profiles import Profile
from tests.helpers.groups_campaign import CONFIDENCE, SPREAD, held_by, write
from tests.helpers.places import ROOT

TABLE = ROOT / "results" / "published" / "groups" / "tables" / "populations.csv"
SETTINGS = tuple(product(((1.0, 0.03), (5.0, 0.3), (1.0, 0.2)), (5, 12)))
"""Bend a and error of a median cell; cells a dish."""
FREEDOM = 20
_LIMIT, _CERTAIN = (float(root) for root in np.sqrt(fdtri(1, FREEDOM, (CONFIDENCE, CERTAIN))))
_NEAR, _RANGE = np.arange(-4.0, 4.1, 0.5), np.linspace(-9.0, 9.0, 35)


@dataclass(frozen=True)
class Cell:
    """A cell as its noisy trace tells of it."""

    truth: float
    told: CellProfile


def cell(name: str, bend: float, error: float, rng: np.random.Generator) -> Cell:
    """Draw a cell, read it, and profile it as traces are."""
    y = SPREAD * rng.standard_normal()
    read = bend * np.exp(-y / bend) + error * rng.standard_normal()
    noise = error * np.sqrt(rng.chisquare(FREEDOM) / FREEDOM)

    def log_stiffness(rotation: float) -> float:
        return float(np.clip(-bend * np.log(max(rotation, 1e-300) / bend), *_RANGE[[0, -1]]))

    best = log_stiffness(read)
    near = best + noise * np.exp(best / bend) * _NEAR
    values = np.unique(np.concatenate((near[np.abs(near) < _RANGE[-1]], _RANGE)))
    increases = ((bend * np.exp(-values / bend) - read) / noise) ** 2
    least = ((bend * np.exp(-best / bend) - read) / noise) ** 2
    increases -= least
    reach, far = (noise * np.sqrt(level**2 + least) for level in (_LIMIT, _CERTAIN))
    ends = bend * np.exp(-_RANGE[[0, -1]] / bend)
    low = log_stiffness(read + reach) if ends[0] > read + far else None
    high = log_stiffness(read - reach) if ends[1] < read - far else None
    profile = Profile(values, increases, best, low, high, np.empty(0))
    return Cell(y, CellProfile(name, profile, _LIMIT**2, FREEDOM))


def rows(pairs: int) -> Iterator[dict[str, object]]:
    """Yield for each setting how often intervals of equal dishes hold the truth."""
    for (bend, error), cells in SETTINGS:
        ratios, medians, spreads, shrunk, determined = [], [], [], [], []
        for pair in range(pairs):
            rng = np.random.default_rng([pair, cells, int(100 * error), int(bend)])
            found: list[Population] = []
            for _ in range(2):
                dish = [cell(f"cell {number}", bend, error, rng) for number in range(cells)]
                determined += [own.told.is_determined for own in dish]
                population = population_of([own.told for own in dish], CONFIDENCE)
                if population is None:
                    continue
                found.append(population)
                medians.append(held_by(population.centre, 0.0))
                spreads.append(held_by(population.spread, SPREAD))
                shrunk += [
                    held_by(interval, own.truth)
                    for interval, own in zip(population.cells, dish, strict=True)
                    if own.told.is_bounded
                ]
            if len(found) == 2:
                ratios.append(difference(*found).p_value < 1 - CONFIDENCE)
        yield {
            "cells": cells,
            "spread": SPREAD,
            "error": error,
            "determined_percent": 100 * np.mean(determined),
            "pairs": len(ratios),
            "false_positive_percent": 100 * np.mean(ratios),
            "median_coverage_percent": 100 * np.mean(medians),
            "spread_coverage_percent": 100 * np.mean(spreads),
            "shrunk_coverage_percent": 100 * np.mean(shrunk),
        }


def main(pairs: int) -> None:
    """Write the table, and print it."""
    found = []
    for row in rows(pairs):
        found.append(row)
        print(*row.values(), flush=True)
    write(pd.DataFrame(found), TABLE)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 500)
