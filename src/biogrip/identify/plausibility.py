"""Plausibility of a recorded trace: what a wrong unit, sign or protocol would show.

The trace is fitted by what the gripper's arm may do with any sample that relaxes by three times: a
negligible one, a tenth of the protocol, and ten protocols. They are too few to identify a sample,
but enough to find its response under noise. The peak of the readings would be a peak of the noise.
"""

import math
from collections.abc import Callable, Mapping
from operator import itemgetter

import numpy as np
from scipy.special import fdtri, ndtri

import biogrip.levels as levels
from biogrip.arrays import Array
from biogrip.digits import plain
from biogrip.errors import BiogripError
from biogrip.fit.any_sample import fit_responses
from biogrip.fit.experiment import Experiment
from biogrip.physics.modes import lag_course
from biogrip.physics.noise import nuisance_basis, without
from biogrip.physics.protocol import SWEEP, Course, largest_load
from biogrip.traces.columns import TIME_UNITS, place
from biogrip.traces.reader import Recording

# Relative tolerance, since times are written with few digits.
_TIME_SLACK = 1e-5
_LAG_SHARES = (1e-9, 0.03, 0.1, 0.3, 1.0, 10.0)
# Log-likelihood ratio, times two, above which a trace counts as mirrored.
_FAR_LIKELIER = -2 * math.log(levels.NO_RESPONSE)
# Share of a function's norm that may be rounding error.
_ROUNDING = 1e-9
# What makes a loss modulus negative, and a storage modulus.
_NEGATIVE = (
    "The sample would give energy instead of losing it: the phase has the wrong sign or an offset",
    "The phase is beyond 90 degrees, as where inertia outweighs the sample at high frequencies",
)
# Multiple of the free rotation beyond which its square could overflow.
_ABSURD = 1e9


def check_recording(
    recording: Recording,
    experiment: Experiment,
    noise_sd: float | None = None,
) -> str | None:
    """Refuse a trace that is impossible with the instrument and protocol.

    Checked in this order: times outside the protocol, or covering too little of it; no response
    to the torque, by an F test; a response of the wrong sign; a rotation above the free gripper's,
    or so small that the sample would be hundreds of times stiffer than the hinges, so that the
    trace shows only errors of the instrument. A trace in a wrong unit fails one of these checks.
    Without arms, nothing limits a reading.

    The times of the recording count from the start of the protocol; if that is known, readings
    before it are allowed. If the typical standard deviation of the noise is given, a small rotation
    passes if that is far smaller still, and the sentence on it is returned. A `BiogripError` has
    file, line, column, what was found and allowed, and a unit that would be plausible.
    """
    torque, instrument = experiment.torque, experiment.instrument
    _check_times(recording, torque)
    _check_contact(recording)
    time_s, trace = recording.time_s, recording.readings
    # Of any sample the largest static rotation: phi_2 = (1 - x) tau/k_2, where x goes from 0
    # without a sample to 1 with a rigid one.
    free = abs(largest_load(experiment.phases)) / experiment.gripper.left.stiffness_Nm_per_rad
    largest = float(np.abs(trace).max())
    if largest > _ABSURD * free:
        return _check_turn(recording, largest, free, None)
    responses = lag_course(torque, _LAG_SHARES, time_s)
    nuisance = experiment.nuisance(time_s)
    either = (amplitudes, rest), (_, mirrored) = _either_sign(trace, responses, nuisance)
    where = recording.extent(recording.read.reading_column)
    read, controlled = recording.read.instrument.read, instrument.controlled.name
    combined, least = min(either, key=itemgetter(1))
    used = int(np.count_nonzero(combined))
    is_constant = not instrument.deforms and len(trace) * np.var(trace) <= least
    # Without any scatter nothing tells noise from sample.
    counts = len(responses), len(trace) - used
    if is_constant or np.ptp(trace) == 0 or not _responds(trace, nuisance, least, *counts):
        unit, off = f" {read.unit}".rstrip(), np.abs(trace - np.median(trace))
        usual = levels.NO_READING * np.quantile(off, 0.9)
        if 0 < usual < np.max(off):
            sample = int(np.argmax(off > usual))
            there = recording.place(sample, recording.read.reading_column)
            raise BiogripError(
                f"{there}: found {trace[sample]:.6g}{unit}, far from nearly all others, and no "
                f"response to the {controlled} beside it; allowed are readings. What is none has "
                "no number in its cell."
            )
        raise BiogripError(
            f"{where}: found no response to the {controlled}, but {plain(trace.mean())}{unit} "
            f"throughout, give or take {plain(trace.std(), 2)}{unit}; allowed is a {read.name} "
            f"from zero that follows the {controlled} and stands out of the noise."
        )
    # An undeclared offset may look like the wrong sign.
    also = nuisance_basis(time_s, offset=True, drift=experiment.drift)
    (_, beside), (_, mirrored_beside) = _either_sign(trace, responses, also)
    likelier = rest > mirrored * math.exp(_FAR_LIKELIER / len(trace))
    if likelier and beside > mirrored_beside:
        sign = "one of the same sign"
        if instrument.has_jaws:
            sign = "the closing rotation, positive where the arm closes"
        raise BiogripError(
            f"{where}: found a {read.name} that goes against the {controlled}, allowed is {sign}. "
            f"It would fit if it were -1 times (then say {recording.read.said_by('scale')}), or if "
            "an offset or drift of the instrument, where it has one, were declared."
        )
    if not instrument.has_jaws:
        return None
    turn = float(np.abs(amplitudes @ responses).max())
    return _check_turn(recording, turn, free, noise_sd)


def check_moduli(sweep: Recording, sd: Array | float) -> None:
    """Refuse a sweep with a modulus further below zero than noise takes that of a sample.

    The noise has standard deviations `sd`, (n_samples,), 0 where nothing says it.
    """
    least = np.broadcast_to(sd * ndtri(levels.BELOW_ZERO), sweep.readings.shape)
    for sample in np.flatnonzero(sweep.readings <= least)[:1]:
        at, found = float(sweep.time_s[sample]), sweep.readings[sample]
        above = f"{plain(least[sample], 2)} by the noise that is given" if least[sample] else "0"
        raise BiogripError(
            f"{place(sweep.path, int(sweep.lines[sample]))}: found a modulus of {found:.3g}, at "
            f"{SWEEP.place(at)}; allowed is one above {above}. {_NEGATIVE[at > 0]}, or it is below "
            "the noise: say how much that is (--noise), or leave these rows out (--from, --until)."
        )


def _either_sign(trace: Array, responses: Array, nuisance: Array) -> list[tuple[Array, float]]:
    """Return amplitudes of a trace and of its mirror image, and what they leave of either."""
    cleared, whole = without(nuisance, responses), np.linalg.norm(responses, axis=1)
    # Of those in the span of the nuisance only rounding errors are left.
    cleared[np.linalg.norm(cleared, axis=1) <= _ROUNDING * whole] = 0.0
    return [fit_responses(sign * without(nuisance, trace), cleared) for sign in (1, -1)]


def _responds(trace: Array, nuisance: Array, rest: float, unknowns: int, freedom: int) -> bool:
    """Return True if responses explain more than they would of white noise, by an F test."""
    explained = float(np.sum(without(nuisance, trace) ** 2)) - rest
    needed = fdtri(unknowns, freedom, 1 - levels.NO_RESPONSE)
    return bool(explained > unknowns * needed * rest / freedom)


def _check_times(recording: Recording, torque: Course) -> None:
    columns, end_s, slack = recording.read, torque.end_s, _TIME_SLACK * torque.end_s
    onset_s = recording.onset_s
    begins = onset_s or 0.0
    time_s, earliest = recording.time_s, -slack if onset_s is None else -np.inf
    clock_s = time_s + begins
    shortest = levels.SHORTEST_SHARE * end_s

    def fits(factor: float) -> bool:
        first, last = factor * clock_s[[0, -1]] - begins
        return bool(first >= earliest and shortest + max(first, 0) <= last <= end_s + slack)

    if fits(1.0):
        return
    hint = _other_units(recording.units[0], TIME_UNITS, fits)
    if not hint and onset_s is None:
        how = "--start says when, be it 0, or --start fit finds it"
        hint = f" If the protocol starts after readings, or not at 0 of the clock, {how}."
    for sample in np.flatnonzero((time_s < earliest) | (time_s > end_s + slack))[:1]:
        raise BiogripError(
            f"{recording.place(sample, columns.axis_column)}: found "
            f"{clock_s[sample]:.12g} s, allowed is the protocol's time, {begins:g} to "
            f"{begins + end_s:g} s.{hint}"
        )
    raise BiogripError(
        f"{recording.extent(columns.axis_column)}: found only {clock_s[0]:g} to "
        f"{clock_s[-1]:g} s of the protocol's {end_s:g} s, allowed are at least {shortest:g} s of "
        f"it.{hint}"
    )


def _check_contact(recording: Recording) -> None:
    """Refuse a tip that reads most where its load, before the contact, counts as zero."""
    load, columns = recording.load, recording.read
    if load is None or not columns.has_tip:
        return
    at = int(np.argmax(np.abs(recording.readings)))
    there_s = float(recording.time_s[at]) + (recording.onset_s or 0.0)
    if np.interp(there_s, *load.T) <= 0 < np.max(load[:, 1]):
        raise BiogripError(
            f"{recording.place(at, columns.reading_column)}: found the largest reading where the "
            f"column '{columns.load}' is not above zero, as of a separation that is negative in "
            f"contact; allowed is a depth or a force of a tip in contact: turn it by "
            f"{columns.said_by('load_scale')}."
        )


def _check_turn(
    recording: Recording, turn: float, free: float, noise_sd: float | None
) -> str | None:
    columns = recording.read
    smallest, largest = levels.SMALLEST_SHARE * free, levels.LARGEST_SHARE * free

    def fits(factor: float) -> bool:
        return smallest <= factor * turn <= largest

    if fits(1.0):
        return None
    hint = _other_units(recording.units[1], columns.instrument.read.units, fits)
    alone = f"without any sample the arm turns by {free:.3g} rad"
    if noise_sd is not None and levels.FAR_ABOVE * noise_sd < turn < smallest:
        return (
            f"The largest rotation is {turn:.3g} rad, where {alone}: the sample is very stiff, or "
            f"the unit is not the right one.{hint}"
        )
    limit = f"at most {largest:.3g} rad: {alone}"
    if turn < smallest:
        limit = (
            f"at least {smallest:.3g} rad, or less with a given noise (--noise) "
            f"{levels.FAR_ABOVE:g} times smaller still, where {alone}"
        )
    sample = int(np.argmax(np.abs(recording.readings)))
    raise BiogripError(
        f"{recording.place(sample, columns.reading_column)}: found "
        f"{recording.readings[sample]:.3g} rad as the largest rotation, and {turn:.3g} rad as "
        f"the largest with the noise smoothed out; allowed is {limit}.{hint}"
    )


def _other_units(unit: str, units: Mapping[str, float], fits: Callable[[float], bool]) -> str:
    """Return a hint on units, or else factors, in which the numbers would be plausible."""
    named = [(size / units[unit], name) for name, size in units.items()]
    found = [f"{factor:.4g} times (is it in {name}?)" for factor, name in named if fits(factor)]
    found = found or [f"{factor:g} times" for factor in (1e-6, 1e-3, 1e3, 1e6) if fits(factor)]
    return f" It would fit if it were {' or '.join(found)}." if found else ""
