"""What there is to identify: a trace, a model, and the range that is searched."""

from dataclasses import dataclass

import numpy as np

from biogrip.arrays import Array
from biogrip.experiment.protocol import TorqueHistory
from biogrip.experiment.sample import SampleModel
from biogrip.identify.genome import GeneRange, Genome, genome_of
from biogrip.instrument.gripper import Gripper
from biogrip.response.condensed import Condensed
from biogrip.response.every_sample import EverySample
from biogrip.response.misfit import Misfit, misfit_of
from biogrip.response.misfit_formed import FormedMisfit
from biogrip.response.misfit_series import SeriesMisfit
from biogrip.response.nuisance import nuisance_basis
from biogrip.response.residuals import Residuals

# Forming the responses of a population to more samples takes minutes.
_MANY_SAMPLES = 20_000


@dataclass(frozen=True)
class Problem:
    """The same for every identifier; each uses what it needs of it.

    Parameters
    ----------
    misfit
        RMS misfit in rad of parameters of shape (n, n_parameters).
    residuals
        Residuals and exact derivatives, as functions of log-parameters.
    genome
        What a chromosome may be.
    low, high : (n_parameters,)
        Logarithms of the ends of the search range (Table 4).
    """

    misfit: Misfit
    residuals: Residuals
    genome: Genome
    low: Array
    high: Array


def problem_of(
    gripper: Gripper,
    model: SampleModel,
    torque: TorqueHistory,
    time_s: Array,
    rotation_rad: Array,
    ranges: dict[str, GeneRange],
    *,
    nonlinear: bool = False,
    inertia: bool = False,
    offset: bool = False,
    drift: bool = False,
    noise_rad: float | None = None,
    condensed: Condensed | EverySample | None = None,
) -> Problem:
    """Pose the identification of one trace.

    Parameters
    ----------
    gripper, model, torque
        What is simulated.
    time_s, rotation_rad : (n_samples,)
        The trace, times ascending.
    ranges
        Gene ranges by the name of the range, see `Parameter.range_name`.
    nonlinear
        Whether to simulate the nonlinear model.
    inertia
        Whether the arms have any, and ring after every change of the torque.
    offset, drift
        Whether the instrument may have added a constant, and a drift linear in time.
    noise_rad
        Standard deviation of the noise, if it is known.
    condensed
        What `rows_of` gives for the same times, if there is one already.
    """
    condensed = condensed or rows_of(
        torque, time_s, offset=offset, drift=drift, nonlinear=nonlinear, inertia=inertia
    )
    residuals = Residuals(
        gripper,
        model,
        torque,
        time_s,
        rotation_rad,
        condensed,
        nonlinear=nonlinear,
        noise_rad=noise_rad,
    )
    misfit = misfit_of(
        gripper,
        model,
        torque,
        time_s,
        rotation_rad,
        nonlinear=nonlinear,
        inertia=inertia,
        nuisance=condensed.nuisance,
    )
    many = isinstance(misfit, FormedMisfit) and len(time_s) > _MANY_SAMPLES
    if condensed.coloured or (many and not inertia and residuals.condensable):
        misfit = residuals.condensed_misfit
    return _searched(misfit, residuals, ranges)


def for_model(problem: Problem, model: SampleModel, ranges: dict[str, GeneRange]) -> Problem:
    """Pose a problem of `problem_of` for another model; what is tabulated of the trace is shared.

    Parameters
    ----------
    problem
        Of the trace.
    model
        The other model.
    ranges
        As of `problem_of`.
    """
    residuals = problem.residuals.of_model(model)
    misfit = residuals.condensed_misfit
    if isinstance(problem.misfit, SeriesMisfit | FormedMisfit):
        misfit = problem.misfit.of_model(model)
    return _searched(misfit, residuals, ranges)


def _searched(misfit: Misfit, residuals: Residuals, ranges: dict[str, GeneRange]) -> Problem:
    chosen = [ranges[parameter.range_name] for parameter in residuals.model.parameters]
    return Problem(
        misfit,
        residuals,
        genome_of(residuals.model, ranges),
        np.log([genes.low for genes in chosen]),
        np.log([genes.high for genes in chosen]),
    )


def rows_of(
    torque: TorqueHistory,
    time_s: Array,
    *,
    offset: bool,
    drift: bool,
    nonlinear: bool,
    inertia: bool,
) -> Condensed | EverySample:
    """Find what stands for the samples of all traces that are sampled at the same times.

    Where arms ring, every sample stands for itself.
    """
    if inertia:
        return EverySample(time_s, nuisance_basis(time_s, offset=offset, drift=drift))
    return condensed_of(torque, time_s, offset=offset, drift=drift, nonlinear=nonlinear)


def condensed_of(
    torque: TorqueHistory, time_s: Array, *, offset: bool, drift: bool, nonlinear: bool = False
) -> Condensed:
    """Condense the residuals of all traces that are sampled at the same times."""
    nuisance = nuisance_basis(time_s, offset=offset, drift=drift)
    return Condensed(torque, time_s, nuisance, nonlinear=nonlinear)
