"""The command ``biogrip design``: a train of steps that tells plausible samples better.

A train controls a torque, a load or a deformation in steps; after each step it is read at one rate.
SciPy's differential evolution searches levels, durations and rates for the lowest worst Cramér-Rao
bound. While it searches, sums over readings are integrals; what is printed is computed from the
readings themselves.
"""

from collections.abc import Iterator, Sequence
from copy import deepcopy
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import groupby
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from biogrip import __version__
from biogrip.arrays import Array, BoolArray
from biogrip.errors import BiogripError
from biogrip.files import refuse_inputs, write_text
from biogrip.identify.outputs import WRITTEN_BY, check_output
from biogrip.physics.modes import Modes, compute_modes, linear_responses
from biogrip.physics.noise import standard_deviation
from biogrip.physics.protocol import Burst, Phase, Sampling, hold, largest_load, torque_history
from biogrip.physics.simulation import compute_grip, jaw_force_response, simulated_rotation
from biogrip.study.config import DesignBlock
from biogrip.study.load import load_study, read_configs
from biogrip.study.source import default_config, overlaid, read_config
from biogrip.study.study import Case
from biogrip.terminal import aligned, visible_lines

GENERATIONS = 500
"""Generations of the search; each has five trains for every unknown of a train."""

NO_BOUND = 10.0
"""Relative bound from which on a parameter counts as unknown."""

# Seed of the search, trains of a generation per unknown, trains tried to see what is within reach,
# samples drawn around a case's own, and decades of the steps' shares of readings.
_SEED, _POPSIZE, _TRIED, _DRAWN, _DECADES = 1, 5, 512, 8, 4.0
# Least readings in a step, share of their force that the jaws keep at least when a torque steps
# down, and share of the noise at which the ringing of arms no longer counts.
_FEWEST, _KEPT, _UNSEEN = 5, 0.01, 0.01
_FINE = 10_000  # levels in the largest
# Nodes in a step, as shares of its duration, dense after its start: of integrals over readings,
# with their weights, and of forces.
_ROOTS, _WEIGHTS = np.polynomial.legendre.leggauss(12)
_NODES, _SHARES = ((_ROOTS + 1) / 2) ** 3, 1.5 * ((_ROOTS + 1) / 2) ** 2 * _WEIGHTS
_INSTANTS = np.linspace(0.0, 1.0, 16) ** 3
_TIMES = ("rate_Hz", "bursts")


@dataclass(frozen=True, eq=False)
class Plausible:
    """The plausible samples of a case: its own, and those around it."""

    case: Case
    parameters: Array
    """The case's own first, (n, n_parameters)."""
    noise: float
    """Standard deviation of the noise, in the SI unit of what is read."""
    required: BoolArray
    """True for the parameters asked for, (n_parameters,)."""

    @cached_property
    def modes(self) -> Modes:
        """Modes of the responses, with derivatives by the log-parameters."""
        unit = torque_history((hold(1.0, 1.0),), deforms=self.case.instrument.deforms)
        problem = self.case.problem
        return compute_modes(problem.gripper, problem.searched, unit, self.parameters)

    @cached_property
    def forces(self) -> list[tuple[float, Array, Array]]:
        """Forces of the jaws after a unit step: constant, rates and weights, for each sample."""
        if not self.case.instrument.has_jaws:
            return []
        network = self.case.searched.network(self.parameters)
        found = jaw_force_response(self.case.gripper, network, inertia=False)
        return list(zip(found.static[:, 0, 0], found.rates, found.weights[:, 0, 0], strict=True))

    def quiet_s(self, largest: float) -> float:
        """Return the time in which the ringing of free arms falls far below the noise."""
        found = [0.0]
        for arm in (self.case.gripper.left, self.case.gripper.right):
            if arm.inertia_kgm2:
                excess = largest / arm.stiffness_Nm_per_rad / (_UNSEEN * self.noise)
                rate = arm.damping_Nms_per_rad / (2 * arm.inertia_kgm2)
                found.append(float(np.log(max(excess, 1.0))) / rate)
        return max(found)


@dataclass(frozen=True)
class Limits:
    """Limits of a train."""

    steps: int
    """Number of steps."""
    largest: float
    """Level of the largest magnitude, in the SI unit of what is controlled."""
    frames: int
    """Duration, in intervals of the camera at its highest rate."""
    rate_Hz: float
    """Highest rate of the readings."""
    readings: int
    """Most readings in all."""
    quiet_s: float
    """Time after each step that is left to ringing arms, without readings."""

    @property
    def shares_readings(self) -> bool:
        """True if there are too few readings for the highest rate throughout."""
        return self.frames > self.readings


@dataclass(frozen=True, eq=False)
class Trains:
    """Trains of steps, (n_trains, n_steps) each."""

    levels: Array
    """What is controlled, in its SI unit."""
    durations_s: Array
    """Durations of the steps."""
    readings: Array
    """Number of readings in each, whole numbers."""
    quiet_s: float
    """Time after each step without readings."""

    @property
    def phases(self) -> tuple[Phase, ...]:
        """Phases of the first train; steps of the same level are one."""
        pairs = zip(self.levels[0], self.durations_s[0], strict=True)
        return tuple(
            hold(_rounded(sum(lasts for _, lasts in same)), _rounded(level))
            for level, same in groupby(pairs, key=itemgetter(0))
        )

    @property
    def bursts(self) -> tuple[Burst, ...]:
        """Readings of the first train, at one rate in each step."""
        starts_s = np.cumsum(self.durations_s[0]) - self.durations_s[0] + self.quiet_s
        rates_Hz = self.readings[0] / np.maximum(self.durations_s[0] - self.quiet_s, 1e-99)
        return tuple(
            Burst(_rounded(start_s + 0.5 / rate_Hz), _rounded(rate_Hz), int(count))
            for start_s, rate_Hz, count in zip(starts_s, rates_Hz, self.readings[0], strict=True)
            if count
        )


@dataclass(frozen=True, eq=False)
class Experiment:
    """Protocol and readings, with what they tell of the plausible samples of a case."""

    phases: tuple[Phase, ...]
    sampling: Sampling
    times_s: Array
    bounds: Array
    """Relative bounds, (n, n_parameters); `NO_BOUND` for parameters without one."""
    force_N: float | None
    """Least force of the jaws, if there are jaws; negative if they have to pull."""


def design(config: Path, output: Path | None) -> None:
    """Search for a train of steps, print what it tells, and write a config that runs it.

    The config, a YAML file, is laid over the default study. By default the output is beside it,
    with `_designed` in its name; a file that biogrip did not write is not replaced.
    A `BiogripError` says what cannot be used, or that no train tells anything.
    """
    output = output or config.with_stem(f"{config.stem}_designed")
    refuse_inputs([output], [config])
    check_output(output)
    files = [default_config(), config]
    study = load_study(read_configs(files), files)
    samples = list(make_plausible(list(study.cases.values()), study.config.design))
    limits = make_limits(samples, study.config.design)
    train, reached = search(samples, limits)
    before = [rated(one, one.case.phases, one.case.sampling) for one in samples]
    sampling = Sampling(limits.rate_Hz)
    if limits.shares_readings or limits.quiet_s:
        sampling = Sampling(bursts=train.bursts)
    after = [rated(one, train.phases, sampling) for one in samples]
    write_text(output, as_config(read_config(config), samples, after))
    then = f"snakemake -j2 --configfile {output} simulates and fits it"
    said = [*_said(samples, before, after, reached), f"Written to {output}; {then}."]
    print(visible_lines("\n".join(said)))


def make_plausible(cases: Sequence[Case], block: DesignBlock) -> Iterator[Plausible]:
    """Yield the plausible samples of cases: their own, and some spread evenly around them.

    A `BiogripError` says which case cannot be judged, and why.
    """
    for case in cases:
        if wrong := _problem(case, cases[0]):
            raise BiogripError(f"design: {case.name}: {wrong}")
        names = case.searched.names
        own = np.log([case.parameters[name] for name in names])
        logs = own[None]
        if block.factor is not None:
            # Imported lazily: it is slow to import.
            from scipy.stats import qmc

            drawn = qmc.Halton(len(names), scramble=False).random(_DRAWN + 1)[1:]
            logs = np.concatenate((logs, own + np.log(block.factor) * (2 * drawn - 1)))
        required = np.array([name in (block.parameters or names) for name in names])
        # The noise of an instrument: that of its own sample under its own protocol.
        problem, network = case.problem, case.sample.model.sample(case.parameters)
        times_s = case.sampling.over(problem.torque.end_s)
        read = simulated_rotation(case.gripper, network, problem.torque, times_s, nonlinear=False)
        noise = float(standard_deviation(read[0], case.noise)[0])
        yield Plausible(case, np.exp(logs), noise, required)


def _problem(case: Case, first: Case) -> str | None:
    """Return what of a case cannot be judged, and what is allowed."""
    measured, controlled = case.block.measurement, case.instrument.controlled
    if case.recorded:
        return "found a recorded trace, allowed is a sample with values."
    for name in case.searched.names:
        if not case.parameters[name]:
            return f"found {name} = 0, allowed is a value above 0, or the 0 under `fixed`, too."
    if controlled != first.instrument.controlled:
        text = f"found a protocol of {controlled.name}, allowed is one of "
        return f"{text}{first.instrument.controlled.name} as in {first.name}."
    of_signal = case.noise.level_rad is None and case.noise.reference == "signal"
    if case.noise.absent or not case.noise.white or of_signal:
        return "measurement.noise: allowed is white noise, of a share of the peak or a level_rad."
    if measured.fits_offset or measured.fits_drift:
        return "measurement: found an offset or drift to be fitted along, allowed is neither."
    if case.nonlinear_target:
        return "models.target: found nonlinear, allowed is linear."
    return None


def make_limits(samples: Sequence[Plausible], block: DesignBlock) -> Limits:
    """Return the limits of a block; those that it does not set are those of all protocols.

    If there is no room for a step, it is a `BiogripError`.
    """
    cases = [one.case for one in samples]
    largest = min((largest_load(case.phases) for case in cases), key=abs)
    if block.largest is not None:
        largest = float(np.copysign(block.largest, largest))
    ends_s = [case.problem.torque.end_s for case in cases]
    rate_Hz = block.rate_Hz or min(case.block.measurement.rate_Hz for case in cases)
    frames = int((block.duration_s or min(ends_s)) * rate_Hz * (1 + 1e-12))
    if frames < _FEWEST:
        text = f"found room for {frames} readings at {rate_Hz:g} Hz, allowed are at least "
        raise BiogripError(f"design: {text}{_FEWEST}; a longer duration_s or a higher rate_Hz.")
    readings = min(len(c.sampling.over(end_s)) for c, end_s in zip(cases, ends_s, strict=True))
    quiet_s = max(one.quiet_s(largest) for one in samples)
    quiet_s = quiet_s if 2 * quiet_s * rate_Hz > 1 else 0.0
    steps = min(block.steps, frames // _FEWEST)
    return Limits(steps, largest, frames, rate_Hz, readings, quiet_s)


def search(
    samples: Sequence[Plausible], limits: Limits, generations: int = GENERATIONS
) -> tuple[Trains, list[BoolArray]]:
    """Search for the train with the lowest worst bound of all parameters within reach.

    Such are asked for, and have a bound in one of some hundred random trains: True in an array
    (n, n_parameters) for each case, returned beside the train. If there is none, it is a
    `BiogripError`.
    """
    # Imported lazily: it is slow to import.
    from scipy.optimize import differential_evolution

    unknowns = limits.steps * (3 if limits.shares_readings else 2)
    rng = np.random.default_rng(_SEED)
    drawn = rng.random((_TRIED, unknowns))
    if limits.shares_readings:
        # What is fast shows where short steps have as many readings as long ones.
        drawn[::2, 2 * limits.steps :] = 0.0
    tried = decode(drawn, samples, limits)
    reached = [
        np.any(relative_bounds(information(one, tried)) < NO_BOUND, axis=1) & one.required
        for one in samples
    ]
    if not any(map(np.any, reached)):
        text = "no train of steps tells any parameter asked for; allowed are less noise, a higher "
        raise BiogripError(f"design: {text}`largest`, a longer duration_s or a higher rate_Hz.")

    def worst(columns: Array) -> Array:
        trains = decode(columns.T, samples, limits)
        bounds = [relative_bounds(information(one, trains)).swapaxes(0, 1) for one in samples]
        pairs = zip(bounds, reached, strict=True)
        logs = np.log(np.concatenate([found[:, within] for found, within in pairs], axis=1))
        # The mean decides among equals, and last bits do not.
        return (logs.max(axis=1) + 0.01 * logs.mean(axis=1)).astype(np.float32).astype(float)

    found = differential_evolution(
        worst,
        [(0.0, 1.0)] * unknowns,
        popsize=_POPSIZE,
        maxiter=generations,
        tol=0.0,
        rng=rng,
        polish=False,
        updating="deferred",
        vectorized=True,
    )
    return decode(found.x[None], samples, limits), reached


def decode(unknowns: Array, samples: Sequence[Plausible], limits: Limits) -> Trains:
    """Return trains within their limits from numbers between 0 and 1, (n_trains, n_unknowns).

    These are, for each step, its level as a share of what is allowed, the logarithm of its duration
    and, if there are too few for the highest rate, that of its share of the readings.
    """
    heights, lengths, *counts = np.split(unknowns, unknowns.shape[1] // limits.steps, axis=1)
    shares = (_FEWEST / limits.frames) ** lengths
    shares /= shares.sum(axis=1, keepdims=True)
    frames = _FEWEST + np.floor(shares * (limits.frames - _FEWEST * limits.steps))
    frames[np.arange(len(frames)), frames.argmax(axis=1)] += limits.frames - frames.sum(axis=1)
    # Steps fall half way between two readings.
    ends_s = (np.cumsum(frames, axis=1) + 0.5) / limits.rate_Hz
    ends_s[:, -1] = limits.frames / limits.rate_Hz
    durations_s = np.diff(ends_s, axis=1, prepend=0.0)
    left_s = np.maximum(durations_s - limits.quiet_s, 0.0)
    readings = np.floor(left_s * limits.rate_Hz)
    if counts:
        readings = _filled(10 ** (-_DECADES * counts[0]), readings, limits.readings)
    forces = [each for one in samples for each in one.forces]
    levels = np.ceil(_FINE * heights) / _FINE
    if forces:
        levels = _pressing(forces, heights, durations_s)
    return Trains(limits.largest * levels, durations_s, readings, limits.quiet_s)


def _filled(shares: Array, room: Array, readings: int) -> Array:
    """Return whole readings in proportion to shares, as far as there is room, (n_trains, n_steps).

    Readings without room in a step are shared out among the others.
    """
    found = np.zeros_like(room)
    for _ in range(room.shape[1]):
        free = np.where(found < room, shares, 0.0)
        left = readings - found.sum(axis=1, keepdims=True)
        more = left * free / np.maximum(free.sum(axis=1, keepdims=True), 1e-99)
        found = np.minimum(found + more, room)
    return np.floor(found)


def _pressing(
    forces: Sequence[tuple[float, Array, Array]], heights: Array, durations_s: Array
) -> Array:
    """Return torques, as shares of the largest, under which the jaws press all samples throughout.

    After a step they keep a share of the force that they would have without it. Forces are those
    of all samples; arrays are of (n_trains, n_steps).
    """
    levels, now = np.zeros_like(heights), np.zeros(len(heights))
    moving = [np.zeros((len(heights), len(rates))) for _, rates, _ in forces]
    for step in range(heights.shape[1]):
        elapsed = (durations_s[:, step, None] * _INSTANTS)[..., None]
        lowest = np.full(len(heights), 0.0 if step else _KEPT)
        for (static, rates, weights), carried in zip(forces, moving, strict=True):
            decay = np.exp(rates * elapsed)
            force = static * now[:, None] + (decay * carried[:, None]).sum(axis=2)
            share = (force / (static + (decay * weights).sum(axis=2))).min(axis=1)
            lowest = np.maximum(lowest, now - (1 - _KEPT) * share)
        levels[:, step] = np.ceil(_FINE * (lowest + heights[:, step] * (1 - lowest))) / _FINE
        for (_, rates, weights), carried in zip(forces, moving, strict=True):
            carried += (levels[:, step] - now)[:, None] * weights
            carried *= np.exp(rates * durations_s[:, step, None])
        now = levels[:, step]
    return levels


def information(samples: Plausible, trains: Trains) -> Array:
    """Compute the Fisher information on log-parameters, (n, n_trains, n_parameters, n_parameters).

    Sums over readings are integrals over the time since the last step.
    """
    left_s = np.maximum(trains.durations_s - trains.quiet_s, 0.0)[..., None]
    first_s = left_s / np.maximum(trains.readings, 1.0)[..., None] / 2
    elapsed = trains.quiet_s + np.maximum(left_s * _NODES, first_s)
    counts = (trains.readings[..., None] * _SHARES).reshape(len(elapsed), -1, 1)
    found = []
    for modes in map(Modes._make, zip(*samples.modes, strict=True)):
        rows = _sensitivities(modes, trains, elapsed, deforms=samples.case.instrument.deforms)
        rows = rows.reshape(len(elapsed), -1, rows.shape[-1]) / samples.noise
        found.append(rows.swapaxes(1, 2) @ (rows * counts))
    return np.stack(found)


def _sensitivities(modes: Modes, trains: Trains, elapsed: Array, *, deforms: bool) -> Array:
    """Compute derivatives by the log-parameters of a sample at times since the last step.

    A mode of weight w and rate r responds to jumps D at times t_i with w [A exp(r e) - sum D] or,
    where a deformation is held, w A exp(r e), and its derivative by the rate is
    w (B + A e) exp(r e), at a time e after the last step at t, with A = sum D exp(r (t - t_i)),
    B = sum D (t - t_i) exp(r (t - t_i)) and, free of cancellation, C = A - sum D.
    Times are (n_trains, n_steps, n_times), derivatives (n_trains, n_steps, n_times, n_parameters).
    """
    rates = modes.rates
    a, b, c = np.zeros((3, *trains.levels.shape, len(rates)))
    jumps = np.diff(trains.levels, axis=1, prepend=0.0)
    for k in range(trains.levels.shape[1]):
        if k:
            passed = trains.durations_s[:, k - 1, None]
            decay, change = np.exp(rates * passed), np.expm1(rates * passed)
            c[:, k] = c[:, k - 1] * decay + trains.levels[:, k - 1, None] * change
            b[:, k] = (b[:, k - 1] + passed * a[:, k - 1]) * decay
            a[:, k] = a[:, k - 1] * decay
        a[:, k] += jumps[:, k, None]
    a, b, c = a[:, :, None], b[:, :, None], c[:, :, None]
    exponent = rates * elapsed[..., None]
    grown = a * np.expm1(exponent) + (a if deforms else c)
    moved = (b + a * elapsed[..., None]) * np.exp(exponent)
    found: Array = (
        grown @ modes.weight_slopes[:, 0].T + moved @ (modes.weights * modes.rate_slopes).T
    )
    return found


def relative_bounds(found: Array) -> Array:
    """Return standard deviations of log-parameters from information, (..., n_parameters).

    A parameter that is not told to a factor of e with all others known is taken as known for the
    others, as in `biogrip.judging.likelihood`, and has `NO_BOUND`.
    """
    own = np.diagonal(found, axis1=-2, axis2=-1)
    informed = own >= 1
    size = np.sqrt(np.where(informed, own, 1.0))
    both = informed[..., :, None] & informed[..., None, :]
    scaled = np.where(both, found / (size[..., :, None] * size[..., None, :]), 0.0)
    # Parameters that stand for one another leave a matrix that can hardly be inverted.
    scaled = np.where(np.eye(found.shape[-1], dtype=bool), 1 + 1e-12, scaled)
    variance = np.diagonal(np.linalg.inv(scaled), axis1=-2, axis2=-1)
    bounds = np.sqrt(np.where(variance > 0, variance, np.inf)) / size
    return np.where(informed, np.minimum(bounds, NO_BOUND), NO_BOUND)


def rated(samples: Plausible, phases: tuple[Phase, ...], sampling: Sampling) -> Experiment:
    """Compute what an experiment tells of the plausible samples of a case.

    If it turns the arms further than the comb drives can, it is a `BiogripError`.
    """
    case, problem = samples.case, replace(samples.case.problem, phases=phases)
    times_s, model = sampling.over(problem.torque.end_s), problem.searched
    given = problem.gripper, model, problem.torque, times_s, samples.parameters
    rows = linear_responses(*given) / samples.noise
    bounds = relative_bounds(rows[:, 1:] @ rows[:, 1:].swapaxes(1, 2))
    if not case.instrument.has_jaws:
        return Experiment(phases, sampling, times_s, bounds, None)
    turn = samples.noise * float(rows[:, 0].max())
    if turn > case.stroke_rad:
        text = f"found a torque that turns the arms by {1e3 * turn:.4g} mrad, allowed is what the "
        text += f"stroke leaves, {1e3 * case.stroke_rad:.4g} mrad: a lower `largest`."
        raise BiogripError(f"design: {case.name}: {text}")
    networks = (model.network(values[None]) for values in samples.parameters)
    force_N = min(
        compute_grip(case.gripper, each, problem.torque, nonlinear=False).lowest_N
        for each in networks
    )
    return Experiment(phases, sampling, times_s, bounds, force_N)


def as_config(
    given: dict[str, Any], samples: Sequence[Plausible], after: Sequence[Experiment]
) -> str:
    """Return a config, as YAML, with an experiment as that of its cases."""
    found = deepcopy(given)
    cases = found.setdefault("cases", {})
    for block in (found, *filter(None, cases.values())):
        for key in set(_TIMES) & set(block.get("measurement") or {}):
            del block["measurement"][key]
    for one, experiment in zip(samples, after, strict=True):
        column, sampling = one.case.instrument.controlled.column, experiment.sampling
        phases = [
            {"duration_s": phase.duration_s, column: phase.left.value_Nm}
            for phase in experiment.phases
        ]
        times: dict[str, Any] = {"rate_Hz": sampling.rate_Hz}
        if sampling.bursts:
            times = {"bursts": [vars(each) for each in sampling.bursts]}
        measured = {"noise": {"level_rad": one.noise}, **times}
        own = {"protocol": {"phases": phases}, "measurement": measured}
        cases[one.case.name] = overlaid(cases.get(one.case.name) or {}, own)
    text = yaml.safe_dump(found, sort_keys=False, default_flow_style=None, width=100)
    return f"# {WRITTEN_BY} {__version__}: a protocol by `biogrip design`.\n{text}"


def _said(
    samples: Sequence[Plausible],
    before: Sequence[Experiment],
    after: Sequence[Experiment],
    reached: Sequence[BoolArray],
) -> Iterator[str]:
    """Yield lines: a table, and what it takes for granted."""
    rows: list[tuple[str, ...]] = []
    notes = []
    for one, within, *both in zip(samples, reached, before, after, strict=True):
        name, instrument = one.case.name, one.case.instrument
        controlled, read, n = instrument.controlled, instrument.read, len(one.parameters)
        for index, parameter in enumerate(one.case.searched.names):
            bounds = [each.bounds[:, index] for each in both]
            rows.append((name, f"{parameter}: bound (%)", *(_percent(b[0]) for b in bounds)))
            if n > 1:
                worst = (_percent(b.max()) for b in bounds)
                rows.append((name, f"{parameter}: worst of {n} samples (%)", *worst))
            if one.required[index] and not np.all(within[:, index]):
                notes.append(f"No train that was tried tells {parameter} of {name}.")
        values = {
            f"noise of the {read.name} ({read.unit})": [one.noise, one.noise],
            f"largest {controlled.name} ({controlled.unit})": [
                largest_load(each.phases) for each in both
            ],
            "highest rate (Hz)": [1 / np.diff(each.times_s).min() for each in both],
            "readings": [len(each.times_s) for each in both],
        }
        if instrument.has_jaws:
            values["least force of the jaws (N)"] = [each.force_N for each in both]
        rows += [(name, what, *(f"{it:.4g}" for it in pair)) for what, pair in values.items()]
    yield aligned(rows, ("sample", "", "config's protocol", "designed"))
    yield from notes
    yield (
        "The noise is taken for white, and for the instrument's: the same under both protocols. "
        "Bounds are standard deviations of logarithms, all parameters unknown."
    )


def _percent(bound: float) -> str:
    return f"{100 * bound:.3g}" if bound < NO_BOUND else "none"


def _rounded(value: float) -> float:
    """Return a number without the last digits, in which rounding shows."""
    return float(f"{value:.12g}")
