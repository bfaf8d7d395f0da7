"""Test for a protocol that starts after the trace does, where the user did not say so."""

from scipy.special import chdtri

from biogrip.identifiability.diagnosis import Diagnosis
from biogrip.identifiability.fit_status import DOUBT, REJECTED, REJECTION, Note
from biogrip.identify.case_problem import CaseProblem
from biogrip.identify.fitted_onset import OnsetFits
from biogrip.own_traces.second_opinion import fall_of
from biogrip.products.files.traces import Measurements
from biogrip.products.stages.recording import guess_onset
from biogrip.traces.onset import begins_constant

# So that correlated noise does not look like a late onset.
_FALSE_ALARM = 1e-9


def late_onset(
    case_problem: CaseProblem, recorded: Measurements, diagnosis: Diagnosis
) -> list[Note]:
    """Fit the onset of a trace that begins constant, and doubt the trace if that is far better.

    The test is a likelihood ratio, as in `second_opinion`.

    Parameters
    ----------
    case_problem, recorded
        Assumptions of the identification, and the trace.
    diagnosis
        Diagnosis with a protocol that starts at 0.

    Returns
    -------
    list of Note
        At most one; none if the onset was given. It is among the reasons of a rejected fit.
    """
    time_s, rotation_rad = recorded.time_s, recorded.rotation_rad[0]
    if recorded.onset_s is not None or not begins_constant(time_s, rotation_rad):
        return []
    guess_s = guess_onset(case_problem, time_s, rotation_rad)
    if not begins_constant(time_s, rotation_rad, guess_s):
        return []
    fits = OnsetFits(case_problem, time_s, rotation_rad)
    found, given = fits.best(guess_s), fits.at(0.0, diagnosis.likelihood.best)
    fall = fall_of(len(time_s), given.misfit_rad, found.misfit_rad, case_problem.noise_rad)
    if not begins_constant(time_s, rotation_rad, found.onset_s) or fall < chdtri(1, _FALSE_ALARM):
        return []
    text = (
        f"The trace is constant until {found.onset_s:.4g} s of its clock, and fits far better if "
        f"the protocol starts there (χ² falls by {fall:.3g}). If it does, say --start "
        f"{found.onset_s:.4g}, or --start fit, which allows for its uncertainty."
    )
    return [Note(REJECTION if diagnosis.status == REJECTED else DOUBT, text)]
