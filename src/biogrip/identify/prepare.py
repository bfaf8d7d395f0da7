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
from dataclasses import replace

import numpy as np

import biogrip.levels as levels
from biogrip.arrays import Array
from biogrip.digits import plain
from biogrip.errors import BiogripError
from biogrip.fit.experiment import Experiment
from biogrip.fit.problem import GeneRange
from biogrip.identify.plausibility import check_moduli, check_recording
from biogrip.judging.onset import OnsetFits, begins_constant, estimate_onset
from biogrip.physics.fractional import LONGEST_S, SHORTEST_S
from biogrip.physics.noise import MOST_SAMPLES, drift_is_flow, estimate_noise, measure_rounding
from biogrip.physics.protocol import Course, evaluate, is_held, largest_load
from biogrip.traces.columns import place
from biogrip.traces.reader import Recording

# Largest ratio of trace to noise that widens a range, and a margin, for scales are rough.
_CLEAREST, _MARGIN = 1e5, 10.0
# Smallest and largest exponents of ten of search ranges.
_LEAST_EXPONENT, _MOST_EXPONENT = -16, 18

_FLOWS = {"damper": "c_p", "maxwell": "c", "burgers": "c_s"}


def flow_of(experiment: Experiment) -> str:
    """Name what a sample flows by under a constant load, on and on in a line; nothing if by none.

    Without the spring beside the branches that is the sum of their dampers.
    """
    if experiment.fixed.get("k_p") == 0:
        return " + ".join(p.name for p in experiment.searched.parameters if p.kind == "damping")
    return _FLOWS.get(experiment.model.name, "")


def prepare(recording: Recording, experiment: Experiment) -> tuple[Recording, Experiment]:
    """Return a recording from the protocol's start on, and the experiment with what follows of it.

    A `BiogripError` has file, line and column of what is impossible with instrument and protocol.
    """
    # Imported here, as below: of most traces no load was recorded.
    if experiment.record is not None:
        from biogrip.identify.load_noise import with_its_steps, without_noise

        experiment, recording = with_its_steps(experiment, recording)
    experiment, recording = _with_share(experiment, recording)
    recording = _checked(recording, experiment)
    if experiment.record is not None:
        experiment, recording = without_noise(experiment, recording)
    experiment, recording = _with_zero(experiment, recording)
    if experiment.fit_contact:
        from biogrip.identify.contact import with_contact

        experiment = with_contact(for_trace(experiment, recording), recording)
    experiment = for_trace(experiment, recording)
    if experiment.fit_start and recording.onset_s is not None:
        fits = OnsetFits(experiment, recording.time_s, recording.readings)
        later_s = fits.best(0.0).onset_s
        onset_s = recording.onset_s + later_s
        recording = replace(recording, time_s=recording.time_s - later_s, onset_s=onset_s)
    return recording, experiment


def _with_share(experiment: Experiment, recording: Recording) -> tuple[Experiment, Recording]:
    """Take standard deviations that are a share of each reading for that of the smooth course.

    A reading that is low by chance would weigh more, and all of them be too low by twice the square
    of the share.
    """
    if recording.sd is None or not np.all(recording.readings):
        return experiment, recording
    shares = recording.sd / np.abs(recording.readings)
    share = float(np.median(shares))
    if np.any(np.abs(shares - share) > levels.SAME_SHARE * share):
        return experiment, recording
    said = (
        f"Standard deviations are {plain(100 * share, 2)} % of each reading. Taken is that share "
        "of the smooth course: a reading that is low by chance would weigh too much."
    )
    recording = replace(recording, sd=None, remarks_before=(*recording.remarks_before, said))
    return replace(experiment, noise_share=share), recording


def _with_zero(experiment: Experiment, recording: Recording) -> tuple[Experiment, Recording]:
    """Fit an offset along where rows before the load tell it, and say so.

    With the rows in the trace, limits allow for what they leave uncertain of the zero.
    """
    told = experiment.offset or "offset" not in experiment.undeclared
    if told or experiment.simulated or experiment.instrument.sweeps:
        return experiment, recording
    begins_s = 0.0
    if experiment.record is not None:
        loads = np.abs(evaluate(experiment.torque, experiment.record[:, 0]))
        begins_s = float(experiment.record[np.argmax(loads > levels.NO_LOAD * loads.max()), 0])
    if not begins_constant(recording.time_s, recording.readings, begins_s):
        return experiment, recording
    before = recording.readings[recording.time_s < begins_s][:-1]
    read, unit = recording.read.instrument.read, recording.units[1]
    zero = f"{plain(read.in_unit(float(np.mean(before)), unit))} {unit}".removesuffix(" 1")
    rows = f"{len(before)} rows before the {experiment.instrument.controlled.name}"
    said = (*recording.remarks_before, f"Zero from {rows}: {zero}, taken off.")
    recording = replace(recording, remarks_before=said)
    return replace(experiment, offset=True), recording


def for_trace(experiment: Experiment, recording: Recording) -> Experiment:
    """Return the experiment with what follows from a recording: see `prepare`."""
    if experiment.coloured:
        experiment = _without_likenesses(experiment, recording.time_s)
    known, correlation = recording.sd_known, recording.correlation
    experiment = experiment.weighted(recording.sd, known=known, correlation=correlation)
    ranges = ranges_of(experiment, recording.time_s, recording.readings)
    found = {name: it for name, it in ranges.items() if name not in experiment.given_ranges}
    return replace(experiment, ranges={**experiment.ranges, **found})


def _checked(trace: Recording, experiment: Experiment) -> Recording:
    """Return a recording with its times from the protocol's start on; refuse an impossible one."""
    # An offset or a drift that comes with a noise model does not make a trace more plausible.
    experiment = replace(
        experiment,
        offset=experiment.offset and "offset" not in experiment.undeclared,
        drift=experiment.drift and "drift" not in experiment.undeclared,
    )
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
    share = experiment.noise_share
    if experiment.instrument.sweeps:
        shortest_s, longest_s = experiment.torque.spread_s(trace.time_s)
        if experiment.model.power_law and (shortest_s < SHORTEST_S or longest_s > LONGEST_S):
            raise BiogripError(
                f"{place(trace.path)}: found {1 / longest_s:.3g} to {1 / shortest_s:.3g} rad/s, "
                f"allowed with {experiment.model.name} are {1 / LONGEST_S:g} to {1 / SHORTEST_S:g}."
            )
        return _with_deviations(trace, experiment)
    zeroed, _ = _with_zero(experiment, trace)
    if suspicion := check_recording(trace, zeroed, _noise(trace, experiment)):
        trace = replace(trace, remarks_before=(*trace.remarks_before, suspicion))
    if share is None:
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
    return replace(trace.part(~at), at_steps=tuple(times.tolist()))


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


def _noise(trace: Recording, experiment: Experiment) -> float | None:
    """Return the standard deviation of the noise, if it is given; typical where it differs."""
    if trace.sd is not None:
        return float(np.median(trace.sd))
    if experiment.noise_share is not None:
        largest = float(np.max(np.abs(trace.readings)))
        return math.hypot(experiment.noise_share * largest, experiment.noise_sd or 0.0)
    return experiment.noise_sd


def _without_likenesses(experiment: Experiment, time_s: Array) -> Experiment:
    """Return an experiment without an undeclared offset or drift that its sample looks like."""
    network = experiment.searched.network([experiment.searched.example])
    deforms = experiment.instrument.deforms
    own = network.k_p[0] > 0 if deforms else network.c_p[0] == 0
    if "offset" in experiment.undeclared and own and is_held(experiment.torque, time_s):
        experiment = replace(experiment, offset=False)
    flows = bool(flow_of(experiment)) and drift_is_flow(experiment.torque, time_s)
    if "drift" in experiment.undeclared and flows:
        experiment = replace(experiment, drift=False)
    return experiment


def ranges_of(experiment: Experiment, time_s: Array, readings: Array) -> dict[str, GeneRange]:
    """Compute search ranges of springs and dampers from the scales of a trace, (n_samples,).

    The experiment has the noise, if it is known. Ranges are by name.
    """
    changed = readings - np.mean(readings) if experiment.offset else readings
    noise_sd = experiment.sd
    if noise_sd is None:
        one = experiment.noise_sd or estimate_noise(readings)
        noise_sd = np.full(len(changed), one)
    largest = float(np.max(np.abs(changed)))
    ratios = np.linalg.norm([changed / noise_sd, largest / noise_sd], axis=1)
    softer, stiffer = _MARGIN * np.clip(ratios, 1.0, _CLEAREST)
    load = abs(largest_load(experiment.phases))
    stiffness = load / (experiment.gripper.lever_m**2 * largest)
    if experiment.instrument.deforms:
        stiffness = largest / load
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
