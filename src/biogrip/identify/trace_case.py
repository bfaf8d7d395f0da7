"""A recorded trace and the case that it is identified as, with search ranges that follow from it.

Torque over rotation is the scale of stiffness at the jaws, and load over deformation that of other
instruments. A spring changes the trace by less than its noise if it is softer by more than the
ratio of the trace to the noise, over all readings, or if it turns by less than what all readings
together resolve. A damper is as stiff as c/t after a time t, which is between the shortest sampling
interval and the duration; so is a springpot, with a power of t.
"""

from collections.abc import Hashable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from biogrip.arrays import Array
from biogrip.digits import plain
from biogrip.fit.experiment import Experiment
from biogrip.fit.genome import GeneRange
from biogrip.identify.settings import Asked, case_of
from biogrip.judging.doubts import DOUBT, HARMLESS, Note
from biogrip.physics.protocol import is_held, largest_load
from biogrip.physics.whitening import drift_is_flow, estimate_noise
from biogrip.records.traces import Measurements
from biogrip.stages import recording
from biogrip.study.source import HOLD
from biogrip.study.study import Case
from biogrip.traces.columns import held_unit
from biogrip.traces.loads import without_noise

# Largest ratio of trace to noise that widens a range, and a margin, for scales are rough.
_CLEAREST, _MARGIN = 1e5, 10.0
_LEAST, _MOST = -16, 18

# Share of readings at an end of their scale from which on they are saturated, how many times as
# often as each of the next values, and fewest values.
_SATURATED, _MORE_OFTEN, _VALUES = 0.05, 5, 5

_FLOWS = {"damper": "c_p", "maxwell": "c", "burgers": "c_s"}


def flow_of(problem: Experiment) -> str:
    """Name what a sample flows by under a constant load, on and on in a line; nothing if by none.

    Without the spring beside the branches that is the sum of their dampers.
    """
    if problem.fixed.get("k_p") == 0:
        return " + ".join(p.name for p in problem.searched.parameters if p.kind == "damping")
    return _FLOWS.get(problem.model.name, "")


@dataclass(frozen=True)
class TraceCase:
    """A recorded trace and the case that it is identified as."""

    case: Case
    """The case, with the search ranges of this trace."""
    recorded: Measurements
    """The trace."""
    problem: Experiment
    """Assumptions of its fit, with the standard deviations of its readings if they are known."""
    given: Mapping[str, Any]
    """Blocks of the config that the user has set, see `Asked.given`."""

    @property
    def readings(self) -> tuple[Array, Array]:
        """Times and readings, (n_samples,) each."""
        return self.recorded.time_s, self.recorded.readings[0]

    @property
    def load_in_words(self) -> str:
        """What was held or loaded, as the user gave it; nothing where a config has the protocol."""
        case, form = self.case, self.recorded.form
        controlled, start_s = case.instrument.controlled, case.columns.start_s or 0.0
        if case.record is not None:
            column, loads = form["columns"]["load"], case.record[:, 1]
            if case.instrument.relative:
                loads = loads * getattr(case.block.protocol.phases[0], controlled.column)
            ends = loads.min(), loads.max()
            low, high = (plain(end / controlled.units[column["unit"]]) for end in ends)
            what = _with_unit(high if low == high else f"{low} to {high}", column["unit"])
            rows = f"column {column['column']}, {len(loads):,} rows"
            return f"Load: {what} from {start_s:g} s ({rows})."
        if HOLD[0] not in self.given:
            return ""
        number, unit = held_unit(self.given[HOLD[0]], controlled)
        start = "its start, as fitted," if self.problem.fit_start else f"{start_s:g} s"
        return f"Held: {_with_unit(f'{number:g}', unit)} from {start} to {form['last_s']:g} s."

    @property
    def names_models(self) -> bool:
        """True if the user names the sample models to compare."""
        return "models" in (self.given.get("model_selection") or {})

    @property
    def budget(self) -> Hashable:
        """What traces that are fitted together have in common: model, fits and confidence."""
        return self.problem.searched, self.case.block.least_squares, self.case.confidence

    def with_terms(self, *, drift: bool) -> "TraceCase":
        """Return the trace as if the user had declared an offset, or a drift, too."""
        measured = self.case.block.measurement
        measured = replace(measured, offset=True, drift=drift or self.problem.drift)
        case = replace(self.case, block=replace(self.case.block, measurement=measured))
        return _with_ranges(case, self.recorded, self.given)


def _with_unit(number: str, unit: str) -> str:
    return number if unit == "1" else f"{number} {unit}"


def note_on_hold(trace: TraceCase) -> list[Note]:
    """Return a note if readings have a unit with a prefix, and what was held is a bare number."""
    read, controlled = trace.problem.instrument.read, trace.problem.instrument.controlled
    unit = trace.recorded.form["columns"][read.name]["unit"]
    prefix, held = unit.removesuffix(read.unit), trace.given.get(HOLD[0])
    if held is None or not (prefix and read.unit and controlled.unit) or prefix == unit:
        return []
    number, own = held_unit(held, controlled)
    if own != controlled.unit or str(held).rstrip().endswith(own):
        return []
    likely = prefix + controlled.unit
    likely = likely if likely in controlled.units else controlled.unit
    text = (
        f"The {read.name} is in {unit}, but what was held, {number:g}, is taken to be in {own}: "
        f'say its unit, as in --hold "{number:g} {likely}".'
    )
    return [Note(HARMLESS, text)]


def note_saturated(trace: TraceCase) -> list[Note]:
    """Return a doubt if many readings after the start are exactly the largest, or the smallest.

    Readings that are only rounded have neighbouring values nearly as often.
    """
    time_s, readings = trace.readings
    values, counts = np.unique(readings[time_s > 0], return_counts=True)
    unit, notes = f" {trace.problem.instrument.read.unit}".rstrip(), []
    for end, at, near in (("largest", -1, slice(-_VALUES, -1)), ("smallest", 0, slice(1, _VALUES))):
        if len(values) < _VALUES or counts[at] <= _SATURATED * np.sum(counts):
            continue
        if counts[at] > _MORE_OFTEN * np.max(counts[near]):
            text = (
                f"{counts[at]} of {np.sum(counts)} readings are exactly the {end}, "
                f"{plain(values[at])}{unit}: the instrument looks saturated, and what it cut off "
                "is missing."
            )
            notes.append(Note(DOUBT, text))
    return notes


def read_trace(asked: Asked) -> TraceCase:
    """Read a trace as a case.

    A `BiogripError` has file, line and column, or setting, that cannot be used.
    """
    case, given = case_of(asked), asked.given
    columns = replace(case.columns, by_options=True)
    declared = case.block.measurement
    problem = replace(case.problem, offset=bool(declared.offset), drift=bool(declared.drift))
    trace = recording.read_checked(asked.trace, problem, columns)
    if case.record is not None:
        record, noise = without_noise(case.problem, trace.time_s, trace.readings[0])
        case, trace = replace(case, record=record), replace(trace, load_noise=noise)
    if case.problem.coloured:
        case = _without_likenesses(case, trace.time_s)
    read = _with_ranges(case, trace, given)
    return replace(read, recorded=recording.with_fitted_onset(trace, read.case.problem))


def _with_ranges(case: Case, trace: Measurements, given: Mapping[str, Any]) -> TraceCase:
    ranges = ranges_of(case.problem.weighted(trace.sd), trace.time_s, trace.readings[0])
    for name in given.get("search_range") or {}:
        ranges.pop(name, None)
    block = replace(case.block, search_range=replace(case.block.search_range, **ranges))
    case = replace(case, block=block)
    return TraceCase(case, trace, case.problem.weighted(trace.sd), given)


def _without_likenesses(case: Case, time_s: Array) -> Case:
    """Return a case without a default offset or drift that looks like what its sample does."""
    measured, problem = case.block.measurement, case.problem
    network = problem.searched.network([problem.searched.example])
    own = network.k_p[0] > 0 if problem.instrument.deforms else network.c_p[0] == 0
    if measured.offset is None and own and is_held(problem.torque, time_s):
        measured = replace(measured, offset=False)
    flows = bool(flow_of(problem)) and drift_is_flow(problem.torque, time_s)
    if measured.drift is None and flows:
        measured = replace(measured, drift=False)
    return replace(case, block=replace(case.block, measurement=measured))


def ranges_of(experiment: Experiment, time_s: Array, readings: Array) -> dict[str, GeneRange]:
    """Compute search ranges of springs and dampers from the scales of a trace, (n_samples,).

    The problem has the noise, if it is known. Ranges are by name, without that of exponents.
    """
    turned = readings - np.mean(readings) if experiment.offset else readings
    noise_sd = experiment.sd
    if noise_sd is None:
        own = experiment.noise_sd or estimate_noise(readings)
        noise_sd = np.full(len(turned), own)
    largest = float(np.max(np.abs(turned)))
    ratios = np.linalg.norm([turned / noise_sd, largest / noise_sd], axis=1)
    softer, stiffer = _MARGIN * np.clip(ratios, 1.0, _CLEAREST)
    torque_Nm = abs(largest_load(experiment.phases))
    stiffness = torque_Nm / (experiment.gripper.lever_m**2 * largest)
    if experiment.instrument.deforms:
        stiffness = largest / torque_Nm
    low, high = stiffness / softer, stiffness * stiffer
    short_s, long_s = float(np.min(np.diff(time_s))), float(np.ptp(time_s))
    dampers = _decades(low * short_s, high * long_s)
    springpots = _decades(low * min(short_s, 1.0), high * max(long_s, 1.0))
    return {"k": springpots, "k_p": _decades(low, high), "c": dampers, "c_p": dampers}


def _decades(low: float, high: float) -> GeneRange:
    ends = int(np.floor(np.log10(low))), int(np.ceil(np.log10(high)))
    least, most = (min(max(end, _LEAST), _MOST) for end in ends)
    return GeneRange((least, most), (1, 9))
