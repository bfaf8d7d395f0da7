"""Stage 1: the noise-free response of a case."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from biogrip.arrays import Array
from biogrip.errors import BiogripError
from biogrip.experiment.protocol import Phase, torque_at, torque_history
from biogrip.experiment.sample import Sample
from biogrip.experiment.sampling import Sampling
from biogrip.instrument.gripper import Gripper
from biogrip.products.files.traces import TARGETS, write_target
from biogrip.products.plan import Wildcards
from biogrip.products.product import Product, wildcards_of
from biogrip.response.simulation import simulated_rotation
from biogrip.study.study import Study


@dataclass(frozen=True)
class Settings:
    """What makes a target.

    Parameters
    ----------
    gripper, phases, sampling
        With what, under what, and when.
    sample, parameters
        Of what: the model, and true values in SI units by name.
    nonlinear
        Whether the nonlinear model is solved.
    stroke_rad
        How far the comb drives can turn the arms.
    """

    gripper: Gripper
    phases: tuple[Phase, ...]
    sampling: Sampling
    sample: Sample
    parameters: Mapping[str, float]
    nonlinear: bool
    stroke_rad: float


def settings(study: Study, job: Wildcards) -> Settings:
    """Choose what a case's target depends on."""
    case = study.case(job["case"])
    return Settings(
        case.gripper,
        case.phases,
        case.sampling,
        case.sample,
        case.parameters,
        case.nonlinear_target,
        case.stroke_rad,
    )


def simulate(settings: Settings, target: Path) -> None:
    """Simulate a case and write its target, CSV.

    Raises
    ------
    BiogripError
        If the rotation is not finite, or the arms turn further than the comb drives can.
    """
    torque, model = torque_history(settings.phases), settings.sample.model
    parameters = [settings.parameters[name] for name in model.names]
    time_s = settings.sampling.over(torque.end_s)
    simulated = simulated_rotation(
        settings.gripper,
        model.network(np.array([parameters])),
        torque,
        time_s,
        nonlinear=settings.nonlinear,
    )[0]
    _check(settings, time_s, simulated)
    write_target(target, time_s, torque_at(torque, time_s), simulated)


def _check(settings: Settings, time_s: Array, simulated: Array) -> None:
    model = settings.sample.model
    for sample in np.flatnonzero(~np.isfinite(simulated))[:1]:
        values = ", ".join(f"{name} = {settings.parameters[name]:g}" for name in model.names)
        raise BiogripError(
            f"the simulated rotation of {model.title} with {values} is {simulated[sample]} "
            f"at {time_s[sample]:g} s; allowed are parameters, a gripper and a protocol for which "
            "it is finite."
        )
    largest = float(np.max(np.abs(simulated)))
    if largest > settings.stroke_rad:
        raise BiogripError(
            f"the protocol turns the arms by {1e3 * largest:.4g} mrad, allowed is what the comb "
            f"drive's stroke leaves, {1e3 * settings.stroke_rad:.4g} mrad."
        )


TARGET = Product(
    "target",
    {"target": TARGETS},
    simulate,
    settings,
    lambda plan: wildcards_of([*plan.study.simulated, *plan.study.points]),
    message="Simulating the response of {case}",
)
