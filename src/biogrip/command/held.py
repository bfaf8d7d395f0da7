"""What was held or loaded, as the user gave it."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from biogrip.digits import plain
from biogrip.identify.other_fits import Trace
from biogrip.study.source import HOLD
from biogrip.study.study import Case
from biogrip.traces.columns import held_unit
from biogrip.traces.reader import Recording


def load_in_words(trace: Trace, case: Case, given: Mapping[str, Any]) -> str:
    """Return what was held or loaded; nothing where a config has the protocol.

    Given are the blocks of the config that the user has set.
    """
    (recording, experiment), controlled = trace, case.instrument.controlled
    form, start_s = recording.form, case.columns.start_s or 0.0
    if recording.load is not None and experiment.record is not None:
        column, loads = form["columns"]["load"], experiment.record[:, 1]
        if case.instrument.relative:
            loads = loads * getattr(case.block.protocol.phases[0], controlled.column)
        ends = loads.min(), loads.max()
        low, high = (plain(end / controlled.units[column["unit"]]) for end in ends)
        what = _with_unit(high if low == high else f"{low} to {high}", column["unit"])
        count = np.count_nonzero(recording.load[:, 0] >= start_s)
        rows = f"column {column['column']}, {count:,} rows"
        return f"Load: {what} from {start_s:g} s ({rows})."
    if HOLD[0] not in given:
        return ""
    number, unit = held_unit(given[HOLD[0]], controlled)
    start = "its start, as fitted," if experiment.fit_start else f"{start_s:g} s"
    return f"Held: {_with_unit(f'{number:g}', unit)} from {start} to {form['last_s']:g} s."


def _with_unit(number: str, unit: str) -> str:
    return number if unit == "1" else f"{number} {unit}"


def remarks_on_hold(recording: Recording, case: Case, given: Mapping[str, Any]) -> tuple[str, ...]:
    """Return a sentence if readings have a unit with a prefix, and what was held is a number."""
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
