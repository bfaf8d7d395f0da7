"""Whether differences between dishes hold the truth, on simulated dishes from traces to verdicts.

``python -m tests.helpers.groups_campaign [pairs [setting ...]]`` takes some 15 minutes for 500
pairs of one of `SETTINGS`, and writes the table that the documentation shows, other settings as
they are there. The test suite has a few.
"""

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from biogrip.arrays import Array
from biogrip.experiment.noise import Noise, add_noise
from biogrip.experiment.protocol import sample_times
from biogrip.experiment.sample import SampleModel, with_fixed
from biogrip.groups.comparison import difference
from biogrip.groups.group_findings import CellProfile, population_of
from biogrip.groups.population import Interval
from biogrip.groups.power import power
from biogrip.identifiability.likelihood import MISSED, Likelihood, make_likelihood
from biogrip.identifiability.profiles import Profile, compute_profiles
from biogrip.identifiability.quantities import Quantity, parameters_and_sum
from biogrip.identify.problem import make_problem
from biogrip.instrument.instruments import INSTRUMENTS
from biogrip.products.stages.full_judgements import refitted
from biogrip.response.linear import rotation, step_response
from tests.helpers.places import ROOT
from tests.helpers.problems import GRIPPER, MODEL, RANGES, SAMPLES, TORQUE, condensed_of, identified

TABLE = ROOT / "results" / "published" / "groups" / "tables" / "dishes.csv"
CELL = SAMPLES["endothelial_cell"]
CELLS, SPREAD, RATIO, CONFIDENCE = 10, 0.3, 1.5, 0.95
NOISE = Noise("gaussian", 0.1, "peak")
PAIRS_AT_ONCE = 5


@dataclass(frozen=True)
class Setting:
    """What cells are measured and identified with.

    Parameters
    ----------
    rate_Hz
        Sampling rate.
    without_c_p
        True if c_p, which is next to nothing in these cells, is known to be none.
    """

    rate_Hz: float
    without_c_p: bool = False

    @property
    def model(self) -> SampleModel:
        """Model that is identified."""
        return with_fixed(MODEL, {"c_p": 0.0} if self.without_c_p else {})

    @property
    def quantities(self) -> list[Quantity]:
        """Quantities that are compared."""
        names = ("k", "k_p", "c" if self.without_c_p else "c + c_p")
        return [q for q in parameters_and_sum(self.model) if q.label in names]


SETTINGS = {
    "10 Hz": Setting(10.0),
    "1 Hz": Setting(1.0),
    "1 Hz without c_p": Setting(1.0, without_c_p=True),
}


@dataclass(frozen=True)
class Dish:
    """Cells of a dish: true logarithms of a quantity, and their profiles."""

    truth: Array
    cells: list[CellProfile]


def dishes(pairs: Sequence[int], setting: Setting, cells: int = CELLS) -> list[list[list[Dish]]]:
    """Simulate pairs of dishes; by pair, by dish (the first has the larger values), by quantity.

    The parameters of a dish's cells are log-normal about those of the paper's cell, all but c_p
    larger by a ratio in the first; each gives one noisy trace, judged as users are shown it.
    """
    truth = np.log([CELL[name] for name in MODEL.names])
    varied = np.array([name != "c_p" for name in MODEL.names])
    times, model, quantities = (
        sample_times(400.0, setting.rate_Hz),
        setting.model,
        setting.quantities,
    )
    searched = [MODEL.names.index(name) for name in model.names]
    condensed = condensed_of(TORQUE, times)
    logs, problems = [], []
    for pair in pairs:
        rng = np.random.default_rng([pair, 20])
        for dish in range(2):
            scatter = SPREAD * rng.standard_normal((cells, len(truth)))
            by = np.log(RATIO) if dish == 0 else 0.0
            logs.append(truth + varied * (by + scatter))
            responses = rotation(
                step_response(GRIPPER, MODEL.network(np.exp(logs[-1]))), TORQUE, times
            )
            problems += [
                make_problem(
                    GRIPPER,
                    model,
                    TORQUE,
                    times,
                    add_noise(clean, NOISE, rng),
                    RANGES,
                    condensed,
                    instrument=INSTRUMENTS["rotation"],
                )
                for clean in responses
            ]
    seeds = [2 * cells * pair + cell for pair in pairs for cell in range(2 * cells)]
    found = identified(problems, seeds)
    judged = profiles(
        [
            make_likelihood(
                problem, np.log(each.parameters), each.misfit_rad, confidence=CONFIDENCE
            )
            for problem, each in zip(problems, found, strict=True)
        ],
        quantities,
    )
    return [
        [
            [
                _dish(
                    quantity,
                    q,
                    logs[2 * p + d][:, searched],
                    judged[(2 * p + d) * cells :][:cells],
                )
                for q, quantity in enumerate(quantities)
            ]
            for d in range(2)
        ]
        for p in range(len(pairs))
    ]


def profiles(
    likelihoods: list[Likelihood], quantities: Sequence[Quantity]
) -> list[list[tuple[Likelihood, Profile]]]:
    """Profiles of quantities, followed again where one has led deeper."""
    own = compute_profiles(likelihoods, quantities, smooth=False)
    for index, likelihood in enumerate(likelihoods):
        lowest = min(own[index], key=lambda each: float(each.increases.min()))
        if lowest.increases.min() < -MISSED:
            deeper = refitted(likelihood, lowest.lowest, CONFIDENCE)
            if deeper is not None:
                likelihoods[index] = deeper
                own[index] = compute_profiles([deeper], quantities, smooth=False)[0]
    return [
        [(likelihood, each) for each in some]
        for likelihood, some in zip(likelihoods, own, strict=True)
    ]


def _dish(
    quantity: Quantity, q: int, logs: Array, judged: list[list[tuple[Likelihood, Profile]]]
) -> Dish:
    cells = [
        CellProfile(f"cell {number}", of_cell[q][1], of_cell[q][0].threshold, of_cell[q][0].freedom)
        for number, of_cell in enumerate(judged)
    ]
    return Dish(np.array([float(quantity.log(x)) for x in logs]), cells)


def held_by(interval: Interval, truth: float) -> bool:
    """Return whether an interval holds the truth."""
    return interval.low <= truth <= interval.high


def counted(found: list[list[list[Dish]]], setting: Setting, cells: int = CELLS) -> pd.DataFrame:
    """Count how often intervals hold the truth and differences are seen, a row a quantity."""
    rows = []
    for q, quantity in enumerate(setting.quantities):
        held, seen, spreads, shrunk, widths = [], [], [], [], []
        determined = []
        for first, second in ((one[q], other[q]) for one, other in found):
            determined += [cell.is_determined for dish in (first, second) for cell in dish.cells]
            one, other = (population_of(dish.cells, CONFIDENCE) for dish in (first, second))
            if one is None or other is None:
                continue
            compared = difference(one, other)
            held.append(compared.low <= RATIO <= compared.high)
            seen.append(compared.p_value < 1 - CONFIDENCE)
            for dish, each in ((first, one), (second, other)):
                spreads.append(held_by(each.spread, SPREAD))
                known = zip(each.cells, dish.truth, dish.cells, strict=True)
                shrunk += [held_by(own, y) for own, y, cell in known if cell.is_bounded]
                widths += [cell.log_deviation**2 for cell in dish.cells if cell.is_determined]
        error = float(np.sqrt(np.mean(widths)))
        rows.append(
            {
                "quantity": quantity.label,
                "rate_Hz": setting.rate_Hz,
                "c_p": "none" if setting.without_c_p else "fitted",
                "cells": cells,
                "spread": SPREAD,
                "ratio": RATIO,
                "determined_percent": 100 * np.mean(determined),
                "error": error,
                "pairs": len(held),
                "coverage_percent": 100 * np.mean(held),
                "power_percent": 100 * np.mean(seen),
                "designed_power_percent": 100 * power(RATIO, cells, SPREAD, error, CONFIDENCE),
                "spread_coverage_percent": 100 * np.mean(spreads),
                "shrunk_coverage_percent": 100 * np.mean(shrunk),
            }
        )
    return pd.DataFrame(rows)


def main(pairs: int, names: Sequence[str]) -> None:
    """Write the table, and print it."""
    tables = dict(iter(pd.read_csv(TABLE).groupby(["rate_Hz", "c_p"])))
    for name in names:
        found, setting = [], SETTINGS[name]
        for start in range(0, pairs, PAIRS_AT_ONCE):
            found += dishes(range(start, min(pairs, start + PAIRS_AT_ONCE)), setting)
            print(f"{name}: {len(found)} of {pairs} pairs", flush=True)
        own = counted(found, setting)
        tables[setting.rate_Hz, own["c_p"].iloc[0]] = own
        print(own.to_string(index=False), flush=True)
    order = [(each.rate_Hz, "none" if each.without_c_p else "fitted") for each in SETTINGS.values()]
    write(pd.concat([tables[key] for key in order if key in tables]), TABLE)


def write(table: pd.DataFrame, path: Path) -> None:
    """Write a table as those of the study are."""
    path.parent.mkdir(parents=True, exist_ok=True)
    table.to_csv(path, index=False, float_format="%.4g")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 500, sys.argv[2:] or list(SETTINGS))
