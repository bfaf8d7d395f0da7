"""How often verdicts are right: on traces of right set-ups, and of wrong ones.

A cell of the table is an instrument, a number of readings, their times, and what is read. The
relaxation time of each trace's sample is drawn between 1 and 20 % of the trace. Every trace is
fitted from random starts and judged as a user's is, but for what needs other models' fits.

    python -m benchmarks.levels                      every cell that is not there, and the page
    python -m benchmarks.levels creep 10 --traces 5  one cell

Cells are kept in `results/levels`; remove those that are to be measured again.
"""

import argparse
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from itertools import product
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from benchmarks.one_thread import keep_to_one_thread
from biogrip.arrays import Array
from biogrip.files import write_text
from biogrip.fit.experiment import Experiment
from biogrip.fit.genome import GeneRange
from biogrip.fit.least_squares import LeastSquaresSettings, identify_many
from biogrip.fit.problem import Fit, TraceProblem, silent
from biogrip.judging.diagnosis import Diagnosis, diagnose_all
from biogrip.judging.doubts import DOUBTFUL, OK, REJECTED, compute_status, examine_residuals
from biogrip.judging.likelihood import make_likelihood
from biogrip.physics.gripper import NO_ARMS, Arm, Gripper
from biogrip.physics.instruments import GRIPPER, INSTRUMENTS
from biogrip.physics.models import Sample
from biogrip.physics.noise import stream
from biogrip.physics.protocol import Phase, hold, ramp
from biogrip.physics.simulation import simulated_response
from biogrip.records.identifications import share_in_words

INSTRUMENTS_JUDGED = ("creep", "relaxation", "gripper")
READINGS = (10, 20, 40, 80, 400, 4000)
"""Numbers of readings of a trace."""

_SEED, _LASTS_S, _CONFIDENCE = 2019, 100.0, 0.95
_DECADES = (0, 3, 6)
# Standard deviation of the noise, an outlier's distance, and a step of rounding in units of it.
_NOISE, _OUTLIER, _STEP = 0.02, 15.0, 2.0
_LATE_S, _RAMP_S, _MINUTE_S = 5.0, 10.0, 60.0
_BUDGET = LeastSquaresSettings(candidates=1000, starts=16)
# Traces that are fitted together; and those whose misfit is computed without noise.
_TOGETHER, _SOME = 50, 10
_RANGES = dict.fromkeys(("k", "k_p", "c", "c_p"), GeneRange((-6, 8), (1, 9)))
# Without inertia, as fits are: its ringing would be read where times begin within milliseconds.
_ARM = Arm(inertia_kgm2=0.0, damping_Nms_per_rad=3.3e-12, stiffness_Nm_per_rad=4.4e-7)
_GRIPPER = Gripper(arm_length_m=1.5e-3, reference_angle_deg=75.0, left=_ARM, right=_ARM)
_TORQUES = (1.6e-9, 0.32e-9)
_TOLD, _UNTOLD, _ROUNDED = "noise that grows, told", "noise that grows", "white noise, rounded"
RIGHT = ("white noise", _TOLD, _UNTOLD, _ROUNDED)
"""What is read with the right set-up."""
WRONG = (
    "another model",
    "late start",
    "one outlier",
    "wrong protocol",
    "missing ramp",
    "wrong unit of time",
)
"""What is wrong, with white noise."""

_MODELS = {"creep": "kelvin_voigt", "relaxation": "zener_maxwell", "gripper": "liquid_drop"}

_PAGE = """# How often a verdict is right

Simulated traces of creep, relaxation and the gripper, at times that are even or spread over three
or six decades, with noise of 2 % of the peak: {traces} of each row, with the 95 % interval of a
share (Wilson's). `levels.csv` has every instrument and spacing.
`python -m benchmarks.levels` makes this page.

**The set-up is right.** All should be ok, none rejected, and 95 % of limits should hold the truth.
Noise that grows with what is read is to be told: if it is not, traces are doubtful once there are
readings enough to see it, and limits hold too rarely where it grows over decades.

{right}

**The set-up is wrong.** None should be ok. What fails are few readings: the noise is not known but
from them, and ten tell hardly any misfit, be it several times the noise, from a few noisy readings
of another sample; twenty tell most. With more, what is called ok is another model that fits as well
as noise allows. The last column has the misfit of the best fit to a trace without noise. An outlier
is 15 standard deviations off; a start is late by 5 % of the trace, a ramp that is taken for a step
lasts 10 % of it; another model has a second relaxation time, ten times as long; the load changes at
60 % of the trace in a wrong protocol, and minutes are taken for seconds in a wrong unit: after a
step that only changes the times found.

{wrong}
"""


def _experiment(instrument: str, protocol: tuple[Phase, ...], model: str) -> Experiment:
    """Return the experiment of an instrument with a protocol and a model."""
    of = {"creep": INSTRUMENTS["strain"], "relaxation": INSTRUMENTS["modulus"]}
    its = of.get(instrument, GRIPPER)
    arms = _GRIPPER if its is GRIPPER else NO_ARMS
    sample = Sample(model, stiffness=its.stiffness)
    return Experiment(arms, protocol, _RANGES, sample, {}, its)


def _protocol(instrument: str, late_s: float = 0.0, ramp_s: float = 0.0) -> tuple[Phase, ...]:
    """Return a step of what is controlled, of a gripper one to and fro, later or as a ramp."""
    levels = _TORQUES if instrument == "gripper" else (1.0,)
    waits = [hold(late_s, 0.0)] if late_s else []
    ramps = [ramp(ramp_s, 0.0, levels[0])] if ramp_s else []
    rests = [_LASTS_S / len(levels)] * len(levels)
    rests[0] -= ramp_s
    return (*waits, *ramps, *(hold(s, level) for s, level in zip(rests, levels, strict=True)))


def _parameters(instrument: str, tau_s: float) -> dict[str, float]:
    """Return parameters of the sample, for a relaxation time of its branch."""
    if instrument == "gripper":
        return {"k": 20.0, "k_p": 5.0, "c": 20.0 * tau_s, "c_p": 20.0 * tau_s}
    return {"k": 1.0, "k_p": 0.5, "c": tau_s, "c_p": 0.5 * tau_s}


def _times(readings: int, decades: int) -> Array:
    """Return evenly spaced times, or logarithmically over some decades, to the end of the trace."""
    if not decades:
        return np.linspace(_LASTS_S / readings, _LASTS_S, readings)
    return np.geomspace(_LASTS_S * 10.0**-decades, _LASTS_S, readings)


def _one(instrument: str, protocol: tuple[Phase, ...], tau_s: float, time_s: Array) -> Array:
    """Simulate what is read of a sample with one relaxation time."""
    experiment = _experiment(instrument, protocol, _MODELS[instrument])
    network = experiment.model.sample(_parameters(instrument, tau_s))
    return simulated_response(
        experiment.gripper, network, experiment.torque, time_s, nonlinear=False
    )[0]


def _read(instrument: str, set_up: str, tau_s: float, time_s: Array) -> Array:
    """Simulate a trace without noise, whose set-up may be another than the fit's."""
    one, protocol = partial(_one, instrument), _protocol(instrument)
    if set_up == "another model":
        return 0.5 * (one(protocol, tau_s, time_s) + one(protocol, 10 * tau_s, time_s))
    if set_up == "late start":
        return one(_protocol(instrument, late_s=_LATE_S), tau_s, time_s)
    if set_up == "missing ramp":
        return one(_protocol(instrument, ramp_s=_RAMP_S), tau_s, time_s)
    if set_up == "wrong protocol":
        first, last = _TORQUES if instrument == "gripper" else (1.0, 0.0)
        return one((hold(0.6 * _LASTS_S, first), hold(0.4 * _LASTS_S, last)), tau_s, time_s)
    return one(protocol, tau_s, time_s)


def _noisy(clean: Array, set_up: str, rng: np.random.Generator) -> Array:
    """Add noise to a trace, or whatever else is read."""
    sd = _NOISE * float(np.max(np.abs(clean)))
    if set_up in (_TOLD, _UNTOLD):
        return clean * (1 + _NOISE * rng.standard_normal(len(clean)))
    found: Array = clean + sd * rng.standard_normal(len(clean))
    if set_up == _ROUNDED:
        found = np.round(found / (_STEP * sd)) * (_STEP * sd)
    if set_up == "one outlier":
        found[rng.integers(len(clean))] += _OUTLIER * sd
    return found


def judge_cells(instrument: str, readings: int, traces: int, output: Path) -> None:
    """Write the rows of an instrument with a number of readings, each of so many traces."""
    rows = [
        _cell(instrument, readings, decades, set_up, traces)
        for decades in _DECADES
        for set_up in (*RIGHT, *WRONG)
    ]
    pd.DataFrame(rows).to_csv(output, index=False, float_format="%.4g")


def summarise(files: Sequence[Path], table: Path, summary: Path) -> None:
    """Write the rows of all files, and a page with shares over instruments and times."""
    rows = pd.concat([pd.read_csv(file) for file in files], ignore_index=True)
    rows.to_csv(table, index=False)
    rows["set_up"] = pd.Categorical(rows["set_up"], [*RIGHT, *WRONG])
    shown = []
    for (set_up, readings), cells in rows.groupby(["set_up", "readings"], observed=True):
        traces = int(cells["traces"].sum())
        counts = {
            status: round((cells[f"{status}_percent"] * cells["traces"]).sum() / 100)
            for status in (OK, DOUBTFUL, REJECTED)
        }
        held = (cells["held_percent"] * cells["limits"]).sum() / max(cells["limits"].sum(), 1)
        shown.append(
            {"set-up": set_up, "readings": readings}
            | {status: share_in_words(count, traces) for status, count in counts.items()}
            | ({"limits that hold": f"{held:.1f} %"} if set_up in RIGHT else {})
            | (
                {"misfit / noise": f"{cells['misfit_over_noise'].median():.1f}"}
                if set_up in WRONG
                else {}
            )
        )
    right, wrong = (
        pd.DataFrame([row for row in shown if row["set-up"] in own]).to_markdown(index=False)
        for own in (RIGHT, WRONG)
    )
    write_text(summary, _PAGE.format(traces=traces, right=right, wrong=wrong))


def _cell(instrument: str, readings: int, decades: int, set_up: str, traces: int) -> dict[str, Any]:
    experiment = _experiment(instrument, _protocol(instrument), _MODELS[instrument])
    time_s = _times(readings, decades)
    # A clock in minutes that is taken for one in seconds.
    told_s = time_s / _MINUTE_S if set_up == "wrong unit of time" else time_s
    status: Counter[str] = Counter()
    held: list[bool] = []
    misfits: list[float] = []
    name = f"{instrument} {readings} {decades} {set_up}"
    for first in range(0, traces, _TOGETHER):
        seeds = range(first, min(first + _TOGETHER, traces))
        rngs = [stream(_SEED, name, seed, "noise") for seed in seeds]
        taus = [_LASTS_S * 10 ** rng.uniform(-2, -0.7) for rng in rngs]
        cleans = [_read(instrument, set_up, tau, time_s) for tau in taus]
        given = [
            experiment.weighted(_NOISE * np.abs(clean)) if set_up == _TOLD else experiment
            for clean in cleans
        ]
        read = [_noisy(clean, set_up, rng) for clean, rng in zip(cleans, rngs, strict=True)]
        problems = [it.of(told_s, each) for it, each in zip(given, read, strict=True)]
        found = identify_many(problems, _BUDGET, rngs, silent)
        if set_up in RIGHT:
            judged = diagnose_all(
                problems,
                experiment.searched,
                found,
                confidence=_CONFIDENCE,
                noise_sd=[it.noise_sd for it in given],
            )
            status.update(each.status for each in judged)
            for each, tau in zip(judged, taus, strict=True):
                held += _held(each, experiment, _parameters(instrument, tau))
        else:
            status.update(map(_status_of, problems, found))
            some = cleans[: _SOME if not first else 0]
            exact = [experiment.of(told_s, clean) for clean in some]
            fits = identify_many(exact, _BUDGET, rngs[: len(exact)], silent) if exact else []
            sds = [_NOISE * float(np.max(np.abs(clean))) for clean in some]
            misfits += [fit.misfit / sd for fit, sd in zip(fits, sds, strict=True)]
    row: dict[str, Any] = {
        "instrument": instrument,
        "readings": readings,
        "times": f"log, {decades} decades" if decades else "even",
        "set_up": set_up,
        "traces": traces,
    }
    row |= {f"{each}_percent": 100 * status[each] / traces for each in (OK, DOUBTFUL, REJECTED)}
    if held:
        row |= {"limits": len(held), "held_percent": 100 * float(np.mean(held))}
    if misfits:
        typical = float(np.median(misfits))
        row |= {"misfit_over_noise": typical, "chi_squared": readings * typical**2}
    return row


def _held(judged: Diagnosis, experiment: Experiment, truth: dict[str, float]) -> Iterator[bool]:
    """Yield of the limits of every quantity that is determined whether they hold the truth."""
    names = experiment.searched.names
    for finding in judged.findings:
        if finding.low is not None and finding.high is not None:
            value = sum(truth[names[member]] for member in finding.quantity.members)
            yield finding.low <= value <= finding.high


def _status_of(problem: TraceProblem, found: Fit) -> str:
    """Return the status of a fit by what it leaves, without limits."""
    best = np.log(found.parameters)
    likelihood = make_likelihood(problem, best, found.misfit, confidence=_CONFIDENCE)
    return compute_status(examine_residuals(likelihood).notes)


def main() -> None:
    """Judge the cells that are asked for, and count verdicts if there are all of them."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("instrument", nargs="?", choices=INSTRUMENTS_JUDGED, help="default: all")
    parser.add_argument("readings", nargs="?", type=int, choices=READINGS, help="default: all")
    parser.add_argument("--traces", type=int, default=20, help="traces of each row (20)")
    parser.add_argument("--jobs", type=int, default=2, help="processes (2)")
    parser.add_argument("--folder", type=Path, default=Path("results/levels"), help="of cells")
    parser.add_argument("--docs", type=Path, default=Path("docs"), help="of the page")
    asked = parser.parse_args()
    asked.folder.mkdir(parents=True, exist_ok=True)
    cells = {
        asked.folder / f"{instrument}_{readings}.csv": (instrument, readings)
        for instrument, readings in product(INSTRUMENTS_JUDGED, READINGS)
    }
    with ProcessPoolExecutor(asked.jobs, get_context("spawn")) as workers:
        running = [
            workers.submit(judge_cells, instrument, readings, asked.traces, file)
            for file, (instrument, readings) in cells.items()
            if asked.instrument in (None, instrument) and asked.readings in (None, readings)
            if not file.is_file()
        ]
        for job in running:
            job.result()
    if all(file.is_file() for file in cells):
        summarise(list(cells), asked.docs / "levels.csv", asked.docs / "levels.md")


if __name__ == "__main__":
    keep_to_one_thread()
    main()
