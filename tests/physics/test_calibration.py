import dataclasses
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import expm

from biogrip.arrays import Array
from biogrip.errors import BiogripError
from biogrip.physics import calibration
from biogrip.physics.gripper import Arm, Gripper
from biogrip.physics.noise import Noise, add_noise

ARM = Arm(1.0e-14, 3.3e-12, 4.4e-7)
TIME_S = np.arange(1001) / 33e3
CAUSES = (1.6e-9, 2e-13)


@pytest.mark.parametrize(
    "damping", [3.3e-12, 1.3266e-10, 9e-10], ids=["rings", "critical", "creeps"]
)
def test_free_motion_is_the_exponential_of_its_matrix(damping: float) -> None:
    arm = dataclasses.replace(ARM, damping_Nms_per_rad=damping)
    matrix = np.array([[0.0, 1.0], [-4.4e-7 / 1e-14, -damping / 1e-14]])
    motion = calibration.free_motion(arm, TIME_S, *CAUSES)
    for record, torque, rate in (
        (motion.step, CAUSES[0], 0.0),
        (motion.impulse, 0.0, CAUSES[1] / ARM.inertia_kgm2),
    ):
        # From the rest at torque over stiffness, as far as the arm begins away from it.
        rest = np.array([torque / 4.4e-7, 0.0])
        expected = rest + expm(TIME_S[:, None, None] * matrix) @ (np.array([0.0, rate]) - rest)
        assert np.max(np.abs(record - expected[:, 0])) < 1e-8 * np.abs(record).max()


def noisy(arm: Arm, level: float, seed: int, time_s: Array = TIME_S) -> calibration.FreeMotion:
    motion = calibration.free_motion(arm, time_s, *CAUSES)
    rng, noise = np.random.default_rng(seed), Noise("gaussian", level, "peak")
    both = (add_noise(clean, noise, rng) for clean in (motion.step, motion.impulse))
    return calibration.FreeMotion(time_s, *both)


@pytest.mark.parametrize("scale", [0.3, 1.0, 3.0])
def test_without_noise_the_arm_itself_is_found(scale: float) -> None:
    arm = Arm(1e-14 * scale, 3.3e-12, 4.4e-7 * scale)
    record, true = calibration.free_motion(arm, TIME_S, *CAUSES), dataclasses.astuple(arm)
    # Decay is read off the first two eighths, frequency off a spectrum.
    np.testing.assert_allclose(calibration._first_guess(record, CAUSES[0]), true, rtol=0.02)
    found = calibration.calibrate(record, *CAUSES).arm
    np.testing.assert_allclose(dataclasses.astuple(found), true, rtol=1e-7)


@pytest.mark.parametrize("time_s", [TIME_S, TIME_S[:320:5]], ids=["many", "few"])
def test_uncertainties_are_honest(time_s: Array) -> None:
    """Over 40 records the errors have the spread that each record's own uncertainty says."""
    pulls = []
    for seed in range(40):
        found = calibration.calibrate(noisy(ARM, 0.05, seed, time_s), *CAUSES)
        error = np.subtract(dataclasses.astuple(found.arm), dataclasses.astuple(ARM))
        pulls.append(error / dataclasses.astuple(found.uncertainty))
    # The standard deviation of 40 draws is known to 11 %, three times that is allowed.
    np.testing.assert_allclose(np.std(pulls, axis=0), 1.0, rtol=0.34)


def test_a_dead_arm_is_no_calibration() -> None:
    still = calibration.FreeMotion(TIME_S, -np.ones_like(TIME_S), np.ones_like(TIME_S))
    with pytest.raises(BiogripError, match="does not follow"):
        calibration.calibrate(still, *CAUSES)


def test_calibration_is_written_and_read_back(tmp_path: Path) -> None:
    found = calibration.calibrate(noisy(ARM, 0.05, 2), *CAUSES)
    path, nominal = tmp_path / "gripper.yaml", Gripper(1.5e-3, 75.0, ARM, ARM)
    path.write_text(calibration.calibration_yaml(found, found))
    read, known = calibration.read_calibrated_arms(path, nominal)
    expected = found.uncertainty.stiffness_Nm_per_rad
    assert known["left"]["stiffness_Nm_per_rad"] == pytest.approx(expected, rel=0.05)
    arms = np.array([dataclasses.astuple(arm) for arm in (read.left, found.arm)])
    np.testing.assert_allclose(arms[0], arms[1], rtol=1e-6)
    path.write_text("gripper: {left: 3}")
    with pytest.raises(BiogripError, match="cannot be read as a calibration"):
        calibration.read_calibrated_arms(path, nominal)
