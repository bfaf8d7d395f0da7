"""Plausibility of a recorded trace: what a wrong unit, sign or protocol would show.

A linear viscoelastic sample makes the gripper a sum of lags with real relaxation times: between
proportional to the torque (a spring) and to its integral (a damper). So the trace is fitted by
linear least squares with the torque lagged by three relaxation times: a negligible one, a tenth of
the protocol, and ten protocols. Three lags are too few to identify a sample, but enough to find its
response under noise. The peak of the readings would be a peak of the noise.
"""

import math
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from biogrip.arrays import Array
from biogrip.digits import plain
from biogrip.errors import BiogripError
from biogrip.judging.doubts import DOUBT, Note
from biogrip.physics.gripper import Gripper
from biogrip.physics.instruments import Instrument
from biogrip.physics.modes import lagged_torques
from biogrip.physics.protocol import TorqueHistory, torque_at
from biogrip.physics.whitening import without
from biogrip.traces.any_sample import extreme_responses, left_over
from biogrip.traces.columns import TIME_UNITS, Columns, place, unit_of
from biogrip.traces.reader import Recording

LARGEST_SHARE = 1.5
"""Largest plausible rotation, as a multiple of the free rotation.

No sample makes the arm turn further than without it. The excess allows for errors of the fit
and of the gripper's stiffness.
"""

SMALLEST_SHARE = 2e-3
"""Smallest plausible rotation, as a multiple of the free rotation.

The paper's stiffest sample, the endothelial cell, turns by 8e-3. The ratio of the limits,
`LARGEST_SHARE` / `SMALLEST_SHARE` = 750, is below 1000, so no trace passes both in its unit and
in one a thousand times larger or smaller.
"""

SHORTEST_SHARE = 0.02
"""Least share of the protocol that a trace must cover: more than min/h = s/min = 1/60."""

FALSE_ALARM = 1e-3
"""Share of pure-noise traces that are accepted as a response."""

# Relative tolerance, since times are written with few digits.
_TIME_SLACK = 1e-5
_LAG_SHARES = (1e-6, 0.1, 10.0)
# Log-likelihood ratio, times two, above which a trace counts as mirrored.
_FAR_LIKELIER = -2 * math.log(FALSE_ALARM)
# Norm below which a constant lies in the span of offset and drift.
_NO_CONSTANT = 1e-6
# Share of a function's norm that may be rounding error.
_ROUNDING = 1e-9
# Multiple of a given noise from which a rotation is seen, however small it is.
_FAR_ABOVE = 10.0
# Multiple of the free rotation beyond which its square could overflow.
_ABSURD = 1e9
# Share of readings at an end of their scale from which on they are saturated, how many times as
# often as each of the next values, and fewest values.
_SATURATED, _MORE_OFTEN, _FEWEST_VALUES = 0.05, 5, 5


def check_recording(
    recording: Recording,
    gripper: Gripper,
    torque: TorqueHistory,
    path: Path,
    columns: Columns,
    nuisance: Array,
    instrument: Instrument,
    noise_rad: float | None = None,
    typical_rad: float | None = None,
    onset_s: float | None = None,
) -> str | None:
    """Refuse a trace that is impossible with the instrument and protocol.

    Checked in this order: times outside the protocol, or covering too little of it; no response
    to the torque; a response of the wrong sign; a rotation above the free gripper's, or so small
    that the sample would be hundreds of times stiffer than the hinges, so that the trace shows only
    errors of the instrument. A trace in a wrong unit fails one of these checks. A small rotation
    passes if a given noise is far smaller still. Without arms, nothing limits a reading.

    Parameters
    ----------
    recording, path, columns
        Trace, its times counted from the start of the protocol, and its source, for messages.
    gripper, torque, instrument
        What it was recorded with: gripper, protocol, and what is controlled and read.
    nuisance : (n_functions, n_samples)
        Orthonormal nuisance functions of the instrument, see `nuisance_basis`.
    noise_rad, typical_rad
        Standard deviation of the noise, if it is the same everywhere and known, by default that of
        the fit's residuals; and a typical one where it is given in any way.
    onset_s
        Time of the clock at which the protocol starts; if given, readings before it are allowed.

    Returns
    -------
    str or None
        A sentence on a rotation that passes only since the given noise is far smaller.

    Raises
    ------
    BiogripError
        With file, line, column, what was found and allowed, and a unit that would be plausible.
    """
    _check_times(recording, torque, path, columns, onset_s)
    trace, free = recording.rotation_rad, free_rotation(gripper, torque)
    largest = float(np.abs(trace).max())
    if largest > _ABSURD * free:
        _check_turn(recording, largest, free, path, columns, None)
    lagged = lagged_torques(torque, _LAG_SHARES)(recording.time_s)
    # Lagged torques, nuisance functions, a constant of norm 1 and the trace as short vectors that
    # have the same inner products.
    constant = np.full(len(trace), len(trace) ** -0.5)
    every = np.vstack((lagged, nuisance, constant, trace))
    rows = np.asarray(np.linalg.qr(every.T, mode="r")).T
    functions = rows[: len(lagged)], rows[len(lagged) : -2], rows[-2:-1], rows[-1]
    weights = _response_weights(functions, len(trace), noise_rad, constant=instrument.deforms)
    where = f"{_extent(recording, path)}, column '{columns.reading}'"
    read, controlled = columns.quantity, instrument.controlled.name
    # Without any scatter nothing tells noise from sample.
    if weights is None or np.ptp(trace) == 0:
        unit = f" {read.unit}".rstrip()
        given = ""
        if noise_rad is not None:
            given = f" Given were {noise_rad:g}{unit} as noise; the peak is {plain(largest)}{unit}."
        raise BiogripError(
            f"{where}: found no response to the {controlled}, but {plain(trace.mean())}{unit} "
            f"throughout, give or take {plain(trace.std(), 2)}{unit}; allowed is a {read.name} "
            f"from zero that follows the {controlled} and stands out of the noise.{given}"
        )
    if _is_mirrored(functions, len(trace), gripper, noise_rad):
        sign = "one of the same sign"
        if instrument.has_jaws:
            sign = "the closing rotation, positive where the arm closes"
        raise BiogripError(
            f"{where}: found a {read.name} that goes against the {controlled}, allowed is {sign}. "
            f"It would fit if it were -1 times (then say {columns.said_by('scale')}), or if an "
            "offset or drift of the instrument, where it has one, were declared."
        )
    if not instrument.has_jaws:
        return None
    turn = float(np.abs(weights @ lagged).max())
    return _check_turn(recording, turn, free, path, columns, typical_rad)


def note_saturated(trace: Array, unit: str) -> list[Note]:
    """Return a doubt if many readings, (n_samples,), are exactly the largest, or the smallest.

    Readings that are only rounded have neighbouring values nearly as often.
    """
    values, counts = np.unique(trace, return_counts=True)
    unit, notes = f" {unit}".rstrip(), []
    for end, value, own in (("largest", values[-1], counts[::-1]), ("smallest", values[0], counts)):
        others = own[1:_FEWEST_VALUES]
        often = len(own) >= _FEWEST_VALUES and own[0] > _MORE_OFTEN * others.max()
        if often and own[0] > _SATURATED * len(trace):
            text = (
                f"{own[0]} of {len(trace)} readings are exactly the {end}, {plain(value)}{unit}: "
                "the instrument looks saturated, and what it cut off is missing."
            )
            notes.append(Note(DOUBT, text))
    return notes


def free_rotation(gripper: Gripper, torque: TorqueHistory) -> float:
    """Return the largest static rotation of the left arm in rad that any sample allows.

    Statically phi_2 = (1 - x) tau_2/k_2 + x (tau_2 - tau_4)/(k_2 + k_4), where x
    goes from 0 without a sample to 1 with a rigid one.
    """
    edges = np.append(torque.time_s, torque.end_s)
    times = np.linspace(edges[:-1], edges[1:], 1000, endpoint=False).ravel()
    left, right = (torque_at(torque, times, arm) for arm in ("left", "right"))
    k_2, k_4 = gripper.left.stiffness_Nm_per_rad, gripper.right.stiffness_Nm_per_rad
    alone, pushed = np.abs(left) / k_2, np.abs(left - right) / (k_2 + k_4)
    return float(max(alone.max(), pushed.max()))


def _check_times(
    recording: Recording, torque: TorqueHistory, path: Path, columns: Columns, onset_s: float | None
) -> None:
    end_s, slack = torque.end_s, _TIME_SLACK * torque.end_s
    begins = onset_s or 0.0
    time_s, earliest = recording.time_s, -slack if onset_s is None else -np.inf
    clock_s = time_s + begins
    shortest = SHORTEST_SHARE * end_s

    def fits(factor: float) -> bool:
        first, last = factor * clock_s[[0, -1]] - begins
        return bool(first >= earliest and shortest + max(first, 0) <= last <= end_s + slack)

    if fits(1.0):
        return
    unit = unit_of(path, columns.time, columns.time_unit, TIME_UNITS, columns.said_by("time_unit"))
    hint = _other_units(unit, TIME_UNITS, fits)
    for sample in np.flatnonzero((time_s < earliest) | (time_s > end_s + slack))[:1]:
        if not hint and onset_s is None:
            how = "--start says when, or --start fit finds it"
            if not columns.by_options:
                how = "start_s under measurement says when, or fit_start: true finds it"
            hint = f" If the protocol starts at another time of the clock than 0, {how}."
        raise BiogripError(
            f"{place(path, recording.lines[sample], columns.time)}: found "
            f"{clock_s[sample]:.12g} s, allowed is the protocol's time, {begins:g} to "
            f"{begins + end_s:g} s.{hint}"
        )
    raise BiogripError(
        f"{_extent(recording, path)}, column '{columns.time}': found only {clock_s[0]:g} to "
        f"{clock_s[-1]:g} s of the protocol's {end_s:g} s, allowed are at least {shortest:g} s of "
        f"it.{hint}"
    )


def _response_weights(
    functions: tuple[Array, Array, Array, Array],
    samples: int,
    noise_rad: float | None,
    *,
    constant: bool,
) -> Array | None:
    """Return the weights of the lagged torques in the trace, or None if it does not follow them."""
    from scipy.special import chdtri, fdtri

    lagged, nuisance, one, readings = functions
    basis, trace = _cleared(nuisance, lagged), without(nuisance, readings)
    # By an F test against white noise about zero, or a chi-squared test if the noise is known.
    weights, _, unknowns, _ = np.linalg.lstsq(basis.T, trace, _ROUNDING)
    response = weights @ basis
    explained, rest = np.sum(response**2), np.sum((trace - response) ** 2)
    if not constant and np.sum(without(one, trace) ** 2) <= rest:
        return None
    if noise_rad is not None:
        least = noise_rad**2 * chdtri(unknowns, FALSE_ALARM)
    else:
        freedom = samples - unknowns
        least = unknowns * fdtri(unknowns, freedom, 1 - FALSE_ALARM) * rest / freedom
    return np.asarray(weights, np.float64) if explained > least else None


def _cleared(basis: Array, functions: Array) -> Array:
    """Project functions out of a basis; of those in its span only rounding errors would be left."""
    rest = without(basis, functions)
    left, whole = np.linalg.norm(rest, axis=1), np.linalg.norm(functions, axis=1)
    return np.where(left[:, None] > _ROUNDING * whole[:, None], rest, 0.0)


def _is_mirrored(
    functions: tuple[Array, Array, Array, Array],
    samples: int,
    gripper: Gripper,
    noise_rad: float | None,
) -> bool:
    """Return True if the mirrored trace is far likelier, also beside an undeclared offset."""
    lagged, nuisance, constant, trace = functions
    rest = without(nuisance, constant)
    norm = np.linalg.norm(rest)
    also = np.vstack((nuisance, rest / norm)) if norm > _NO_CONSTANT else nuisance
    responses = extreme_responses(lagged, gripper, len(_LAG_SHARES))
    declared, freed = (
        [left_over(without(basis, trace), sign * _cleared(basis, responses)) for sign in (1, -1)]
        for basis in (nuisance, also)
    )
    if noise_rad is not None:
        likelier = declared[0] - declared[1] > _FAR_LIKELIER * noise_rad**2
    else:
        likelier = declared[0] > declared[1] * math.exp(_FAR_LIKELIER / samples)
    return bool(likelier and freed[0] > freed[1])


def _check_turn(
    recording: Recording,
    turn: float,
    free: float,
    path: Path,
    columns: Columns,
    noise_rad: float | None,
) -> str | None:
    smallest, largest = SMALLEST_SHARE * free, LARGEST_SHARE * free

    def fits(factor: float) -> bool:
        return smallest <= factor * turn <= largest

    if fits(1.0):
        return None
    allowed, said_by = columns.quantity.units, columns.said_by(columns.unit_key)
    unit = unit_of(path, columns.reading, columns.reading_unit, allowed, said_by)
    hint = _other_units(unit, allowed, fits)
    alone = f"without any sample the arm turns by {free:.3g} rad"
    if noise_rad is not None and _FAR_ABOVE * noise_rad < turn < smallest:
        return (
            f"The largest rotation is {turn:.3g} rad, where {alone}: the sample is very stiff, or "
            f"the unit is not the right one.{hint}"
        )
    limit = f"at most {largest:.3g} rad: {alone}"
    if turn < smallest:
        limit = (
            f"at least {smallest:.3g} rad, or less with a given noise (--noise) {_FAR_ABOVE:g} "
            f"times smaller still, where {alone}"
        )
    sample = np.argmax(np.abs(recording.rotation_rad))
    raise BiogripError(
        f"{place(path, recording.lines[sample], columns.reading)}: found "
        f"{recording.rotation_rad[sample]:.3g} rad as the largest rotation, and {turn:.3g} rad as "
        f"the largest with the noise smoothed out; allowed is {limit}.{hint}"
    )


def _other_units(unit: str, units: Mapping[str, float], fits: Callable[[float], bool]) -> str:
    """Return a hint on units, or else factors, in which the numbers would be plausible."""
    named = [(size / units[unit], name) for name, size in units.items()]
    found = [f"{factor:.4g} times (is it in {name}?)" for factor, name in named if fits(factor)]
    found = found or [f"{factor:g} times" for factor in (1e-6, 1e-3, 1e3, 1e6) if fits(factor)]
    return f" It would fit if it were {' or '.join(found)}." if found else ""


def _extent(recording: Recording, path: Path) -> str:
    return f"{place(path)}, lines {recording.lines[0]} to {recording.lines[-1]}"
