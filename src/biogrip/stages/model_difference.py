"""Difference of the linear from the nonlinear model, on a grid of angles and torques.

At every point the largest difference over the protocol is compared with the peak rotation.
"""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from biogrip.arrays import Array
from biogrip.physics.gripper import Gripper
from biogrip.physics.linear import rotation, step_response
from biogrip.physics.nonlinear import correction
from biogrip.physics.protocol import TorqueHistory, torque_history
from biogrip.physics.sample_model import Network
from biogrip.records.identifications import DIFFERENCES
from biogrip.study.study import Case, Study

ANGLES_DEG = np.arange(40.0, 91.0, 5.0)
FACTORS = np.geomspace(0.25, 32.0, 15)


def network_of(case: Case) -> Network:
    """Return the network of a case's sample."""
    return case.sample.model.sample(case.parameters)


def compare(study: Study, differences: Path) -> None:
    """Write a row per case, angle and torque factor, CSV."""
    DIFFERENCES.write(differences, _rows(study))


def _rows(study: Study) -> Iterator[tuple[str, ...]]:
    for name, case in study.cases.items():
        torque, model = torque_history(case.phases), case.sample.model
        values = [case.parameters[p] for p in model.names]
        network = model.network(np.tile(values, (len(FACTORS), 1)))
        for angle in ANGLES_DEG:
            turned = replace(case.gripper, reference_angle_deg=float(angle))
            shares = difference_over_peak(turned, network, torque, FACTORS)
            for factor, share in zip(FACTORS, shares, strict=True):
                yield name, f"{angle:g}", f"{factor:.4g}", f"{share:.4g}"


def difference_over_peak(
    gripper: Gripper, network: Network, torque: TorqueHistory, factors: Array
) -> Array:
    """Return the largest difference of the models as a share of the nonlinear peak rotation, (n,).

    Factors of the torque are one per sample, (n,). NaN where the torque closes the arms beyond the
    model's validity.
    """
    time_s = _times(torque)
    found = correction(gripper, network, torque, factors)
    response = step_response(gripper, network, symmetric=torque.symmetric, inertia=False)
    difference = found.at(time_s)
    nonlinear = factors[:, None] * rotation(response, torque, time_s) + difference
    share = np.max(np.abs(difference), axis=1) / np.max(np.abs(nonlinear), axis=1)
    return np.where(found.converged, share, np.nan)


def scaled(torque: TorqueHistory, factor: float) -> TorqueHistory:
    """Return the protocol with every torque multiplied by a factor."""
    return replace(
        torque,
        left=factor * torque.left,
        right=factor * torque.right,
        harmonic_left=factor * torque.harmonic_left,
        harmonic_right=factor * torque.harmonic_right,
    )


def _times(torque: TorqueHistory) -> Array:
    """Return times that are dense after every jump and reach up to the next."""
    ends = np.append(torque.time_s[1:], torque.end_s)
    lasting = zip(torque.time_s, ends - torque.time_s, strict=True)
    return np.concatenate(
        [start + np.geomspace(min(0.1, lasts / 2), lasts, 60) for start, lasts in lasting]
    )
