"""Functions for notebooks: identify a trace; simulate, add noise, identify, judge, plot.

The commands and the workflow use the same functions. Columns of pandas do as arrays.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from biogrip.arrays import Array, as_column
from biogrip.command.notebook import TraceResult, identify_trace, one_blas_thread, to_table
from biogrip.errors import BiogripError
from biogrip.fit.experiment import Experiment
from biogrip.fit.genome import GeneRange
from biogrip.fit.least_squares import identify_many
from biogrip.fit.problem import Fit, silent
from biogrip.judging.diagnosis import Diagnosis, diagnose, with_times
from biogrip.physics.gripper import NO_ARMS, Arm, Gripper
from biogrip.physics.instruments import GRIPPER, INSTRUMENTS, Instrument
from biogrip.physics.models import Sample
from biogrip.physics.noise import Noise, add_noise
from biogrip.physics.protocol import Phase, hold
from biogrip.physics.simulation import simulated_response

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Ranges of the default study.
_RANGES = {
    "k": GeneRange((-3, 8), (1, 9)),
    "k_p": GeneRange((-3, 8), (1, 9)),
    "c": GeneRange((-4, 5), (1, 9)),
    "c_p": GeneRange((-4, 5), (1, 9)),
    "alpha": GeneRange((-1, 0), (1, 9)),
}


def set_up(
    gripper: Gripper | Instrument,
    protocol: tuple[Phase, ...],
    sample: Sample,
    *,
    ranges: Mapping[str, GeneRange] | None = None,
    fixed: Mapping[str, float] | None = None,
) -> Experiment:
    """Return an experiment: instrument, protocol and sample model, with search ranges.

    Parameters
    ----------
    gripper
        Gripper, or one of `INSTRUMENTS`: ``INSTRUMENTS["strain"]`` is creep whose strain is read,
        ``INSTRUMENTS["modulus"]`` relaxation whose modulus is.
    protocol
        Phases of the torque, or of what else is controlled.
    sample
        Constitutive model of the sample.
    ranges
        Search ranges by name; by default those of the default study.
    fixed
        Fixed parameters by name, SI units.
    """
    instrument = gripper if isinstance(gripper, Instrument) else GRIPPER
    return Experiment(
        NO_ARMS if isinstance(gripper, Instrument) else gripper,
        protocol,
        ranges or _RANGES,
        replace(sample, stiffness=instrument.stiffness),
        dict(fixed or {}),
        instrument,
    )


def simulate(
    experiment: Experiment,
    parameters: Mapping[str, float],
    time_s: ArrayLike,
    *,
    nonlinear: bool = False,
) -> Array:
    """Simulate what the instrument reads without noise: of a gripper, the left arm's rotation.

    Parameters
    ----------
    experiment
        Experiment from `set_up`.
    parameters
        Parameters of the sample by name, SI units.
    time_s : (n_samples,)
        Sampling times, ascending.
    nonlinear
        If true, use the nonlinear equations; fits use the linear ones.

    Returns
    -------
    (n_samples,)
        In SI units; of a rotation, rad.
    """
    network, torque = experiment.model.sample(parameters), experiment.torque
    times = as_column(time_s, "time_s")
    return simulated_response(experiment.gripper, network, torque, times, nonlinear=nonlinear)[0]


@one_blas_thread
def identify_sample(
    experiment: Experiment, time_s: ArrayLike, readings: ArrayLike, seed: int = 0
) -> Fit:
    """Identify the sample by least squares from many starts.

    Parameters
    ----------
    experiment
        Experiment from `set_up`.
    time_s, readings : (n_samples,)
        Trace in SI units.
    seed
        Seed of the starts.
    """
    problem = experiment.of(as_column(time_s, "time_s"), as_column(readings, "readings"))
    return identify_many(
        [problem], experiment.least_squares, [np.random.default_rng(seed)], silent
    )[0]


@one_blas_thread
def judge(
    experiment: Experiment,
    time_s: ArrayLike,
    readings: ArrayLike,
    found: Fit,
    confidence: float = 0.95,
) -> Diagnosis:
    """Compute confidence limits and verdicts from profile likelihoods.

    Parameters
    ----------
    experiment
        Experiment from `set_up`.
    time_s, readings : (n_samples,)
        Trace in SI units.
    found
        Result of `identify_sample`.
    confidence
        Confidence level of the limits.
    """
    problem = experiment.of(as_column(time_s, "time_s"), as_column(readings, "readings"))
    diagnosis = diagnose(problem, experiment.searched, found, confidence=confidence)
    return with_times([diagnosis], experiment.searched)[0]


def plot(experiment: Experiment, time_s: ArrayLike, readings: ArrayLike, found: Fit) -> "Figure":
    """Draw a trace, its fit and the residuals."""
    from biogrip.figures.fit import draw_fit
    from biogrip.figures.results import fit_of
    from biogrip.figures.style import styled
    from biogrip.records.traces import Measurements

    names = experiment.searched.names
    values = {**experiment.fixed, **dict(zip(names, map(float, found.parameters), strict=True))}
    times, read = as_column(time_s, "time_s"), as_column(readings, "readings")
    fit = fit_of(experiment, values, Measurements(times, None, {0: read}), 0)
    with styled():
        return draw_fit({"best fit": fit}, "")


__all__ = [
    "INSTRUMENTS",
    "Arm",
    "BiogripError",
    "Diagnosis",
    "Experiment",
    "Fit",
    "GeneRange",
    "Gripper",
    "Noise",
    "Phase",
    "Sample",
    "TraceResult",
    "add_noise",
    "hold",
    "identify_sample",
    "identify_trace",
    "judge",
    "plot",
    "set_up",
    "simulate",
    "to_table",
]
