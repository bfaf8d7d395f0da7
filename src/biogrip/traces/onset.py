"""Onset of a recorded trace: the time of its clock from which it follows the torque.

`estimate_onset` needs no sample model: the trace is fitted by any sample's possible responses to
the delayed torque, and the delay with the least residual sum of squares is found on ever finer
grids. That needs some hundred small fits; `biogrip.fit.fitted_onset` refines it with the model.
`note_late_onset` tests if a trace begins before its protocol where the user did not say so.
"""

import numpy as np
from scipy.special import chdtri

from biogrip.arrays import Array, BoolArray, IntArray
from biogrip.digits import plain
from biogrip.fit.case_problem import CaseProblem
from biogrip.fit.fitted_onset import OnsetFits
from biogrip.judging.doubts import REJECTION, Note
from biogrip.judging.likelihood import compute_fall
from biogrip.physics.gripper import Gripper
from biogrip.physics.modes import lagged_torques
from biogrip.physics.protocol import TorqueHistory
from biogrip.physics.whitening import estimate_noise, nuisance_basis, without
from biogrip.traces.any_sample import extreme_responses, left_over

# Relaxation times over the protocol's duration.
_LAG_SHARES = tuple(np.geomspace(1e-6, 10.0, 16))
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
# So that correlated noise does not look like a late onset.
_FALSE_ALARM = 1e-9


def estimate_onset(
    time_s: Array,
    rotation_rad: Array,
    gripper: Gripper,
    torque: TorqueHistory,
    *,
    offset: bool,
    drift: bool,
) -> float:
    """Estimate from when a trace follows the torque, in s of its clock.

    Parameters
    ----------
    time_s, rotation_rad : (n_samples,)
        The trace, times ascending.
    gripper, torque
        Gripper and protocol.
    offset, drift
        True if the instrument may have added it.
    """
    lagged = lagged_torques(torque, _LAG_SHARES)

    def square_sum(onset_s: float, some: BoolArray) -> float:
        nuisance = nuisance_basis(time_s[some], offset=offset, drift=drift)
        own = extreme_responses(lagged(time_s[some] - onset_s), gripper, len(_LAG_SHARES))
        return left_over(without(nuisance, rotation_rad[some]), without(nuisance, own))

    low, high = time_s[0], max(time_s[0], time_s[-1] - _LEAST_AFTER * torque.end_s)
    shortest = float(np.min(np.diff(time_s)))
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


def guess_onset(problem: CaseProblem, time_s: Array, rotation_rad: Array) -> float:
    """Estimate the onset of a trace, (n_samples,), without a sample model, in s of its clock."""
    known = {"offset": problem.offset, "drift": problem.drift}
    return estimate_onset(time_s, rotation_rad, problem.gripper, problem.torque, **known)


def note_late_onset(
    case_problem: CaseProblem, time_s: Array, rotation_rad: Array, near: Array
) -> list[Note]:
    """Fit the onset of a trace that begins constant, and reject the fit if that is far better.

    The test is a likelihood ratio. A trace that shows a later onset tells nothing of the sample
    under the protocol as given, whatever noise model absorbs the misfit.

    Parameters
    ----------
    case_problem
        Assumptions of the identification, with a protocol that starts at 0.
    time_s, rotation_rad : (n_samples,)
        The trace, times ascending.
    near : (n_parameters,)
        Log-parameters of the best fit with that protocol.

    Returns
    -------
    list of Note
        At most one.
    """
    if not begins_constant(time_s, rotation_rad):
        return []
    guess_s = guess_onset(case_problem, time_s, rotation_rad)
    if not begins_constant(time_s, rotation_rad, guess_s):
        return []
    fits = OnsetFits(case_problem, time_s, rotation_rad)
    found, given = fits.best(guess_s), fits.at(0.0, near)
    fall = compute_fall(len(time_s), given.misfit_rad, found.misfit_rad, case_problem.noise_rad)
    if not begins_constant(time_s, rotation_rad, found.onset_s) or fall < chdtri(1, _FALSE_ALARM):
        return []
    text = (
        f"The trace is constant until {found.onset_s:.4g} s of its clock, and fits far better if "
        f"the protocol starts there (χ² falls by {plain(fall)}). If it does, say --start "
        f"{found.onset_s:.4g} (measurement.start_s), or --start fit (measurement.fit_start), which "
        "allows for its uncertainty."
    )
    return [Note(REJECTION, text)]


def begins_constant(time_s: Array, rotation_rad: Array, onset_s: float | None = None) -> bool:
    """Return True if the readings before an onset are constant within the noise of the trace.

    Without an onset, the first few readings are looked at.
    """
    before = rotation_rad[:_FEWEST_BEFORE] if onset_s is None else rotation_rad[time_s < onset_s]
    noise_rad, peak_rad = estimate_noise(rotation_rad), float(np.ptp(rotation_rad))
    size = max(_CONSTANT * noise_rad, _CONSTANT_OF_PEAK * peak_rad)
    return len(before) >= _FEWEST_BEFORE and float(np.std(before)) < size
