"""Test for a protocol that starts after the trace does, where the user did not say so."""

from scipy.special import chdtri

from biogrip.arrays import Array
from biogrip.fit.case_problem import CaseProblem
from biogrip.fit.fitted_onset import OnsetFits
from biogrip.judging.doubts import REJECTION, Note
from biogrip.judging.likelihood import compute_fall
from biogrip.traces.onset import begins_constant, guess_onset

# So that correlated noise does not look like a late onset.
_FALSE_ALARM = 1e-9


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
        f"the protocol starts there (χ² falls by {fall:.3g}). If it does, say --start "
        f"{found.onset_s:.4g} (measurement.start_s), or --start fit (measurement.fit_start), which "
        "allows for its uncertainty."
    )
    return [Note(REJECTION, text)]
