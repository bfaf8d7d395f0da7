"""Whether intervals hold the truth in noise as instruments have it, on simulated traces.

``python -m tests.helpers.noise_campaign [traces [kind ...]]`` takes some ten minutes for 500
traces of a kind, and writes the table that the documentation shows. The test suite has a few.
"""

import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from scipy.special import chdtrc

from biogrip.arrays import Array
from biogrip.experiment.noise import Noise, add_noise
from biogrip.experiment.noise_parts import AR1, Drift, Flicker, Outliers
from biogrip.identifiability.likelihood import Likelihood, compute_fall, make_likelihood
from biogrip.identifiability.limits import find_limits
from biogrip.identifiability.quantities import Quantity, parameters_and_sum
from biogrip.identifiability.whiteness import FALSE_ALARM, doubts_about_noise
from biogrip.identify.answer import Identification
from biogrip.identify.multi_start import identify_from
from biogrip.identify.noise_growth import compute_growth
from biogrip.identify.problem import Problem
from biogrip.identify.trace_fit import trace_fit
from biogrip.instrument.gripper import GRIPPER
from biogrip.response.simulation import simulated_rotation
from tests.helpers.default import STUDY
from tests.helpers.groups_campaign import write
from tests.helpers.places import ROOT

TABLE = ROOT / "results" / "published" / "noise" / "tables" / "noise.csv"
CONFIDENCE, LEVEL = 0.95, 0.1


@dataclass(frozen=True)
class Kind:
    """What traces have beside white noise.

    Parameters
    ----------
    title
        In print.
    noise
        What is added.
    case
        Sample and protocol.
    gripper
        Relative error of the arms' stiffness, a standard deviation, the same for both.
    """

    title: str
    noise: Noise
    case: str = "endothelial_cell"
    gripper: float = 0.0


def noise(
    ar1: AR1 | None = None,
    flicker: Flicker | None = None,
    drift: Drift | None = None,
    outliers: Outliers | None = None,
) -> Noise:
    return Noise(
        "gaussian", LEVEL, "peak", ar1=ar1, flicker=flicker, drift=drift, outliers=outliers
    )


KINDS = {
    "white": Kind("white", noise()),
    "fast": Kind("AR(1), all of it, 0.2 s", noise(AR1(1.0, 0.2))),
    "slow": Kind("AR(1), a tenth, 10 s", noise(AR1(0.1, 10.0))),
    "faint": Kind("AR(1), a fiftieth, 10 s", noise(AR1(0.02, 10.0))),
    "flicker": Kind("1/f, three tenths", noise(flicker=Flicker(0.3))),
    "drift": Kind("drift of 0.4 standard deviations", noise(drift=Drift(0.4))),
    "outliers": Kind("one in a hundred ten times as large", noise(outliers=Outliers(0.01, 10.0))),
    "growing": Kind("in proportion to the rotation", Noise("gaussian", LEVEL, "signal")),
    "all": Kind(
        "half of each of these",
        noise(AR1(0.05, 10.0), Flicker(0.15), Drift(0.2), Outliers(0.005, 10.0)),
    ),
    "gripper": Kind("white; stiffness known to 5 %", noise(), "liquid_drop_2", 0.05),
}


@dataclass(frozen=True)
class Seen:
    """What one trace gave: widths of intervals, and whether they hold the truth; by quantity.

    Parameters
    ----------
    ignored, allowed : list of (width, held)
        With white noise and a gripper that is known; with what there is.
    flagged
        Whether something is said against white noise.
    """

    ignored: list[tuple[float, bool]]
    allowed: list[tuple[float, bool]]
    flagged: bool


def quantities(case: str) -> list[Quantity]:
    """Return those that traces of a case determine."""
    every = parameters_and_sum(STUDY.cases[case].problem.searched)
    told = ("k", "c", "c + c_p") if case == "liquid_drop_2" else ("k", "k_p", "c", "c + c_p")
    return [each for each in every if each.label in told]


def seen(kind: Kind, seed: int) -> Seen:
    """Simulate a trace, and judge it in both ways; fits start at the truth."""
    case = STUDY.cases[kind.case]
    case_problem, rng = case.problem, np.random.default_rng([seed, 16])
    time_s = case.sampling.over(case_problem.torque.end_s)
    sample = case.sample.model.sample(case.parameters)
    error = kind.gripper * rng.standard_normal()
    left, right = (
        replace(arm, stiffness_Nm_per_rad=arm.stiffness_Nm_per_rad * (1 + error))
        for arm in (case_problem.gripper.left, case_problem.gripper.right)
    )
    gripper = replace(case_problem.gripper, left=left, right=right)
    clean = simulated_rotation(gripper, sample, case_problem.torque, time_s, nonlinear=False)[0]
    trace = add_noise(clean, kind.noise, rng, time_s)
    truth = case_problem.logs(case.parameters)

    def find(problem: Problem) -> Identification:
        return identify_from(problem, truth)

    plain = case_problem.of(time_s, trace)
    ignored = _likelihood(plain, find(plain))
    more = replace(case_problem, offset=True, drift=True).of(time_s, trace)
    fall = compute_fall(len(time_s), ignored.misfit_rad, find(more).misfit_rad)
    residual = plain.residuals.left(ignored.best)
    growth = compute_growth(residual, plain.residuals.rotation(ignored.best))
    doubts = list(doubts_about_noise(residual, growth, instrument=GRIPPER))
    assumed = replace(case_problem, coloured=True, offset=True, drift=True)
    if kind.gripper:
        known = {
            "stiffness_Nm_per_rad": kind.gripper * case_problem.gripper.left.stiffness_Nm_per_rad
        }
        assumed = replace(case_problem, uncertainty={"left": known, "right": known})
    fit = trace_fit(assumed, time_s, trace, find)
    allowed = _likelihood(fit.problem, fit.found)
    every = quantities(kind.case)
    return Seen(
        _held(ignored, every, truth),
        _held(allowed, every, truth),
        bool(doubts) or chdtrc(2, fall) < FALSE_ALARM,
    )


def _likelihood(problem: Problem, found: Identification) -> Likelihood:
    best = np.log(found.parameters)
    return make_likelihood(problem, best, found.misfit_rad, confidence=CONFIDENCE)


def _held(
    likelihood: Likelihood, every: Sequence[Quantity], truth: Array
) -> list[tuple[float, bool]]:
    (limits,) = find_limits([likelihood], every)[0]
    low, high = np.where(np.isnan(limits), (-np.inf, np.inf), limits).T
    logs = np.array([quantity.log(truth) for quantity in every])
    held = (low <= logs) & (logs <= high)
    return list(zip((high - low).tolist(), held.tolist(), strict=True))


def counted(kind: Kind, found: Sequence[Seen]) -> pd.DataFrame:
    """Count how often intervals hold the truth, a row a quantity."""
    rows = []
    for q, quantity in enumerate(quantities(kind.case)):
        ignored, allowed = (
            [getattr(each, name)[q] for each in found] for name in ("ignored", "allowed")
        )
        wider = np.median([w for w, _ in allowed]) / np.median([w for w, _ in ignored])
        rows.append(
            {
                "noise": kind.title,
                "case": kind.case,
                "quantity": quantity.label,
                "traces": len(found),
                "flagged_percent": 100 * np.mean([each.flagged for each in found]),
                "white_coverage_percent": 100 * np.mean([held for _, held in ignored]),
                "coverage_percent": 100 * np.mean([held for _, held in allowed]),
                "times_wider": wider,
            }
        )
    return pd.DataFrame(rows)


def main(traces: int, names: Sequence[str]) -> None:
    """Write the table, other kinds as they are there, and print it."""
    tables = dict(iter(pd.read_csv(TABLE).groupby("noise")))
    with ProcessPoolExecutor() as processes:
        for name in names:
            kind = KINDS[name]
            found = list(processes.map(seen, [kind] * traces, range(traces), chunksize=5))
            tables[kind.title] = counted(kind, found)
            print(tables[kind.title].to_string(index=False), flush=True)
            write(pd.concat([tables[k.title] for k in KINDS.values() if k.title in tables]), TABLE)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 500, sys.argv[2:] or list(KINDS))
