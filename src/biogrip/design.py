"""The command ``biogrip design``: a train of steps that determines samples of a config better.

A train controls a torque, a load or a deformation in steps, and is read at one rate. What is read
is the sum of the responses to its steps, all of which are the response to a unit step, later and
larger or smaller. SciPy's differential evolution searches levels and durations for the lowest
worst Cramér-Rao bound.
"""

import sys
from collections.abc import Iterator, Sequence
from copy import deepcopy
from dataclasses import dataclass, fields, replace
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from biogrip import __version__
from biogrip.arrays import Array, BoolArray, IntArray
from biogrip.command.outputs import WRITTEN_BY, check_outputs
from biogrip.config.case import SampleCase
from biogrip.config.design_blocks import SHARED, DesignBlock, DesignConfig
from biogrip.config.loading import load, read_config_of, read_configs, trace_defaults
from biogrip.config.source import overlaid, read_config, read_source
from biogrip.config.trace_blocks import SampleBlocks
from biogrip.digits import significant, with_unit
from biogrip.errors import BiogripError
from biogrip.files import write_text
from biogrip.physics.noise import standard_deviation, without
from biogrip.physics.protocol import Phase, hold, join_phases, largest_load, sample_times
from biogrip.physics.response import (
    compute_grip,
    linear_jaw_force,
    linear_responses,
    simulated_response,
)
from biogrip.terminal import aligned, visible_lines

GENERATIONS = 500
"""Generations of the search; each has five trains for every unknown of a train."""

NO_BOUND = 10.0
"""Relative bound from which on a parameter counts as unknown."""

# Seed of the search, trains of a generation per unknown, and trains tried to see what is in reach.
_SEED, _POPSIZE, _TRIED = 1, 5, 512
# Least readings in a step, and least force of the jaws as a share of the largest in a train.
_FEWEST, _KEPT = 5, 0.01
_MOST = 100_000  # readings of a train
_FINE = 10_000  # levels in the largest
# Score of a train under which the jaws would have to pull: above all logarithms of bounds.
_PULLS = 10.0


@dataclass(frozen=True)
class Limits:
    """Limits of a train."""

    steps: int
    """Number of steps."""
    largest: float
    """Level of the largest magnitude, in the SI unit of what is controlled."""
    rate_Hz: float
    """Rate of the readings."""
    intervals: int
    """Duration, in intervals between readings."""
    traces: int = 1
    """Number of trains, each of one trace."""

    @property
    def elapsed_s(self) -> Array:
        """Times of readings and halfway between them, (2 intervals + 1,)."""
        return np.arange(2 * self.intervals + 1) / (2 * self.rate_Hz)


@dataclass(frozen=True, eq=False)
class Train:
    """A train of steps."""

    levels: Array
    """What is controlled, in its SI unit, (n_steps,)."""
    starts: IntArray
    """Starts of the steps in half intervals: the first 0, the others halfway between readings."""
    limits: Limits

    @property
    def phases(self) -> tuple[Phase, ...]:
        """Phases of a protocol, one a step."""
        durations_s = np.diff(self.starts, append=2 * self.limits.intervals)
        durations_s = durations_s / (2 * self.limits.rate_Hz)
        # Without the last digits, in which rounding shows.
        rounded = (significant(values, 12).tolist() for values in (durations_s, self.levels))
        return tuple(hold(*pair) for pair in zip(*rounded, strict=True))


@dataclass(frozen=True, eq=False)
class Specimen:
    """The sample of a case, and how it answers a unit step."""

    case: SampleCase
    parameters: Array
    """Values of the searched parameters, (n_parameters,)."""
    noise: float
    """Standard deviation of the noise, in the SI unit of what is read."""
    required: BoolArray
    """True for the parameters asked for, (n_parameters,)."""
    nuisance: Array
    """Offset and drift that are fitted along, an orthonormal basis, (n_functions, n_readings).

    Without jaws that is one reading less: at 0 nothing tells on which side of the step it is."""
    unit: Array
    """After a unit step, derivatives of what is read by the log-parameters, and the force of the
    jaws if there are any, at `Limits.elapsed_s`, (n_parameters + 1 or 0, n_times)."""

    def told(self, trains: Sequence[Train]) -> tuple[Array, float]:
        """Return relative bounds, (n_parameters,), of traces together, and the jaws' least force.

        The force is a share of their largest; 1 without jaws.
        """
        slopes, least = zip(*map(self._under, trains), strict=True)
        return relative_bounds(np.hstack(slopes), self.noise), min(least)

    def _under(self, train: Train) -> tuple[Array, float]:
        """Return derivatives of readings under a train, and the jaws' least force."""
        rows = np.zeros_like(self.unit)
        jumps = np.diff(train.levels, prepend=0.0)
        for start, jump in zip(train.starts.tolist(), jumps.tolist(), strict=True):
            rows[:, start:] += jump * self.unit[:, : rows.shape[1] - start]
        slopes, force = np.split(rows, [len(self.required)])
        least = float(force.min() / force.max()) if force.size else 1.0
        return without(self.nuisance, slopes[:, ::2][:, -self.nuisance.shape[1] :]), least


def relative_bounds(slopes: Array, noise: float) -> Array:
    """Return standard deviations of log-parameters from derivatives of what is read by these.

    A parameter that is not told to a factor of e with all others known is taken as known for the
    others, as in `biogrip.judging.likelihood`, and has `NO_BOUND`.
    """
    sizes, bounds = np.linalg.norm(slopes, axis=1) / noise, np.full(len(slopes), NO_BOUND)
    informed = sizes >= 1
    rows = slopes[informed] / (noise * sizes[informed, None])
    # Parameters that stand for one another leave a matrix that can hardly be inverted.
    inverse = np.linalg.inv(rows @ rows.T + 1e-12 * np.eye(len(rows)))
    bounds[informed] = np.sqrt(np.diag(inverse)) / sizes[informed]
    return np.minimum(bounds, NO_BOUND)


@dataclass(frozen=True, eq=False)
class RatedProtocols:
    """Protocols of a sample's traces, and their readings, with what they tell of it together."""

    protocols: Sequence[tuple[Phase, ...]]
    times_s: Sequence[Array]
    bounds: Array
    """Relative bounds, (n_parameters,); `NO_BOUND` for parameters without one."""
    force_N: float | None
    """Least force of the jaws, if there are jaws; negative if they have to pull."""


def design(config: Path, output: Path | None = None) -> None:
    """Search for a train of steps, print what it tells, and write a config that runs it.

    The config, a YAML file, is laid over samples of installed studies, and over what every trace
    takes. By default the output is beside it, with `_designed` in its name; a file that biogrip did
    not write is not replaced. A `BiogripError` says what cannot be used, or that no train tells
    anything.
    """
    output = output or config.with_stem(f"{config.stem}_designed")
    check_outputs([("--output", output)], [config])
    cases, block = read_samples(config)
    try:
        limits, specimens = set_up(cases, block)
    except BiogripError as error:
        raise BiogripError(f"{config}: {error}") from error
    trains, reached = search(specimens, limits)
    protocols = [train.phases for train in trains]
    before = [
        rated(one, [one.case.phases], one.case.block.measurement.rate_Hz) for one in specimens
    ]
    after = [rated(one, protocols, limits.rate_Hz) for one in specimens]
    write_text(output, as_config(read_config(config), specimens, after, limits.rate_Hz))
    then = f"snakemake -j2 --configfile {output} simulates and fits it"
    said = [*_said(specimens, before, after, reached), f"Written to {output}; {then}."]
    print(visible_lines("\n".join(said)))


def read_samples(config: Path) -> tuple[list[SampleCase], DesignBlock]:
    """Read the samples of a config, and the limits of the design; see `design` for errors."""
    # Studies that are installed offer their samples, by the files of their configs.
    files = [offer.load()() for offer in entry_points(group="biogrip.samples")]
    cases = {"cases": read_configs(files).get("cases", {})}
    merged = overlaid(read_configs([trace_defaults()]), cases)
    given, notes = read_config_of(DesignConfig, [config])
    for note in notes:
        print(visible_lines(note), file=sys.stderr)
    merged = overlaid(merged, given)
    if isinstance(cases := merged.get("cases"), dict):
        merged["cases"] = {name: _of_sample(case) for name, case in cases.items()}
    sources = [*map(read_source, (trace_defaults(), *files, config))]
    loaded = load(DesignConfig, merged, sources, SHARED)
    chosen = loaded.only or loaded.cases
    return [SampleCase(name, loaded.cases[name], loaded) for name in chosen], loaded.design


def _of_sample(case: Any) -> Any:
    """Return the keys of a case that are not of a study."""
    known = {block.name for block in fields(SampleBlocks)}
    return {key: case[key] for key in case if key in known} if isinstance(case, dict) else case


def set_up(cases: Sequence[SampleCase], block: DesignBlock) -> tuple[Limits, list[Specimen]]:
    """Return the limits of a block, by default those of all protocols, and the samples of cases.

    A `BiogripError` says which case cannot be judged, and why; or that there is no room for a step.
    """
    for case in cases:
        if wrong := _problem(case, cases[0]):
            raise BiogripError(f"design: {case.name}: {wrong}")
    largest = min((largest_load(case.phases) for case in cases), key=abs)
    if block.largest is not None:
        largest = float(np.copysign(block.largest, largest))
    rate_Hz = min(case.block.measurement.rate_Hz for case in cases)
    duration_s = block.duration_s or min(case.experiment.torque.end_s for case in cases)
    intervals = int(duration_s * rate_Hz * (1 + 1e-12))
    if not _FEWEST <= intervals <= _MOST:
        raise BiogripError(
            f"design.duration_s: found {duration_s:g} s, room for {intervals} readings at "
            f"{rate_Hz:g} Hz; allowed are {_FEWEST} to {_MOST}, by another duration_s or rate_Hz."
        )
    steps = min(block.steps, intervals // _FEWEST)
    limits = Limits(steps, largest, rate_Hz, intervals, block.traces)
    return limits, [_specimen(case, block, limits) for case in cases]


def _problem(case: SampleCase, first: SampleCase) -> str | None:
    """Return what of a case cannot be judged, and what is allowed."""
    controlled = case.instrument.controlled
    if case.recorded:
        return "found a recorded trace, allowed is a sample with values."
    for name in case.experiment.searched.names:
        if not case.parameters[name]:
            return f"found {name} = 0, allowed is a value above 0, or the 0 under `fixed`, too."
    if controlled != first.instrument.controlled:
        text = f"found a protocol of {controlled.name}, allowed is one of "
        return f"{text}{first.instrument.controlled.name} as in {first.name}."
    of_signal = case.noise.level_rad is None and case.noise.reference == "signal"
    if case.noise.absent or not case.noise.white or of_signal:
        return "measurement.noise: allowed is white noise, of a share of the peak or a level_rad."
    return None


def _specimen(case: SampleCase, block: DesignBlock, limits: Limits) -> Specimen:
    problem, model, network = case.experiment, case.experiment.searched, case.network
    required = np.array([name in (block.parameters or model.names) for name in model.names])
    # The noise of an instrument: that of its own sample under its own protocol.
    read = simulated_response(case.gripper, network, problem.torque, case.times_s)
    noise = float(standard_deviation(read[0], case.noise)[0])
    elapsed_s = limits.elapsed_s
    step = join_phases((hold(elapsed_s[-1], 1.0),), deforms=case.instrument.deforms)
    values = np.array([case.parameters[name] for name in model.names])
    unit = linear_responses(problem.gripper, model, step, elapsed_s, values[None])[0, 1:]
    if case.instrument.has_jaws:
        force = linear_jaw_force(case.gripper, network, step, elapsed_s, inertia=False)
        unit = np.vstack((unit, force))
    read_s = elapsed_s[0 if case.instrument.has_jaws else 2 :: 2]
    return Specimen(case, values, noise, required, problem.nuisance(read_s), unit)


def search(
    specimens: Sequence[Specimen], limits: Limits, generations: int = GENERATIONS
) -> tuple[list[Train], list[BoolArray]]:
    """Search for the trains with the lowest worst bound of all parameters within reach.

    Such are asked for, and have a bound in one of some hundred random trains: True in an array
    (n_parameters,) for each sample, returned beside the train. If there is none, it is a
    `BiogripError`. Under a train the jaws are to press all samples throughout.
    """
    # Imported lazily: it is slow to import.
    from scipy.optimize import differential_evolution

    unknowns, rng = 2 * limits.steps * limits.traces, np.random.default_rng(_SEED)
    tried = [decode(point, limits) for point in rng.random((_TRIED, unknowns))]
    reached = [
        np.any([one.told(train)[0] < NO_BOUND for train in tried], axis=0) & one.required
        for one in specimens
    ]
    if not np.any(np.concatenate(reached)):
        text = "no protocol determines a parameter asked for; allowed are less noise, a higher "
        raise BiogripError(f"design: {text}`largest`, a longer duration_s or a higher rate_Hz.")

    def score(point: Array) -> float:
        bounds, least = zip(*(one.told(decode(point, limits)) for one in specimens), strict=True)
        if min(least) < _KEPT:
            return _PULLS - min(least)
        logs = np.log(np.concatenate(bounds)[np.concatenate(reached)])
        # The mean decides among equals, and last bits do not.
        return float(np.float32(logs.max() + 0.01 * logs.mean()))

    result = differential_evolution(
        score,
        [(0.0, 1.0)] * unknowns,
        popsize=_POPSIZE,
        maxiter=generations,
        tol=0.0,
        rng=rng,
        polish=False,
    )
    return decode(result.x, limits), reached


def decode(unknowns: Array, limits: Limits) -> list[Train]:
    """Return trains within their limits from numbers between 0 and 1, (n_unknowns,).

    These are, for each step of each, its level as a share of the largest, and the logarithm of its
    duration.
    """
    return [_decoded(of_train, limits) for of_train in np.split(unknowns, limits.traces)]


def _decoded(unknowns: Array, limits: Limits) -> Train:
    heights, lengths = np.split(unknowns, 2)
    shares = (_FEWEST / limits.intervals) ** lengths
    room = limits.intervals - _FEWEST * limits.steps
    ends = np.cumsum(_FEWEST + np.floor(shares / shares.sum() * room).astype(int))
    starts = np.append(0, 2 * ends[:-1] + 1)
    return Train(limits.largest * np.ceil(_FINE * heights) / _FINE, starts, limits)


def rated(
    specimen: Specimen, protocols: Sequence[tuple[Phase, ...]], rate_Hz: float
) -> RatedProtocols:
    """Compute what traces under some protocols tell of a sample together.

    If one turns the arms further than the comb drives can, it is a `BiogripError`.
    """
    each = [_rated(specimen, phases, rate_Hz) for phases in protocols]
    times_s, slopes, forces_N = zip(*each, strict=True)
    bounds = relative_bounds(np.hstack(slopes), specimen.noise)
    lowest_N = min(forces_N) if specimen.case.instrument.has_jaws else None
    return RatedProtocols(protocols, times_s, bounds, lowest_N)


def _rated(
    specimen: Specimen, phases: tuple[Phase, ...], rate_Hz: float
) -> tuple[Array, Array, float]:
    """Return times of a trace, derivatives of its readings, and the jaws' least force."""
    case, problem = specimen.case, replace(specimen.case.experiment, phases=phases)
    times_s, model = sample_times(problem.torque.end_s, rate_Hz), problem.searched
    if not case.instrument.has_jaws:
        # As `identify` does, which leaves out readings at the very instant of a step.
        times_s = times_s[~np.isin(problem.torque.snapped(times_s), problem.torque.jumps_s)]
    given = problem.gripper, model, problem.torque, times_s, specimen.parameters[None]
    read, slopes = np.split(linear_responses(*given)[0], [1])
    slopes = without(problem.nuisance(times_s), slopes)
    if not case.instrument.has_jaws:
        return times_s, slopes, np.inf
    if read.max() > case.stroke:
        text = f"found a torque that turns the arms by {1e3 * read.max():.4g} mrad, allowed is "
        text += f"what the stroke leaves, {1e3 * case.stroke:.4g} mrad: a lower `largest`."
        raise BiogripError(f"design: {case.name}: {text}")
    network = model.network(specimen.parameters[None])
    return times_s, slopes, compute_grip(case.gripper, network, problem.torque).lowest_N


def as_config(
    given: dict[str, Any],
    specimens: Sequence[Specimen],
    after: Sequence[RatedProtocols],
    rate_Hz: float,
) -> str:
    """Return a config, as YAML, with an experiment as that of its cases.

    Of several traces of a sample each is a case, whose name ends in its number.
    """
    config = deepcopy(given)
    cases, several = config.setdefault("cases", {}), len(after[0].protocols) > 1
    if several:
        numbers = range(1, len(after[0].protocols) + 1)
        config["only"] = [f"{one.case.name}_{n}" for one in specimens for n in numbers]
    for one, experiment in zip(specimens, after, strict=True):
        column = one.case.instrument.controlled.column
        for number, protocol in enumerate(experiment.protocols, 1):
            phases = [{"duration_s": phase.duration_s, column: phase.level} for phase in protocol]
            measured = {"noise": {"level_rad": one.noise}, "rate_Hz": rate_Hz}
            designed = {"protocol": {"phases": phases}, "measurement": measured}
            name, known = one.case.name, cases.get(one.case.name) or {}
            if several:
                name, known = f"{name}_{number}", {"sample": one.case.plain["sample"], **known}
            cases[name] = overlaid(known, designed)
    text = yaml.safe_dump(config, sort_keys=False, default_flow_style=None, width=100)
    return f"# {WRITTEN_BY} {__version__}: a protocol by `biogrip design`.\n{text}"


def _said(
    specimens: Sequence[Specimen],
    before: Sequence[RatedProtocols],
    after: Sequence[RatedProtocols],
    reached: Sequence[BoolArray],
) -> Iterator[str]:
    """Yield lines: a table, and what it takes for granted."""
    rows: list[tuple[str, ...]] = []
    notes = []
    for one, within, *both in zip(specimens, reached, before, after, strict=True):
        name, instrument = one.case.name, one.case.instrument
        controlled, read = instrument.controlled, instrument.read
        for index, parameter in enumerate(one.case.experiment.searched.names):
            bounds = (rating.bounds[index] for rating in both)
            percents = (f"{100 * bound:.3g}" if bound < NO_BOUND else "none" for bound in bounds)
            rows.append((name, f"{parameter}: bound (%)", *percents))
            if one.required[index] and not within[index]:
                notes.append(f"No protocol that was tried determines {parameter} of {name}.")
        values = {
            with_unit(f"noise of the {read.name}", read.unit): [one.noise, one.noise],
            with_unit(f"largest {controlled.name}", controlled.unit): [
                max(map(largest_load, rating.protocols), key=abs) for rating in both
            ],
            "highest rate (Hz)": [1 / np.diff(rating.times_s[0]).min() for rating in both],
            "readings": [sum(map(len, rating.times_s)) for rating in both],
        }
        if instrument.has_jaws:
            values["least force of the jaws (N)"] = [rating.force_N for rating in both]
        rows += [(name, what, *(f"{value:.4g}" for value in pair)) for what, pair in values.items()]
    yield aligned(rows, ("sample", "", "config's protocol", "designed"))
    yield from notes
    yield (
        "A bound is the least standard deviation (Cramér-Rao) in percent of the value, with what "
        "has none taken as known, too. The noise is white, and the same under both."
    )
