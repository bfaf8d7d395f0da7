"""Whether differences between dishes hold the truth, on simulated dishes from traces to verdicts.

``python -m tests.helpers.groups_campaign [pairs [rate_Hz ...]]`` takes some 15 minutes for 500
pairs at one rate, and writes the table that the documentation shows. The test suite has a few.
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
from biogrip.groups.comparison import difference
from biogrip.groups.group_findings import log_deviation
from biogrip.groups.population import FEWEST_CELLS, Estimates, estimate_population
from biogrip.groups.power import power
from biogrip.identifiability.likelihood import MISSED, Likelihood, make_likelihood
from biogrip.identifiability.profiles import Profile, compute_profiles
from biogrip.identifiability.quantities import Quantity, parameters_and_sum
from biogrip.identifiability.verdicts import Finding
from biogrip.identify.problem import make_problem
from biogrip.products.stages.full_judgements import refitted
from biogrip.response.linear import rotation, step_response
from tests.helpers.places import ROOT
from tests.helpers.problems import GRIPPER, MODEL, RANGES, SAMPLES, TORQUE, condensed_of, identified

TABLE = ROOT / "results" / "published" / "groups" / "tables" / "dishes.csv"
CELL = SAMPLES["endothelial_cell"]
QUANTITIES = [q for q in parameters_and_sum(MODEL) if q.label in ("k", "k_p", "c + c_p")]
CELLS, SPREAD, RATIO, CONFIDENCE = 10, 0.3, 1.5, 0.95
NOISE = Noise("gaussian", 0.1, "peak")
PAIRS_AT_ONCE = 5


@dataclass(frozen=True)
class Dish:
    """Cells that determine a quantity: true logarithms, and what their traces tell of them."""

    truth: Array
    estimates: Estimates


def dishes(pairs: Sequence[int], rate_Hz: float, cells: int = CELLS) -> list[list[list[Dish]]]:
    """Simulate pairs of dishes; by pair, by dish (the first has the larger values), by quantity.

    The parameters of a dish's cells are log-normal about those of the paper's cell, all but c_p
    larger by a ratio in the first; each gives one noisy trace, judged as users are shown it.
    """
    truth = np.log([CELL[name] for name in MODEL.names])
    varied = np.array([name != "c_p" for name in MODEL.names])
    times = sample_times(400.0, rate_Hz)
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
                    MODEL,
                    TORQUE,
                    times,
                    add_noise(clean, NOISE, rng),
                    RANGES,
                    condensed,
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
        ]
    )
    return [
        [
            [
                _dish(quantity, q, logs[2 * p + d], judged[(2 * p + d) * cells :][:cells])
                for q, quantity in enumerate(QUANTITIES)
            ]
            for d in range(2)
        ]
        for p in range(len(pairs))
    ]


def profiles(likelihoods: list[Likelihood]) -> list[list[tuple[Likelihood, Profile]]]:
    """Profiles of the quantities, followed again where one has led deeper."""
    own = compute_profiles(likelihoods, QUANTITIES, smooth=False)
    for index, likelihood in enumerate(likelihoods):
        lowest = min(own[index], key=lambda each: float(each.increases.min()))
        if lowest.increases.min() < -MISSED:
            deeper = refitted(likelihood, lowest.lowest, CONFIDENCE)
            if deeper is not None:
                likelihoods[index] = deeper
                own[index] = compute_profiles([deeper], QUANTITIES, smooth=False)[0]
    return [
        [(likelihood, each) for each in some]
        for likelihood, some in zip(likelihoods, own, strict=True)
    ]


def _dish(
    quantity: Quantity, q: int, logs: Array, judged: list[list[tuple[Likelihood, Profile]]]
) -> Dish:
    truth, names, values, deviations = [], [], [], []
    for cell, (x, of_cell) in enumerate(zip(logs, judged, strict=True)):
        likelihood, profile = of_cell[q]
        if profile.low is not None and profile.high is not None:
            truth.append(quantity.log(x))
            names.append(f"cell {cell}")
            values.append(profile.best)
            deviations.append(log_deviation(Finding(quantity, profile, 0.0), likelihood))
    return Dish(np.array(truth), Estimates(tuple(names), np.array(values), np.array(deviations)))


def counted(found: list[list[list[Dish]]], rate_Hz: float, cells: int = CELLS) -> pd.DataFrame:
    """Count how often intervals hold the truth and differences are seen, a row a quantity."""
    rows = []
    for q, quantity in enumerate(QUANTITIES):
        held, seen, spreads, shrunk, widths = [], [], [], [], []
        determined = []
        for first, second in ((one[q], other[q]) for one, other in found):
            own = [each.estimates for each in (first, second)]
            determined += [len(each.cells) for each in own]
            if min(len(each.cells) for each in own) < FEWEST_CELLS:
                continue
            populations = [estimate_population(each, CONFIDENCE) for each in own]
            compared = difference(*populations)
            held.append(compared.low <= RATIO <= compared.high)
            seen.append(compared.p_value < 1 - CONFIDENCE)
            for dish, each in zip((first, second), populations, strict=True):
                spreads.append(each.spread_low <= SPREAD <= each.spread_high)
                away = np.abs(each.shrunk - dish.truth)
                shrunk += list(away <= each.reach * each.shrunk_deviations)
                widths += list(each.estimates.deviations**2)
        error = float(np.sqrt(np.mean(widths)))
        rows.append(
            {
                "quantity": quantity.label,
                "rate_Hz": rate_Hz,
                "cells": cells,
                "spread": SPREAD,
                "ratio": RATIO,
                "determined_percent": 100 * np.sum(determined) / (2 * cells * len(found)),
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


def main(pairs: int, rates_Hz: list[float]) -> None:
    """Write the table, and print it."""
    tables = []
    for rate_Hz in rates_Hz:
        found = []
        for start in range(0, pairs, PAIRS_AT_ONCE):
            found += dishes(range(start, min(pairs, start + PAIRS_AT_ONCE)), rate_Hz)
            print(f"{rate_Hz:g} Hz: {len(found)} of {pairs} pairs", flush=True)
        tables.append(counted(found, rate_Hz))
        print(tables[-1].to_string(index=False), flush=True)
    write(pd.concat(tables), TABLE)


def write(table: pd.DataFrame, path: Path) -> None:
    """Write a table as those of the study are."""
    path.parent.mkdir(parents=True, exist_ok=True)
    table.to_csv(path, index=False, float_format="%.4g")


if __name__ == "__main__":
    main(
        int(sys.argv[1]) if len(sys.argv) > 1 else 500,
        [float(rate) for rate in sys.argv[2:]] or [10.0, 1.0],
    )
