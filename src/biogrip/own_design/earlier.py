"""What a trace has told already, for the experiment that comes next."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from biogrip.arrays import Array
from biogrip.errors import BiogripError
from biogrip.experiment.random_streams import stream
from biogrip.identify.answer import silent
from biogrip.identify.methods import identifier
from biogrip.products.stages import recording
from biogrip.study.study import Case
from biogrip.study.trace_file import trace_file_problem
from biogrip.traces.recordings import Columns

# Of the search range's length in logarithms, the standard deviation of what nothing tells.
_UNTOLD = 0.25


@dataclass(frozen=True, eq=False)
class Earlier:
    """What a trace told.

    Parameters
    ----------
    parameters : (n, n_parameters)
        Samples that are plausible after it, the best fit first.
    information : (n_parameters, n_parameters)
        Fisher information of the log-parameters at the best fit.
    """

    parameters: Array
    information: Array


def told_by(case: Case, trace: Path, study_seed: int) -> Earlier:
    """Fit a trace, and draw samples from what is plausible after it.

    Around the best fit the likelihood is taken for Gaussian, and what the trace does not tell lies
    anywhere in the search range.

    Parameters
    ----------
    case
        Gripper, protocol, search range and least squares; its block `design` has the noise.
    trace
        CSV file with the columns time_s and rotation_rad.
    study_seed
        Of starting points and draws.

    Raises
    ------
    BiogripError
        With file and line, if the trace cannot be used.
    """
    asked = case.block.design
    assert asked is not None
    if wrong := trace_file_problem(trace):
        raise BiogripError(f"--after: {wrong}")
    posed = replace(case.problem, inertia=True, noise_rad=asked.noise_rad)
    columns = Columns("time_s", "rotation_rad")
    recorded = recording.read_checked(recording.Settings(case.gripper, posed, columns), trace)
    problem = posed.of(recorded.time_s, recorded.rotation_rad[0])
    identify = identifier("least_squares", case.method("least_squares"))
    rng = stream(study_seed, case.name, 0, "after")
    (found,) = identify([problem], [rng], silent)
    best = np.log(found.parameters)
    _, slopes = problem.residuals(best)
    information = slopes @ slopes.T / asked.noise_rad**2
    untold = np.diag((_UNTOLD * (problem.high - problem.low)) ** -2)
    # Of R with R^T R the precision, R^-1 z has its covariance.
    root = np.linalg.cholesky(information + untold).T
    around = np.linalg.solve(root, rng.standard_normal((len(best), asked.drawn - 1))).T
    drawn = np.clip(
        best + np.concatenate((np.zeros((1, len(best))), around)), problem.low, problem.high
    )
    return Earlier(np.exp(drawn), information)
