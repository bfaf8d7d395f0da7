"""Stage 1: noise-free rotation of a case, and the force of the jaws on its sample."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from biogrip.arrays import Array
from biogrip.errors import BiogripError
from biogrip.experiment.protocol import Phase, TorqueHistory, torque_at, torque_history
from biogrip.experiment.sample import Network, Sample
from biogrip.experiment.sampling import Sampling
from biogrip.instrument.gripper import Gripper
from biogrip.products.files.traces import TARGETS, write_target
from biogrip.products.plan import Wildcards
from biogrip.products.product import Product, wildcards_of
from biogrip.progress import warn
from biogrip.response.grip import compute_grip
from biogrip.response.jaw_force import jaw_force
from biogrip.response.simulation import simulated_rotation
from biogrip.response.unilateral import unilateral_response
from biogrip.study.study import Study


@dataclass(frozen=True)
class Settings:
    """Inputs of a target.

    Parameters
    ----------
    case
        Name of the case.
    gripper, phases, sampling
        Gripper, protocol and sampling.
    sample, parameters
        Sample model, and true values in SI units by name.
    nonlinear, unilateral
        True for nonlinear equations; true if the jaws cannot pull.
    stroke_rad
        Largest rotation that the comb drive's stroke allows.
    """

    case: str
    gripper: Gripper
    phases: tuple[Phase, ...]
    sampling: Sampling
    sample: Sample
    parameters: Mapping[str, float]
    nonlinear: bool
    unilateral: bool
    stroke_rad: float


def settings(study: Study, job: Wildcards) -> Settings:
    """Return the settings that a case's target depends on."""
    case = study.case(job["case"])
    return Settings(
        case.name,
        case.gripper,
        case.phases,
        case.sampling,
        case.sample,
        case.parameters,
        case.nonlinear_target,
        case.unilateral,
        case.stroke_rad,
    )


def simulate(settings: Settings, target: Path) -> None:
    """Simulate a case, and write its target, CSV.

    Raises
    ------
    BiogripError
        If the rotation is not finite, or exceeds the stroke of the comb drives.
    """
    torque = torque_history(settings.phases)
    network = settings.sample.model.sample(settings.parameters)
    time_s = settings.sampling.over(torque.end_s)
    rotation, force = _response(settings, network, torque, time_s)
    _check(settings, time_s, rotation)
    _say_if_contact_is_lost(settings, network, torque)
    write_target(target, time_s, torque_at(torque, time_s), rotation, force)


def _response(
    settings: Settings, network: Network, torque: TorqueHistory, time_s: Array
) -> tuple[Array, Array]:
    """Return the rotation of the left arm and the jaw force."""
    gripper, nonlinear = settings.gripper, settings.nonlinear
    if settings.unilateral:
        found = unilateral_response(gripper, network, torque, time_s)
        return found.rotation_rad[0], found.jaw_force_N
    rotation = simulated_rotation(gripper, network, torque, time_s, nonlinear=nonlinear)
    return rotation[0], jaw_force(gripper, network, torque, time_s, nonlinear=nonlinear)[0]


def _say_if_contact_is_lost(settings: Settings, network: Network, torque: TorqueHistory) -> None:
    grip = compute_grip(settings.gripper, network, torque, nonlinear=settings.nonlinear)
    words = grip.words()
    if words is None:
        return
    then = (
        "contact is lost there, which its identification ignores"
        if settings.unilateral
        else "without adhesion contact is lost there (contact: unilateral simulates that)"
    )
    warn(f"{settings.case}: under this protocol {words}; {then}.")


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
