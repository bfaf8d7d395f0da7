"""What a recording and an experiment are to each other before they are fitted.

`prepare` moves the recording's clock to the start of the protocol, leaves out readings that nothing
can tell of, refuses an impossible trace, and gives the experiment what follows from the trace:
standard deviations of the readings, and search ranges.

Torque over rotation is the scale of stiffness at the jaws, and load over deformation that of other
instruments. A spring changes the trace by less than its noise if it is softer by more than the
ratio of the trace to the noise, over all readings, or if it yields by less than what all readings
together resolve. A damper is as stiff as c/t after a time t, which is between the shortest sampling
interval and the duration; so is a springpot, with a power of t.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from operator import itemgetter

import numpy as np
from scipy.special import fdtri, ndtri

import biogrip.levels as levels
from biogrip.arrays import Array
from biogrip.digits import plain
from biogrip.errors import BiogripError
from biogrip.fit.any_sample import fit_responses
from biogrip.fit.experiment import Experiment
from biogrip.fit.problem import GeneRange
from biogrip.judging.onset import OnsetFits, begins_constant, estimate_onset, unsaid_end
from biogrip.physics.fractional import LONGEST_S, SHORTEST_S
from biogrip.physics.modes import lag_course
from biogrip.physics.noise import (
    MOST_SAMPLES,
    drift_is_flow,
    estimate_noise,
    measure_rounding,
    nuisance_basis,
    without,
)
from biogrip.physics.protocol import SWEEP, Course, evaluate, is_held, largest_load
from biogrip.traces.columns import TIME_UNITS, place
from biogrip.traces.reader import Recording

Trace = tuple[Recording, Experiment]
"""A recording and the experiment that it is of, as `prepare` returns them."""

# Largest ratio of trace to noise that widens a range, and a margin, for scales are rough.
_CLEAREST, _MARGIN = 1e5, 10.0
# Smallest and largest exponents of ten of search ranges.
_LEAST_EXPONENT, _MOST_EXPONENT = -16, 18

_FLOWS = {"damper": "c_p", "maxwell": "c", "burgers": "c_s"}

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


def flow_of(experiment: Experiment) -> str:
    """Name what a sample flows by under a constant load, on and on in a line; nothing if by none.

    Without the spring beside the branches that is the sum of their dampers.
    """
    if experiment.fixed.get("k_p") == 0:
        return " + ".join(p.name for p in experiment.searched.parameters if p.kind == "damping")
    return _FLOWS.get(experiment.model.name, "")


def prepare(recording: Recording, experiment: Experiment) -> Trace:
    """Return a recording from the protocol's start on, and the experiment with what follows of it.

    A `BiogripError` has file, line and column of what is impossible with instrument and protocol.
    """
    # Imported here, as below: of most traces no load was recorded.
    if experiment.record is not None:
        from biogrip.identify.recorded_load import with_its_steps, without_noise

        recording, experiment = with_its_steps(recording, experiment)
    recording, experiment = _with_share(recording, experiment)
    recording = _checked(recording, experiment)
    if experiment.record is not None:
        recording, experiment = without_noise(recording, experiment)
    recording, experiment = _with_zero(recording, experiment)
    if experiment.fit_contact:
        from biogrip.identify.recorded_load import with_contact

        experiment = with_contact(for_trace(experiment, recording), recording)
    experiment = for_trace(experiment, recording)
    if experiment.fit_start and recording.onset_s is not None:
        fits = OnsetFits(experiment, recording.time_s, recording.readings)
        later_s = fits.best(0.0).onset_s
        onset_s = recording.onset_s + later_s
        recording = replace(recording, time_s=recording.time_s - later_s, onset_s=onset_s)
    return recording, experiment


def _with_share(recording: Recording, experiment: Experiment) -> Trace:
    """Take standard deviations that are a share of each reading for that of the smooth course.

    A reading that is low by chance would weigh more, and all of them be too low by twice the square
    of the share.
    """
    if recording.sd is None or not np.all(recording.readings):
        return recording, experiment
    shares = recording.sd / np.abs(recording.readings)
    share = float(np.median(shares))
    if np.any(np.abs(shares - share) > levels.SAME_SHARE * share):
        return recording, experiment
    said = (
        f"Standard deviations are {plain(100 * share, 2)} % of each reading. Taken is that share "
        "of the smooth course: a reading that is low by chance would weigh too much."
    )
    recording = replace(recording, sd=None, remarks_before=(*recording.remarks_before, said))
    return recording, replace(experiment, noise_share=share)


def _with_zero(recording: Recording, experiment: Experiment) -> Trace:
    """Fit an offset along where rows before the load tell it, and say so.

    With the rows in the trace, limits allow for what they leave uncertain of the zero.
    """
    known = experiment.offset or "offset" not in experiment.undeclared
    if known or experiment.simulated or experiment.instrument.sweeps:
        return recording, experiment
    begins_s = 0.0
    if experiment.record is not None:
        loads = np.abs(evaluate(experiment.torque, experiment.record[:, 0]))
        begins_s = float(experiment.record[np.argmax(loads > levels.NO_LOAD * loads.max()), 0])
    if not begins_constant(recording.time_s, recording.readings, begins_s):
        return recording, experiment
    before = recording.readings[recording.time_s < begins_s][:-1]
    read, unit = recording.read.instrument.read, recording.units[1]
    zero = f"{plain(read.in_unit(float(np.mean(before)), unit))} {unit}".removesuffix(" 1")
    rows = f"{len(before)} rows before the {experiment.instrument.controlled.name}"
    said = (*recording.remarks_before, f"Zero from {rows}: {zero}, taken off.")
    recording = replace(recording, remarks_before=said)
    return recording, replace(experiment, offset=True)


def for_trace(experiment: Experiment, recording: Recording) -> Experiment:
    """Return the experiment with what follows from a recording: see `prepare`."""
    if experiment.coloured:
        experiment = _without_likenesses(experiment, recording.time_s)
    known, correlation = recording.sd_known, recording.correlation
    experiment = experiment.weighted(recording.sd, known=known, correlation=correlation)
    ranges = ranges_of(experiment, recording.time_s, recording.readings)
    ranges = {name: genes for name, genes in ranges.items() if name not in experiment.given_ranges}
    return replace(experiment, ranges={**experiment.ranges, **ranges})


def _checked(trace: Recording, experiment: Experiment) -> Recording:
    """Return a recording with its times from the protocol's start on; refuse an impossible one."""
    # An offset or a drift that comes with a noise model does not make a trace more plausible.
    experiment = experiment.without_terms(experiment.undeclared)
    weighted = trace.sd is not None or experiment.noise_share is not None
    if (experiment.coloured or weighted) and len(trace.time_s) > MOST_SAMPLES:
        raise BiogripError(
            f"{place(trace.path)}: found {len(trace.time_s)} samples, allowed are at most "
            f"{MOST_SAMPLES} with {'weights' if weighted else 'a coloured noise model'}: average "
            "neighbouring ones."
        )
    if not experiment.instrument.sweeps:
        trace = without_repeats(trace)
    onset_s = trace.read.start_s
    if experiment.fit_start:
        onset_s = estimate_onset(experiment, trace.time_s, trace.readings)
    if onset_s is not None:
        trace = without_padding(replace(trace, time_s=trace.time_s - onset_s, onset_s=onset_s))
    # What a gripper reads does not jump: dampers hold its arms.
    if not experiment.instrument.has_jaws:
        trace = without_steps(trace, experiment.torque)
    if len(trace.time_s) <= experiment.unknowns:
        raise BiogripError(
            f"{place(trace.path)}: found {len(trace.time_s)} readings for {experiment.unknowns} "
            "unknown parameters; allowed are more readings than parameters, or a simpler model."
        )
    if experiment.instrument.sweeps:
        shortest_s, longest_s = experiment.torque.spread_s(trace.time_s)
        if experiment.model.power_law and (shortest_s < SHORTEST_S or longest_s > LONGEST_S):
            raise BiogripError(
                f"{place(trace.path)}: found {1 / longest_s:.3g} to {1 / shortest_s:.3g} rad/s, "
                f"allowed with {experiment.model.name} are {1 / LONGEST_S:g} to {1 / SHORTEST_S:g}."
            )
        return _with_deviations(trace, experiment)
    _, zeroed = _with_zero(trace, experiment)
    if suspicion := check_recording(trace, zeroed):
        trace = replace(trace, remarks_before=(*trace.remarks_before, suspicion))
    if experiment.noise_share is None:
        return trace
    from biogrip.fit.share_noise import proportional_deviations

    return replace(trace, sd=proportional_deviations(experiment, trace.time_s, trace.readings))


def _with_deviations(sweep: Recording, experiment: Experiment) -> Recording:
    """Return a sweep with standard deviations of its readings, or of their ratios."""
    share, noise_sd = experiment.noise_share, experiment.noise_sd
    if (known := noise_sd if sweep.sd is None and share is None else sweep.sd) is not None:
        check_moduli(sweep, known)
        return sweep
    from biogrip.fit.share_noise import estimate_swept_noise

    sizes = [size for size in (share, sweep.read.phase_sd_rad) if size is not None]
    noise = estimate_swept_noise(sweep.time_s, sweep.readings, sizes or None, noise_sd or 0.0)
    check_moduli(sweep, noise.sd)
    sweep = replace(sweep, sd=noise.sd, correlation=noise.correlation)
    if share is not None:
        return sweep
    how = f"as they scatter from one frequency to the next: by {noise.words}"
    said = (*sweep.remarks_before, f"Readings are weighted {how}.")
    return replace(sweep, sd_known=False, remarks_before=said)


def without_steps(trace: Recording, protocol: Course) -> Recording:
    """Leave out readings at the very instant of a step.

    Without inertia a sample may jump there, and nothing tells on which side a reading was taken. A
    damper's force jumps with the rate of a deformation, too.
    """
    at = np.isin(protocol.snapped(trace.time_s), protocol.jumps_s)
    times = trace.time_s[at] + (trace.onset_s or 0.0)
    left_out = zip(times.tolist(), trace.readings[at].tolist(), strict=True)
    return replace(trace.part(~at), at_steps=tuple(left_out))


def without_repeats(trace: Recording) -> Recording:
    """Keep one of each reading of a sensor that is read less often than it is logged.

    Rounded readings repeat, too, but change by one step; a sensor may stand still for long.
    """
    changes = np.diff(trace.readings)
    kept = np.append(True, changes != 0)
    at_ends = np.abs(changes[1:][~kept[1:-1] & kept[2:]])
    runs = np.diff(np.append(np.flatnonzero(kept), len(kept)))
    held = np.mean(~kept) > levels.REPEATED and np.max(runs) <= levels.ALIKE * np.median(runs)
    step = levels.ONE_STEP * measure_rounding(trace.readings)
    if not (held and len(at_ends) and np.median(at_ends) > step):
        return trace
    said = (
        "Left out, for they repeat the one before, as of a sensor that is read less often than it "
        f"is logged: {np.count_nonzero(~kept)} of {len(kept)} readings."
    )
    return replace(trace.part(kept), remarks_before=(*trace.remarks_before, said))


def without_padding(trace: Recording) -> Recording:
    """Leave out the same number again and again before the protocol, which is no measurement.

    The last of them stays: it tells that the protocol had not yet started.
    """
    differs = np.flatnonzero(trace.readings != trace.readings[0])
    first = max(min([*differs[:1], np.count_nonzero(trace.time_s < 0)]) - 1, 0)
    kept = np.arange(len(trace.time_s)) >= first
    return replace(trace.part(kept), gaps=trace.gaps + first)


def _without_likenesses(experiment: Experiment, time_s: Array) -> Experiment:
    """Return an experiment without an undeclared offset or drift that its sample looks like."""
    network, torque = experiment.searched.network([experiment.searched.example]), experiment.torque
    at_once = network.k_p[0] > 0 if torque.deforms else network.c_p[0] == 0
    alike = {
        "offset": at_once and is_held(torque, time_s),
        "drift": bool(flow_of(experiment)) and drift_is_flow(torque, time_s),
    }
    return experiment.without_terms([term for term in experiment.undeclared if alike[term]])


def ranges_of(experiment: Experiment, time_s: Array, readings: Array) -> dict[str, GeneRange]:
    """Compute search ranges of springs and dampers from the scales of a trace, (n_samples,).

    The experiment has the noise, if it is known. Ranges are by name.
    """
    changed = readings - np.mean(readings) if experiment.offset else readings
    noise_sd = experiment.sd
    if noise_sd is None:
        noise_sd = np.full(len(changed), experiment.noise_sd or estimate_noise(readings))
    largest = float(np.max(np.abs(changed)))
    ratios = np.linalg.norm([changed / noise_sd, largest / noise_sd], axis=1)
    softer, stiffer = _MARGIN * np.clip(ratios, 1.0, _CLEAREST)
    load = abs(largest_load(experiment.phases))
    of_lever = load / (experiment.gripper.lever_m**2 * largest)
    stiffness = largest / load if experiment.instrument.deforms else of_lever
    low, high = stiffness / softer, stiffness * stiffer
    short_s, long_s = experiment.torque.spread_s(time_s)
    dampers = _decades(low * short_s, high * long_s)
    springpots = _decades(low * min(short_s, 1.0), high * max(long_s, 1.0))
    # A springpot with the exponent 0.01 is no spring: it changes by 11 % in five decades.
    springs, exponents = _decades(low, high), GeneRange((-3, 0), (1, 9))
    return {"k": springpots, "k_p": springs, "c": dampers, "c_p": dampers, "alpha": exponents}


def _decades(low: float, high: float) -> GeneRange:
    ends = int(np.floor(np.log10(low))), int(np.ceil(np.log10(high)))
    least, most = (min(max(end, _LEAST_EXPONENT), _MOST_EXPONENT) for end in ends)
    return GeneRange((least, most), (1, 9))


def check_recording(recording: Recording, experiment: Experiment) -> str | None:
    """Refuse a trace that is impossible with the instrument and protocol.

    Checked in this order: times outside the protocol, or covering too little of it; no response
    to the torque, by an F test; a response of the wrong sign; a rotation above the free gripper's,
    or so small that the sample would be hundreds of times stiffer than the hinges, so that the
    trace shows only errors of the instrument. A trace in a wrong unit fails one of these checks.
    Without arms, nothing limits a reading.

    The trace is fitted by what the gripper's arm may do with any sample that relaxes by a few
    times: too few to identify a sample, but enough to find its response under noise. The peak of
    the readings would be a peak of the noise.

    The times of the recording count from the start of the protocol; if that is known, readings
    before it are allowed. A small rotation passes if the noise is given and far smaller still, and
    the sentence on it is returned. A `BiogripError` has file, line, column, what was found and
    allowed, and a unit that would be plausible.
    """
    instrument, column = experiment.instrument, recording.read.reading_column
    _check_times(recording, experiment.torque)
    _check_contact(recording)
    time_s, trace = recording.time_s, recording.readings
    # Of any sample the largest static rotation: phi_2 = (1 - x) tau/k_2, where x goes from 0
    # without a sample to 1 with a rigid one.
    free = abs(largest_load(experiment.phases)) / experiment.gripper.left.stiffness_Nm_per_rad
    if (largest := float(np.abs(trace).max())) > _ABSURD * free:
        return _check_turn(recording, largest, free, None)
    responses = lag_course(experiment.torque, _LAG_SHARES, time_s)
    nuisance = experiment.nuisance(time_s)
    either = (amplitudes, rest), (_, mirrored) = _either_sign(trace, responses, nuisance)
    read, controlled = recording.read.instrument.read, instrument.controlled.name
    combined, least = min(either, key=itemgetter(1))
    counts = len(responses), len(trace) - int(np.count_nonzero(combined))
    is_constant = not instrument.deforms and len(trace) * np.var(trace) <= least
    # Without any scatter nothing tells noise from sample.
    if is_constant or np.ptp(trace) == 0 or not _responds(trace, nuisance, least, *counts):
        unit, off = f" {read.unit}".rstrip(), np.abs(trace - np.median(trace))
        usual = levels.NO_READING * np.quantile(off, 0.9)
        if 0 < usual < np.max(off):
            sample = int(np.argmax(off > usual))
            raise BiogripError(
                f"{recording.place(sample, column)}: found {trace[sample]:.6g}{unit}, far from "
                f"nearly all others, and no response to the {controlled} beside it; allowed are "
                "readings. What is none has no number in its cell."
            )
        raise BiogripError(
            f"{recording.extent(column)}: found no response to the {controlled}, but "
            f"{plain(trace.mean())}{unit} throughout, give or take {plain(trace.std(), 2)}{unit}; "
            f"allowed is a {read.name} from zero that follows the {controlled} and stands out of "
            f"the noise.{unsaid_end(recording, experiment)}"
        )
    # An undeclared offset may look like the wrong sign.
    also = nuisance_basis(time_s, offset=True, drift=experiment.drift)
    (_, beside), (_, mirrored_beside) = _either_sign(trace, responses, also)
    likelier = rest > mirrored * math.exp(_FAR_LIKELIER / len(trace))
    if likelier and beside > mirrored_beside:
        closing = "the closing rotation, positive where the arm closes"
        sign = closing if instrument.has_jaws else "one of the same sign"
        raise BiogripError(
            f"{recording.extent(column)}: found a {read.name} that goes against the {controlled}, "
            f"allowed is {sign}. It would fit if it were -1 times (then say "
            f"{recording.read.said_by('scale')}), or if an offset or drift of the instrument, "
            "where it has one, were declared."
        )
    if not instrument.has_jaws:
        return None
    turn = float(np.abs(amplitudes @ responses).max())
    return _check_turn(recording, turn, free, experiment.noise_sd)


def check_moduli(sweep: Recording, sd: Array | float) -> None:
    """Refuse a sweep with a modulus further below zero than noise takes that of a sample.

    The noise has standard deviations `sd`, (n_samples,), 0 where nothing says it.
    """
    least = np.broadcast_to(sd * ndtri(levels.BELOW_ZERO), sweep.readings.shape)
    for sample in np.flatnonzero(sweep.readings <= least)[:1]:
        at, modulus = float(sweep.time_s[sample]), sweep.readings[sample]
        above = f"{plain(least[sample], 2)} by the noise that is given" if least[sample] else "0"
        raise BiogripError(
            f"{place(sweep.path, int(sweep.lines[sample]))}: found a modulus of {modulus:.3g}, at "
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
            f"contact; allowed is a depth or a force of a tip in contact: {columns.deepened}."
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
    factors = [f"{factor:.4g} times (is it in {name}?)" for factor, name in named if fits(factor)]
    factors = factors or [f"{factor:g} times" for factor in (1e-6, 1e-3, 1e3, 1e6) if fits(factor)]
    return f" It would fit if it were {' or '.join(factors)}." if factors else ""
