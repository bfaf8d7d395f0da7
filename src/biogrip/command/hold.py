"""What was held or loaded, in words."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from biogrip.config.case import SampleCase
from biogrip.config.source import HOLD, RAMP
from biogrip.digits import plain
from biogrip.identify.prepare import Trace
from biogrip.traces.columns import held_unit, shape_and_sizes
from biogrip.traces.reader import Recording

# Share of the largest load so far below which a contact shrinks, not only scatters.
_STAYS = 0.9


def load_in_words(trace: Trace, case: SampleCase, given: Mapping[str, Any]) -> str:
    """Return what was held or loaded; nothing where a config has the protocol.

    Given are the blocks of the config that the user has set.
    """
    (recording, experiment), measured = trace, case.block.measurement
    controlled, start_s = measured.instrument.controlled, measured.start_s or 0.0
    if recording.load is not None and experiment.record is not None:
        column, loads = recording.form["columns"]["load"], experiment.record[:, 1]
        if case.instrument.relative:
            loads = loads * getattr(case.block.protocol.phases[0], controlled.column)
        ends = loads.min(), loads.max()
        low, high = (plain(controlled.in_unit(end, column["unit"])) for end in ends)
        what = _with_unit(high if low == high else f"{low} to {high}", column["unit"])
        count = np.count_nonzero(recording.load[:, 0] >= start_s)
        rows = f"column {column['column']}, {count:,} rows"
        return f"Load: {what} from {start_s:g} s ({rows}){_shape(case)}."
    if HOLD[0] not in given:
        return ""
    number, unit = held_unit(given[HOLD[0]], controlled)
    start = "its start, as fitted," if experiment.fit_start else f"{start_s:g} s"
    what = f"{_with_unit(f'{number:g}', unit)} from {start} to {recording.form['last_s']:g} s"
    rise = f", reached within {given[RAMP[0]]:g} s" if RAMP[0] in given else ""
    return f"Held: {what}{rise}{_shape(case)}."


def _shape(case: SampleCase) -> str:
    """Return what turns a load and a depth into a stress and a strain."""
    if (text := case.block.measurement.shape) is None:
        return ""
    return f", by the shape {text} ({shape_and_sizes(text)[0].source})"


def _shrinks(recording: Recording, case: SampleCase) -> tuple[str, ...]:
    """Return a sentence if a tip was drawn back, where its contact has no such sum."""
    instrument = case.block.measurement.instrument
    if recording.load is None or instrument.read.power == instrument.controlled.power == 1:
        return ()
    time_s, loads = recording.load[recording.load[:, 0] <= recording.form["last_s"]].T
    most = np.maximum.accumulate(loads)
    falls = np.flatnonzero((most > 0.1 * most[-1]) & (loads < _STAYS * most))
    if not len(falls):
        return ()
    return (
        f"The contact shrinks from {time_s[falls[0]]:g} s on: what is said holds while it grows or "
        f"stays. Leave these readings out: --until {time_s[falls[0] - 1]:g}.",
    )


def _with_unit(number: str, unit: str) -> str:
    return number if unit == "1" else f"{number} {unit}"


def remarks_on_hold(
    recording: Recording, case: SampleCase, given: Mapping[str, Any]
) -> tuple[str, ...]:
    """Return a sentence if a tip was drawn back, or what was held may be in another unit.

    That is if readings have a unit with a prefix, and what was held is a number.
    """
    if shrinks := _shrinks(recording, case):
        return shrinks
    read, controlled = case.instrument.read, case.instrument.controlled
    unit, held = recording.units[1], given.get(HOLD[0])
    prefix = unit.removesuffix(read.unit)
    if held is None or not (prefix and read.unit and controlled.unit) or prefix == unit:
        return ()
    number, own = held_unit(held, controlled)
    if own != controlled.unit or str(held).rstrip().endswith(own):
        return ()
    likely = prefix + controlled.unit
    likely = likely if likely in controlled.units else controlled.unit
    return (
        f"The {read.name} is in {unit}, but what was held, {number:g}, is taken to be in {own}: "
        f'say its unit, as in --hold "{number:g} {likely}".',
    )
