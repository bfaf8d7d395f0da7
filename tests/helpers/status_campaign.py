"""Status of fits and coverage of limits, on simulated traces of right and of wrong set-ups.

``python -m tests.helpers.status_campaign [traces [set-up ...]]`` identifies 500 traces of each
set-up as ``biogrip identify`` does, and writes the table that the documentation shows. All of it
takes some two hours of a processor. The test suite has a few traces.
"""

import sys
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pandas as pd

from biogrip.arrays import Array
from biogrip.experiment.noise import Noise, add_noise
from biogrip.experiment.noise_parts import AR1, Drift, Flicker, Outliers
from biogrip.experiment.protocol import hold, torque_history
from biogrip.experiment.sample import CANDIDATES
from biogrip.identifiability.fit_status import DOUBTFUL, OK, REJECTED
from biogrip.instrument.gripper import Gripper
from biogrip.own_traces.many_traces import identify_batch
from biogrip.own_traces.one_trace import IdentifyOptions
from biogrip.own_traces.read_as import ReadAs
from biogrip.response.simulation import simulated_rotation
from tests.helpers.default import STUDY
from tests.helpers.groups_campaign import write
from tests.helpers.places import ROOT

TABLE = ROOT / "results" / "published" / "status" / "tables" / "status.csv"

CONFIG = "least_squares: {candidates: 100, starts: 4}\nmodel_selection: {models: []}\n"
"""Options of every fit; other models are not compared, which takes most of the time."""

TIMES = np.arange(0.0, 400.0, 0.5)
LENGTH_S, STEP_S = 400.0, 200.0
TRUTH: Mapping[str, float] = {"k": 20.0, "k_p": 5.0, "c": 300.0, "c_p": 0.0}
QUANTITIES = ("k", "k_p", "c")
GRIPPER = STUDY.cases["endothelial_cell"].problem.gripper
LEVEL = 0.02
"""Standard deviation of the noise over the largest rotation."""

REFUSED = "refused"

_BATCH = 25


@dataclass(frozen=True)
class SetUp:
    """What a trace is made with, while the answer assumes white noise and the set-up that is told.

    Parameters
    ----------
    title
        In print.
    noise
        Noise that is added.
    right
        False if protocol, gripper, unit or model are not what is assumed.
    step_s, late_s
        Time of the second torque, and of the first one.
    stiffness
        Factor on the stiffness, damping and inertia of the arms.
    unit
        Factor on the rotations that the file holds.
    jump
        Size of a jump at 260 s, in standard deviations of the noise.
    resolution
        Step of the readings, likewise.
    branch
        Stiffness in N/m and damping in N s/m of a second branch of the sample.
    """

    title: str
    noise: Noise
    right: bool = False
    step_s: float = STEP_S
    late_s: float = 0.0
    stiffness: float = 1.0
    unit: float = 1.0
    jump: float = 0.0
    resolution: float = 0.0
    branch: tuple[float, float] | None = None


_noise = partial(Noise, "gaussian", LEVEL, "peak", None)
_white, _signal = _noise(), Noise("gaussian", LEVEL, "signal")

SET_UPS = {
    "white": SetUp("white noise", _white, right=True),
    "signal": SetUp("noise proportional to the rotation", _signal, right=True),
    "quantised": SetUp(
        "white noise, read in steps of four standard deviations",
        replace(_white, level=LEVEL / 2),
        right=True,
        resolution=2.0,
    ),
    "ar1": SetUp("AR(1) noise, a tenth, 10 s", _noise(AR1(0.1, 10.0)), right=True),
    "flicker": SetUp("1/f noise, three tenths", _noise(flicker=Flicker(0.3)), right=True),
    "drift": SetUp("drift of 0.4 standard deviations", _noise(drift=Drift(0.4)), right=True),
    "outliers": SetUp(
        "one in a hundred ten times as large", _noise(outliers=Outliers(0.01, 10.0)), right=True
    ),
    "mixed": SetUp(
        "half of the last four",
        _noise(AR1(0.05, 10.0), Flicker(0.15), Drift(0.2), Outliers(0.005, 10.0)),
        right=True,
    ),
    "step": SetUp("step 10 % late", _white, step_s=1.1 * STEP_S),
    "torque": SetUp("torque late by 5 % of the trace", _white, late_s=0.05 * LENGTH_S),
    "jump": SetUp("jump of five standard deviations", _white, jump=5.0),
    "unit": SetUp("mrad taken for rad", _white, unit=1e3),
    "gripper": SetUp("gripper three times as stiff", _white, stiffness=3.0),
    "model": SetUp("sample with a second, slow branch", _white, branch=(20.0, 2000.0)),
}


@dataclass(frozen=True)
class Answered:
    """Answer to one trace.

    Parameters
    ----------
    status
        Of the fit, or that the trace was refused.
    limits : dict of str to (low, high)
        By quantity, logarithms of the limits, infinite where there is none; empty if rejected.
    """

    status: str
    limits: Mapping[str, tuple[float, float]]


def trace_of(set_up: SetUp, seed: int) -> Array:
    """Simulate the rotations that the file of a trace holds."""
    gripper = _stiffened(set_up.stiffness)
    clean = _response(gripper, set_up)
    sigma = LEVEL * float(np.max(np.abs(clean)))
    trace = add_noise(clean, set_up.noise, np.random.default_rng([seed, 28]), TIMES)
    trace += set_up.jump * sigma * (TIMES > 260.0)
    if set_up.resolution:
        step = set_up.resolution * sigma
        trace = step * np.rint(trace / step)
    return trace * set_up.unit


def _stiffened(factor: float) -> Gripper:
    left, right = (
        replace(arm, **{name: factor * value for name, value in vars(arm).items()})
        for arm in (GRIPPER.left, GRIPPER.right)
    )
    return replace(GRIPPER, left=left, right=right)


def _response(gripper: Gripper, set_up: SetUp) -> Array:
    phases = [hold(set_up.step_s, 1.6e-9), hold(LENGTH_S - set_up.step_s, 0.32e-9)]
    late = int(np.searchsorted(TIMES, set_up.late_s))
    model = CANDIDATES["generalized_maxwell_2" if set_up.branch else "generalized_maxwell"].model
    parameters = list(TRUTH.values())
    if set_up.branch:
        k, k_p, c, c_p = parameters
        first, second = (k, c), set_up.branch
        by_name = {"k_1": first[0], "c_1": first[1], "k_2": second[0], "c_2": second[1]}
        by_name |= {"k_p": k_p, "c_p": c_p}
        parameters = [by_name[name] for name in model.names]
    network = model.network(np.array([parameters]))
    clean = simulated_rotation(
        gripper, network, torque_history(tuple(phases)), TIMES, nonlinear=False
    )[0]
    return np.concatenate((np.zeros(late), clean[: len(clean) - late]))


def answers(set_up: SetUp, noise_model: str, seeds: Sequence[int]) -> list[Answered]:
    """Simulate traces, and identify them from their files side by side, as the command does."""
    with TemporaryDirectory() as name:
        folder = Path(name)
        config = folder / "c.yaml"
        config.write_text(CONFIG)
        options = []
        for seed in seeds:
            trace = folder / f"{seed}.csv"
            rows = np.c_[TIMES, trace_of(set_up, seed)]
            np.savetxt(trace, rows, "%.9g", ",", header="time_s,rotation_rad", comments="")
            read_as = ReadAs(noise_model=noise_model)
            options.append(IdentifyOptions(trace, "generalized_maxwell", read_as, config))
        outcome = identify_batch(options, None, page=False)
    found = {data["trace"]: _answered(data) for data in outcome.found}
    return [found.get(str(own.trace), Answered(REFUSED, {})) for own in options]


def _answered(data: dict[str, Any]) -> Answered:
    if data["fit"] == REJECTED:
        return Answered(REJECTED, {})
    items = {item["quantity"]: item for item in data["quantities"]}
    limits = {name: _logarithms(items[name]["low"], items[name]["high"]) for name in QUANTITIES}
    return Answered(data["fit"], limits)


def _logarithms(low: float | None, high: float | None) -> tuple[float, float]:
    return (
        -np.inf if low is None else float(np.log(low)),
        np.inf if high is None else float(np.log(high)),
    )


def counted(set_up: SetUp, found: Mapping[str, Sequence[Answered]]) -> pd.DataFrame:
    """Count statuses and limits that hold the truth; a row for each noise model and quantity."""
    rows = []
    for noise_model, answers in found.items():
        shown = [each for each in answers if each.limits]
        shares = {
            f"{status}_percent": 100 * float(np.mean([each.status == status for each in answers]))
            for status in (OK, DOUBTFUL, REJECTED, REFUSED)
        }
        for name in QUANTITIES:
            truth = np.log(TRUTH[name])
            limits = [each.limits[name] for each in shown]
            held = [low <= truth <= high for low, high in limits]
            width = [high - low for low, high in limits]
            rows.append(
                {
                    "set_up": set_up.title,
                    "right": set_up.right,
                    "noise_model": noise_model,
                    "quantity": name,
                    "traces": len(answers),
                    **shares,
                    "coverage_percent": 100 * float(np.mean(held)) if held else np.nan,
                    "width": float(np.median(width)) if width else np.nan,
                }
            )
    return pd.DataFrame(rows)


def main(traces: int, names: Sequence[str]) -> None:
    """Write the table, other set-ups as they are there, and print it."""
    tables = dict(iter(pd.read_csv(TABLE).groupby("set_up"))) if TABLE.exists() else {}
    with ProcessPoolExecutor() as processes:
        for name in names:
            set_up = SET_UPS[name]
            batches = [range(n, min(n + _BATCH, traces)) for n in range(0, traces, _BATCH)]
            found = {
                noise_model: list(
                    chain(*processes.map(partial(answers, set_up, noise_model), batches))
                )
                for noise_model in ("white", "coloured")
            }
            tables[set_up.title] = counted(set_up, found)
            print(tables[set_up.title].to_string(index=False), flush=True)
            titles = [each.title for each in SET_UPS.values()]
            write(pd.concat([tables[title] for title in titles if title in tables]), TABLE)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 500, sys.argv[2:] or list(SET_UPS))
