"""Instrument and protocol of a recorded trace, where the config leaves them open."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from biogrip.errors import BiogripError
from biogrip.identify.read_as import ReadAs
from biogrip.physics.instruments import GRIPPER, INSTRUMENTS, Instrument
from biogrip.traces.reader import read_recording


def with_instrument(
    merged: Mapping[str, Any], given: Mapping[str, Any], read_as: ReadAs, trace: Path
) -> dict[str, Any]:
    """Return the blocks of a config with an instrument, a reading and a protocol that it holds.

    What is read tells the instrument. What is held comes from the user's config or, from 0 to the
    end of the trace, from ``--hold``; where a compliance or a modulus is read, that is 1.

    Parameters
    ----------
    merged, given
        Blocks of the whole config, and of the user's.
    read_as
        Command-line options.
    trace
        CSV file.

    Raises
    ------
    BiogripError
        If nothing says what is held, or ``--reading`` is none of the config's instrument.
    """
    instrument = _instrument(merged, given)
    kind = given.get("instrument", instrument.kind)
    _refuse_another(read_as, kind)
    measurement = {instrument.read.name: instrument.read.column} | merged["measurement"]
    found = {**merged, "instrument": kind, "measurement": measurement}
    if "protocol" in given and read_as.hold is None:
        return found
    level = read_as.hold
    if level is None:
        if instrument.has_jaws:
            return found
        if not instrument.relative:
            controlled = instrument.controlled
            unit = f" in {controlled.unit}" if controlled.unit else ""
            raise BiogripError(
                f"--hold: is missing; allowed is the {controlled.name}{unit} that was held, or a "
                "protocol in --config."
            )
        level = 1.0
    phase = {
        "duration_s": _duration_s(trace, read_as.with_config(measurement), instrument),
        instrument.controlled.column: level,
    }
    return {**found, "protocol": {"phases": [phase]}}


def _refuse_another(read_as: ReadAs, kind: Any) -> None:
    """Refuse a ``--reading`` of another instrument than the config's."""
    allowed = [name for name, each in INSTRUMENTS.items() if each.kind == kind]
    if read_as.reading and allowed and read_as.reading[0] not in allowed:
        raise BiogripError(
            f"--reading: found '{read_as.reading[0]}', allowed are {', '.join(allowed)}: those of "
            f"instrument: {kind} of the config."
        )


def _duration_s(trace: Path, read_as: ReadAs, instrument: Instrument) -> float:
    """Return the time from the start of the protocol to the end of a trace."""
    try:
        time_s = read_recording(trace, read_as.columns(instrument.read)).time_s
    except BiogripError:
        # Whoever uses the trace reads it again, and says what is wrong with it.
        return 1.0
    lasts = float(time_s[-1]) - (read_as.start_s or min(float(time_s[0]), 0.0))
    return lasts if lasts > 0 else 1.0


def _instrument(merged: Mapping[str, Any], given: Mapping[str, Any]) -> Instrument:
    """Return the instrument by the reading that is named, or by kind and protocol."""
    for name in INSTRUMENTS:
        if name in merged["measurement"]:
            return INSTRUMENTS[name]
    kind = given.get("instrument", GRIPPER.kind)
    some = [each for each in INSTRUMENTS.values() if each.kind == kind] or [GRIPPER]
    keys = {*_keys(merged.get("protocol"))}
    return next((each for each in some if each.controlled.column in keys), some[0])


def _keys(protocol: Any) -> Iterator[str]:
    phases = protocol.get("phases") if isinstance(protocol, Mapping) else None
    for phase in phases if isinstance(phases, list) else []:
        yield from phase if isinstance(phase, Mapping) else []
