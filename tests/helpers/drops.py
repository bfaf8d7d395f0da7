"""Recorded traces of liquid drops."""

from pathlib import Path

import numpy as np

from biogrip.physics.models import CANDIDATES
from biogrip.physics.simulation import simulated_rotation
from tests.helpers.default import STUDY


def write_trace(file: Path, seed: int) -> None:
    """Write a trace of a liquid drop in noise, of 120 readings."""
    case = STUDY.cases["liquid_drop_1"].problem
    time_s = np.linspace(0, 400, 120)
    network = CANDIDATES["liquid_drop"].model.network(np.array([[20.0 + seed, 5.0, 300.0]]))
    clean = simulated_rotation(case.gripper, network, case.torque, time_s, nonlinear=False)[0]
    noisy = clean + 1e-6 * np.random.default_rng(seed).standard_normal(len(time_s))
    np.savetxt(file, np.c_[time_s, noisy], "%.9g", ",", header="time_s,rotation_rad", comments="")
