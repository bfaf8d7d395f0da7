"""Onset of a recorded trace: the time of its clock from which it follows the torque.

`estimate_onset` needs no sample model: the trace is fitted by any sample's possible responses to
the delayed torque, and the delay with the least residual sum of squares is found on ever finer
grids. That needs some hundred small fits; `biogrip.fit.fitted_onset` refines it with the model.

`note_late_onset` tests a trace of which nothing says when its protocol starts: if it begins before
that, or so long after it that the clock may be another's. `note_hidden_ramp` says what a ramp
changes that ends before the first reading.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from scipy.special import chdtri, stdtrit

from biogrip.arrays import Array, BoolArray, IntArray
from biogrip.digits import instant, plain
from biogrip.fit.fitted_onset import OnsetFit, OnsetFits
from biogrip.fit.problem import CaseProblem
from biogrip.judging.diagnosis import Diagnosis
from biogrip.judging.doubts import DOUBT, HARMLESS, REJECTED, REJECTION, Note
from biogrip.judging.likelihood import compute_fall, make_likelihood
from biogrip.judging.onset_profiles import onset_limits
from biogrip.judging.verdicts import DETERMINED
from biogrip.physics.modes import lagged_torques
from biogrip.physics.protocol import Load, Phase
from biogrip.physics.whitening import estimate_noise, nuisance_basis, without
from biogrip.traces.any_sample import extreme_responses, left_over

# Longest relaxation time over the protocol's duration, and how many a decade; the shortest is that
# between the closest readings.
_LONGEST, _A_DECADE = 10.0, 2
# Delays on the first grid; finer ones have as many between the neighbours of the best.
_DELAYS = 65
# Most readings that a fit takes of the whole trace, and as many of what the grid spans.
_MOST_READINGS = 2000
# Least share of the protocol that has to be after the onset.
_LEAST_AFTER = 0.02
# Fewest readings before an onset by which a late one is recognised.
_FEWEST_BEFORE = 3
# Standard deviation of readings that are constant, in noise, and in peaks of noise-free traces.
_CONSTANT, _CONSTANT_OF_PEAK = 2.0, 1e-3
# So that correlated noise does not look like a late onset; and level of other tests.
_FALSE_ALARM, _AS_GOOD = 1e-9, 1e-3
# Intervals from a change to the first reading of a trace that is cut off, fewest readings by which
# their growth is known, and its powers of the time if readings were spaced from the change on.
_DELAYED, _FEWEST_APART, _PLANNED = 10.0, 3, (0.5, 1.5)
# Misfit over the scatter of neighbours that a right fit does not exceed.
_WHITE = 1.5
_SAY_WHEN = (
    "Say when the protocol started (--start, measurement.start_s), be it at 0, or what came before "
    "(--config, protocol)."
)


def estimate_onset(problem: CaseProblem, time_s: Array, rotation_rad: Array) -> float:
    """Estimate from when a trace follows the torque, without a sample model, in s of its clock.

    The trace is (n_samples,), times ascending. One that begins constant may have an offset.
    """
    gripper, torque = problem.gripper, problem.torque
    offset = problem.offset or begins_constant(time_s, rotation_rad)
    shortest = float(np.min(np.diff(time_s)))
    decades = np.log10(_LONGEST * torque.end_s / shortest)
    shares = np.geomspace(shortest / torque.end_s, _LONGEST, 2 + int(_A_DECADE * decades))
    lagged = lagged_torques(torque, shares.tolist())

    def square_sum(onset_s: float, some: BoolArray) -> float:
        nuisance = nuisance_basis(time_s[some], offset=offset, drift=problem.drift)
        own = extreme_responses(lagged(time_s[some] - onset_s), gripper, len(shares))
        return left_over(without(nuisance, rotation_rad[some]), without(nuisance, own))

    low, high = time_s[0], max(time_s[0], time_s[-1] - _LEAST_AFTER * torque.end_s)
    while True:
        onsets = np.linspace(low, high, _DELAYS)
        some = _thinned(len(time_s), np.searchsorted(time_s, [low, high]))
        best = int(np.argmin([square_sum(onset, some) for onset in onsets]))
        low, high = onsets[max(best - 1, 0)], onsets[min(best + 1, _DELAYS - 1)]
        if high - low < shortest:
            return float(onsets[best])


def _thinned(samples: int, within: IntArray) -> BoolArray:
    """Choose readings of the whole trace, and more of those within, (2,) indices."""
    first, last = max(within[0] - 1, 0), min(within[1], samples - 1)
    some = np.zeros(samples, dtype=bool)
    for start, end in ((0, samples - 1), (first, last)):
        some[np.linspace(start, end, _MOST_READINGS).astype(np.int64)] = True
    return some


def note_late_onset(
    case_problem: CaseProblem, time_s: Array, rotation_rad: Array, diagnosis: Diagnosis
) -> list[Note]:
    """Test a trace for another start of its protocol than at 0, of which the user says nothing.

    A trace that begins constant, and fits far better with a later start, tells nothing of the
    sample under the protocol as given, whatever noise model absorbs the misfit: the test is a
    likelihood ratio. One that begins long after its first step, as if cut off there, may have been
    recorded on another clock: then it is fitted with that step just before it.

    Parameters
    ----------
    case_problem
        Assumptions of the identification, with a protocol that starts at 0.
    time_s, rotation_rad : (n_samples,)
        The trace, times ascending.
    diagnosis
        That of the best fit with that protocol.
    """
    if _with_ramp(case_problem, time_s) and is_cut_off(time_s):
        fits = OnsetFits(case_problem, time_s, rotation_rad)
        return list(_about_clock(fits, time_s, diagnosis))
    if not begins_constant(time_s, rotation_rad):
        return []
    # A constant that is not zero is an offset, with which the onset would be biased.
    case_problem = replace(case_problem, offset=True)
    guess_s = estimate_onset(case_problem, time_s, rotation_rad)
    if not begins_constant(time_s, rotation_rad, guess_s):
        return []
    fits = OnsetFits(case_problem, time_s, rotation_rad)
    found, given = fits.best(guess_s), fits.at(0.0, diagnosis.likelihood.best)
    fall = compute_fall(len(time_s), given.misfit_rad, found.misfit_rad, case_problem.noise_rad)
    if not begins_constant(time_s, rotation_rad, found.onset_s) or fall < chdtri(1, _FALSE_ALARM):
        return []
    later_s = time_s - found.onset_s
    posed = case_problem.to_identify().of(later_s, rotation_rad)
    fit = found.log_parameters, found.misfit_rad
    likelihood = make_likelihood(posed, *fit, confidence=diagnosis.likelihood.confidence)
    ends_s = [found.onset_s + end_s for end_s in onset_limits(likelihood, later_s)]
    text = (
        f"The trace is constant until {instant(found.onset_s, *ends_s)} of its clock, and fits far "
        f"better if the protocol starts there (χ² falls by {plain(fall)}). If it does, say --start "
        "fit (measurement.fit_start), which allows for its uncertainty, or when it was, if that is "
        "known (--start, measurement.start_s)."
    )
    return [Note(REJECTION, text)]


def note_tare(
    case_problem: CaseProblem, readings: tuple[Array, Array], diagnosis: Diagnosis, *, late: bool
) -> list[Note]:
    """Say if readings before the protocol are constant and not zero; see `note_late_onset`.

    By a t test at the level 0.001. If it may start late, or its start is fitted, that is estimated.
    """
    if case_problem.offset or not begins_constant(*readings):
        return []
    onset_s = estimate_onset(case_problem, *readings) if late or case_problem.fit_start else 0.0
    if not begins_constant(*readings, onset_s):
        return []
    before = readings[1][readings[0] < onset_s][:-1]
    mean, error = float(np.mean(before)), float(np.std(before, ddof=1)) / np.sqrt(len(before))
    if abs(mean) <= error * stdtrit(len(before) - 1, 1 - _AS_GOOD / 2):
        return []
    unit = f" {case_problem.instrument.read.unit}".rstrip()
    text = (
        f"The {len(before)} readings before the start are constant, but {plain(mean)}{unit} and "
        "not 0: if that is the zero of the instrument, say --offset (measurement.offset)."
    )
    return [Note(REJECTION if diagnosis.status == REJECTED else DOUBT, text)]


def is_cut_off(time_s: Array) -> bool:
    """Return True if readings begin long after 0, (n_samples,), as if there had been earlier ones.

    They begin more than ten of their first intervals after it, and these do not grow in proportion
    to the time, as of readings that someone spaced from 0 on.
    """
    few = max(_FEWEST_APART, len(time_s) // 10)
    first_s, last_s = (
        float(np.ptp(ends)) / few for ends in (time_s[: few + 1], time_s[-few - 1 :])
    )
    if time_s[0] <= _DELAYED * first_s:
        return False
    growth = np.log(last_s / first_s) / np.log(time_s[-1 - few] / time_s[0])
    return not _PLANNED[0] < growth < _PLANNED[1]


def _about_clock(fits: OnsetFits, time_s: Array, diagnosis: Diagnosis) -> Iterator[Note]:
    """Yield a note if a trace may be on another clock, with its step just before it."""
    later_s = 2 * time_s[0] - time_s[1]
    given = fits.at(0.0, diagnosis.likelihood.best)
    rejected = diagnosis.status == REJECTED
    known = [each for each in diagnosis.findings if each.verdict == DETERMINED and not rejected]
    tau_s = [each.value for each in known if each.quantity.unit == "s"]
    lapses = f", {plain(time_s[0] / min(tau_s), 2)} relaxation times of the fit" if tau_s else ""
    text = f"The readings begin {plain(time_s[0])} s after the step of the protocol{lapses}. "
    other = fits.best(later_s) if rejected else fits.at(later_s, diagnosis.likelihood.best)
    fall = compute_fall(len(time_s), given.misfit_rad, other.misfit_rad, None)
    start, moved = f"If it starts at {other.onset_s:.4g} s of the clock, ", ""
    if rejected and 0 < other.onset_s < time_s[0] and other.misfit_rad < _WHITE * fits.noise_rad:
        far = fall > chdtri(1, _FALSE_ALARM)
        moved = f"the fit is far better (χ² falls by {plain(fall)})" if far else ""
    elif not rejected and fall > -chdtri(1, _AS_GOOD):
        moved = _moved(diagnosis, given, other, 0.5)
        moved = f"the trace fits as well: {moved}" if moved else ""
    if moved:
        yield Note(REJECTION if rejected else DOUBT, f"{text}{start}{moved}. {_SAY_WHEN}")


def _moved(diagnosis: Diagnosis, given: OnsetFit, other: OnsetFit, widths: float) -> str:
    """Name what another fit moves beyond its limits, by more than so many of their widths."""
    x = diagnosis.likelihood.best
    moved = x + other.log_parameters - given.log_parameters
    said = []
    for each in diagnosis.findings:
        before, after = each.quantity.log(x), each.quantity.log(moved)
        width = np.log(each.high / each.low) if each.high and each.low else 0.0
        if not each.allows(moved) and abs(after - before) > widths * width:
            unit = f" {each.quantity.unit}".rstrip()
            said.append(f"{each.quantity.label} would be {plain(np.exp(after))}{unit}")
    return "; ".join(said)


def note_hidden_ramp(
    case_problem: CaseProblem, time_s: Array, rotation_rad: Array, diagnosis: Diagnosis
) -> list[Note]:
    """Say what changes if the first step is a ramp that ends with the first reading.

    A note is due if a value then moves by more than the width of its limits; see `note_late_onset`
    for the parameters.
    """
    phases = _with_ramp(case_problem, time_s)
    if diagnosis.status == REJECTED or not phases:
        return []
    near = diagnosis.likelihood.best
    given, ramped = (
        OnsetFits(replace(case_problem, phases=own), time_s, rotation_rad).at(0.0, near)
        for own in (case_problem.phases, phases)
    )
    if not (moved := _moved(diagnosis, given, ramped, 1.0)):
        return []
    text = (
        f"If the load was no step but a ramp that ends with the first reading, at "
        f"{plain(time_s[0])} s: {moved}. A ramp is given by a protocol (--config), or as recorded "
        "(--load)."
    )
    return [Note(HARMLESS, text)]


def _with_ramp(case_problem: CaseProblem, time_s: Array) -> tuple[Phase, ...]:
    """Return phases with a ramp up to the first reading, none but for a hold until after that."""
    first, *rest = case_problem.phases
    loads, delay_s = (first.left, first.right), float(time_s[0])
    if not 0 < delay_s < first.duration_s or any(own != Load(own.value_Nm) for own in loads):
        return ()
    ramp = Phase(delay_s, *(Load(0.0, own.value_Nm / delay_s) for own in loads))
    return ramp, replace(first, duration_s=first.duration_s - delay_s), *rest


def begins_constant(time_s: Array, rotation_rad: Array, onset_s: float | None = None) -> bool:
    """Return True if the readings before an onset are constant within the noise of the trace.

    Without an onset, the first few readings are looked at. The last one before it may be on a ramp.
    """
    before = rotation_rad[:_FEWEST_BEFORE]
    if onset_s is not None:
        before = rotation_rad[time_s < onset_s][:-1]
    noise_rad, peak_rad = estimate_noise(rotation_rad), float(np.ptp(rotation_rad))
    size = max(_CONSTANT * noise_rad, _CONSTANT_OF_PEAK * peak_rad)
    return len(before) >= _FEWEST_BEFORE and bool(np.std(before) < size)
