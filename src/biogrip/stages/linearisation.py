"""How far the linear model is from the nonlinear one, over angle and torque."""

import csv
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from biogrip.arrays import Array
from biogrip.files import written_whole
from biogrip.gripper import Gripper
from biogrip.protocol import TorqueHistory
from biogrip.response.linear import rotation, step_response
from biogrip.response.nonlinear import FINE, correction
from biogrip.sample import Network
from biogrip.study import build

COLUMNS = ("case", "reference_angle_deg", "torque_factor", "difference_over_peak")
ANGLES_DEG = np.arange(40.0, 91.0, 5.0)
FACTORS = np.geomspace(0.25, 32.0, 15)


def run(settings: dict[str, Any], output: Path) -> None:
    """Compare the models for every case on a grid.

    Parameters
    ----------
    settings
        ``cases`` with ``model``, ``branches``, ``parameters``, ``gripper``; and
        ``protocol`` (and ``actuator``, if that is in volts).
    output
        A row per case, reference angle and multiple of the protocol's torque, CSV.
    """
    torque = build.torque(settings)
    with written_whole(output) as scratch, scratch.open("w", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(COLUMNS)
        for name, case in settings["cases"].items():
            model = build.sample_model(case)
            network = model.network(np.array([[case["parameters"][p] for p in model.names]]))
            gripper = build.gripper(case["gripper"])
            for angle in ANGLES_DEG:
                turned = replace(gripper, reference_angle_deg=float(angle))
                for factor in FACTORS:
                    share = difference_over_peak(turned, network, scaled(torque, factor))
                    writer.writerow((name, f"{angle:g}", f"{factor:.4g}", f"{share:.4g}"))


def difference_over_peak(gripper: Gripper, network: Network, torque: TorqueHistory) -> float:
    """Largest difference of the models over the protocol, as a share of the nonlinear peak.

    NaN where the torque closes the arms beyond what the model describes.
    """
    time_s = _times(torque)
    found = correction(gripper, network, torque, FINE)
    if not found.converged[0]:
        return float("nan")
    response = step_response(gripper, network, symmetric=torque.symmetric, inertia=False)
    difference = found.at(time_s)[0]
    nonlinear = rotation(response, torque, time_s)[0] + difference
    return float(np.max(np.abs(difference)) / np.max(np.abs(nonlinear)))


def scaled(torque: TorqueHistory, factor: float) -> TorqueHistory:
    """Return the same protocol with every torque multiplied."""
    return replace(
        torque,
        left=factor * torque.left,
        right=factor * torque.right,
        harmonic_left=factor * torque.harmonic_left,
        harmonic_right=factor * torque.harmonic_right,
    )


def _times(torque: TorqueHistory) -> Array:
    """Times dense after every jump, and at its far end."""
    ends = np.append(torque.time_s[1:], torque.end_s)
    pieces = [
        start + np.geomspace(min(0.1, (end - start) / 2), end - start, 60)
        for start, end in zip(torque.time_s, ends, strict=True)
    ]
    return np.concatenate(pieces)
