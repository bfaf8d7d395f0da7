"""Plausibility of a recorded trace as the response of a gripper to a protocol.

Tests use the part of a trace that follows the torque. A linear viscoelastic sample makes the
gripper a sum of lags with real relaxation times: between proportional to the torque (a spring)
and to its integral (a damper). So the trace is fitted by linear least squares with the torque
lagged by three relaxation times: a negligible one, a tenth of the protocol, and ten protocols.
Three lags are too few to identify a sample, but enough to find its response under noise. The
peak of the readings would be a peak of the noise, and block means would lose a sinusoid.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from biogrip.arrays import Array, parts
from biogrip.errors import BiogripError
from biogrip.physics.drift import without
from biogrip.physics.gripper import Gripper
from biogrip.physics.instruments import Instrument, Quantity
from biogrip.physics.modes import lagged_torques
from biogrip.physics.protocol import TorqueHistory, torque_at
from biogrip.physics.whitening import estimate_noise
from biogrip.traces.any_response import extreme_responses, left_over
from biogrip.traces.columns import TIME_UNITS, Columns, place, unit_of
from biogrip.traces.onset import begins_constant, estimate_onset
from biogrip.traces.reader import FEWEST_SAMPLES, Recording

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
# Multiple of the free rotation that neither noise nor a wrong unit explains.
_ABSURD = 1e9
# Ratio of scatter from which a part of a trace looks like none.
_UNEVEN = 10.0
# Number of samples processed at once.
_AT_ONCE = 65_536


@dataclass(frozen=True)
class _Functions:
    """Functions of time, projected to short vectors that have the same inner products.

    All tests need only inner products. The functions themselves would take too much memory for
    a million samples.
    """

    lagged: Array
    """Lagged torques, first of the left arm, then of the difference of both, (n_lagged, n_rows)."""
    nuisance: Array
    """Orthonormal nuisance functions of the instrument, (n_functions, n_rows)."""
    constant: Array
    """Constant function of norm 1, (1, n_rows)."""
    trace: Array
    """Measured rotation in rad, (n_rows,)."""
    samples: int
    """Number of samples that the vectors stand for."""


@dataclass(frozen=True)
class _Fit:
    """Fit of a trace by lagged torques."""

    response: Array
    """Fitted part of the trace, without nuisance functions, (n_rows,)."""
    weights: Array
    """Weights of the lagged torques, (n_lagged,)."""
    unknowns: int
    """Number of linearly independent lagged torques."""


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
    recording
        Trace that was read from `path`, its times counted from the start of the protocol.
    gripper, torque
        Gripper and protocol it was recorded with.
    path, columns
        Source of the trace, for messages.
    nuisance : (n_functions, n_samples)
        Orthonormal nuisance functions of the instrument, see `nuisance_basis`.
    instrument
        What is held and read.
    noise_rad
        Standard deviation of the noise, if known; otherwise it is estimated from the residuals
        of the fit.
    typical_rad
        Standard deviation of the noise where it is given in any way.
    onset_s
        Time of the trace's clock at which the protocol starts; readings before it are allowed if
        it is given.

    Returns
    -------
    str or None
        A sentence on a rotation that passes only since the given noise is far smaller.

    Raises
    ------
    BiogripError
        With file, line, column, what was found and allowed, and the unit that would be
        plausible.
    """
    _check_times(recording, gripper, torque, path, columns, onset_s)
    trace, lagged = recording.rotation_rad, lagged_torques(torque, _LAG_SHARES)
    free = free_rotation(gripper, torque)
    largest = float(np.abs(trace).max())
    if largest > _ABSURD * free:
        # Beyond this its square could overflow.
        _check_turn(recording, largest, free, path, columns, None)
    functions = _functions(recording, lagged, nuisance)
    fit = _fit(functions)
    read, controlled = columns.quantity, instrument.controlled.name
    # Only the force of a spring is constant, as long as its deformation is.
    constant, still = instrument.deforms, np.ptp(trace) == 0 and not instrument.deforms
    if still or not _responds(functions, fit, noise_rad, constant=constant):
        raise BiogripError(
            f"{_extent(recording, path)}, column '{columns.reading}': found no response to the "
            f"{controlled}, but {trace.mean():.3g}{_unit(read)} throughout, give or take "
            f"{trace.std():.2g}{_unit(read)}; allowed is a {read.name} from zero that follows the "
            f"{controlled} and stands out of the noise."
            f"{_hint_on_part(recording, columns)}"
        )
    if _mirrored(functions, gripper, noise_rad):
        raise BiogripError(
            f"{_extent(recording, path)}, column '{columns.reading}': found a {read.name} that "
            f"goes against the {controlled}, allowed is {_sign(instrument)}, or if an offset or "
            "drift of the instrument, where it has one, were declared."
        )
    if not instrument.has_jaws:
        return None
    turns = (fit.weights @ lagged(recording.time_s[some]) for some in parts(len(trace), _AT_ONCE))
    turn = max(float(np.abs(part).max()) for part in turns)
    return _check_turn(recording, turn, free, path, columns, typical_rad)


def _hint_on_part(recording: Recording, columns: Columns) -> str:
    """Return a hint if the readings scatter far more in the first than in the last tenth."""
    few = max(FEWEST_SAMPLES, len(recording.time_s) // 10)
    tenths = recording.rotation_rad[:few], recording.rotation_rad[-few:]
    early, late = map(estimate_noise, tenths)
    if max(early, late) < _UNEVEN * min(early, late):
        return ""
    where, how = ("first", "from") if early > late else ("last", "until")
    said = f"--{how}" if columns.by_options else f"{how}_s under measurement"
    return f" The {where} readings scatter far more than the others: {said} leaves them out."


def _unit(quantity: Quantity) -> str:
    return f" {quantity.unit}".rstrip()


def _sign(instrument: Instrument) -> str:
    if instrument.has_jaws:
        return (
            "the closing rotation, positive where the arm closes. It would fit if it were -1 times "
            "(is opening counted as positive? Then scale it by -1)"
        )
    return "one of the same sign. It would fit if it were -1 times (then scale it by -1)"


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
    recording: Recording,
    gripper: Gripper,
    torque: TorqueHistory,
    path: Path,
    columns: Columns,
    onset_s: float | None,
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
    unit = unit_of(path, columns.time, columns.time_unit, TIME_UNITS, "time_unit")
    hint = _other_units(unit, TIME_UNITS, fits)
    for sample in np.flatnonzero((time_s < earliest) | (time_s > end_s + slack))[:1]:
        if not hint and onset_s is None:
            hint = _hint_on_start(recording, gripper, torque, columns)
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


def _hint_on_start(
    recording: Recording, gripper: Gripper, torque: TorqueHistory, columns: Columns
) -> str:
    """Return a hint on the option that says when a clock's protocol starts, with an estimate."""
    time_s, rotation_rad = recording.time_s, recording.rotation_rad
    onset_s = estimate_onset(time_s, rotation_rad, gripper, torque, offset=True, drift=False)
    moves = begins_constant(time_s, rotation_rad, onset_s)
    still = f" The trace moves only from {onset_s:.4g} s on." if moves else ""
    how = "--start" if columns.by_options else "start_s under measurement"
    return f"{still} If the protocol starts at another time of the clock than 0, {how} says when."


def _functions(
    recording: Recording, lagged: Callable[[Array], Array], nuisance: Array
) -> _Functions:
    samples = len(recording.time_s)
    constant = np.full(samples, samples**-0.5)
    rows: Array | None = None
    for some in parts(samples, _AT_ONCE):
        own = lagged(recording.time_s[some])
        columns = np.vstack((own, nuisance[:, some], constant[some], recording.rotation_rad[some]))
        below = columns.T if rows is None else np.vstack((rows, columns.T))
        rows = np.asarray(np.linalg.qr(below, mode="r"))
    assert rows is not None
    lags, others = np.split(rows.T, [len(own)])
    return _Functions(lags, others[:-2], others[-2:-1], others[-1], samples)


def _cleared(basis: Array, functions: Array) -> Array:
    """Project functions out of a basis, setting those to zero that lie in its span.

    Otherwise the rounding error of a fully relaxed lag, which an offset spans, would count as
    an independent function.
    """
    rest = without(basis, functions)
    left, whole = np.linalg.norm(rest, axis=1), np.linalg.norm(functions, axis=1)
    return np.where(left[:, None] > _ROUNDING * whole[:, None], rest, 0.0)


def _fit(functions: _Functions) -> _Fit:
    nuisance = functions.nuisance
    basis, trace = _cleared(nuisance, functions.lagged), without(nuisance, functions.trace)
    found, _, rank, _ = np.linalg.lstsq(basis.T, trace, _ROUNDING)
    weights: Array = np.asarray(found, np.float64)
    return _Fit(weights @ basis, weights, int(rank))


def _responds(functions: _Functions, fit: _Fit, noise_rad: float | None, *, constant: bool) -> bool:
    """Return True if the trace follows the torque.

    It does not if a constant describes it better, or if white noise about zero would have as
    large a fit by an F test (chi-squared test with known noise).
    """
    from scipy.special import chdtri, fdtri

    trace = without(functions.nuisance, functions.trace)
    explained = np.sum(fit.response**2)
    rest = np.sum((trace - fit.response) ** 2)
    if not constant and np.sum(without(functions.constant, trace) ** 2) <= rest:
        return False
    if noise_rad is not None:
        return bool(explained > noise_rad**2 * chdtri(fit.unknowns, FALSE_ALARM))
    freedom = functions.samples - fit.unknowns
    ratio = fdtri(fit.unknowns, freedom, 1 - FALSE_ALARM)
    return bool(explained / fit.unknowns > ratio * rest / freedom)


def _mirrored(functions: _Functions, gripper: Gripper, noise_rad: float | None) -> bool:
    """Return True if the mirrored trace is far more likely to be a response.

    It must be so also with a constant fitted along: an undeclared offset is not a wrong
    sign.
    """
    nuisance, trace = functions.nuisance, functions.trace
    rest = without(nuisance, functions.constant)
    norm = np.linalg.norm(rest)
    also = np.vstack((nuisance, rest / norm)) if norm > _NO_CONSTANT else nuisance
    responses = extreme_responses(functions.lagged, gripper, len(_LAG_SHARES))
    declared, freed = (
        [left_over(without(basis, trace), sign * _cleared(basis, responses)) for sign in (1, -1)]
        for basis in (nuisance, also)
    )
    if noise_rad is not None:
        likelier = declared[0] - declared[1] > _FAR_LIKELIER * noise_rad**2
    else:
        likelier = declared[0] > declared[1] * math.exp(_FAR_LIKELIER / functions.samples)
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
    allowed = columns.quantity.units
    unit = unit_of(path, columns.reading, columns.reading_unit, allowed, columns.unit_key)
    hint = _other_units(unit, allowed, fits)
    if noise_rad is not None and _FAR_ABOVE * noise_rad < turn < smallest:
        return (
            f"The largest rotation is {turn:.3g} rad, where without any sample the arm turns by "
            f"{free:.3g} rad: the sample is very stiff, or the unit is not the right one.{hint}"
        )
    limit = (
        f"at most {largest:.3g} rad: without any sample the arm turns by"
        if turn > largest
        else f"at least {smallest:.3g} rad, or less with a given noise (--noise) {_FAR_ABOVE:g} "
        "times smaller still, where without any sample the arm turns by"
    )
    sample = np.argmax(np.abs(recording.rotation_rad))
    raise BiogripError(
        f"{place(path, recording.lines[sample], columns.reading)}: found "
        f"{recording.rotation_rad[sample]:.3g} rad as the largest rotation, and {turn:.3g} rad as "
        f"the largest with the noise smoothed out; allowed is {limit} {free:.3g} rad."
        f"{hint}"
    )


def _other_units(unit: str, units: Mapping[str, float], fits: Callable[[float], bool]) -> str:
    """Return a hint on units, or else factors, in which the numbers would be plausible."""
    factors = {size / units[unit]: f" (is it in {name}?)" for name, size in units.items()}
    named = [factor for factor in factors if fits(factor)]
    unnamed = [factor for factor in (1e-6, 1e-3, 1e3, 1e6) if fits(factor)]
    which = " or ".join(f"{factor:.4g} times{factors[factor]}" for factor in named)
    which = which or " or ".join(f"{factor:g} times" for factor in unnamed)
    return f" It would fit if it were {which}." if which else ""


def _extent(recording: Recording, path: Path) -> str:
    return f"{place(path)}, lines {recording.lines[0]} to {recording.lines[-1]}"
