import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import expm

from biogrip.arrays import Array
from biogrip.errors import BiogripError
from biogrip.physics.gripper import (
    Arm,
    CombDrive,
    Gripper,
    capacitance_slope,
    find_contact,
    torque,
    voltage,
)
from biogrip.physics.noise import Noise, add_noise
from biogrip_study.gripper import calibration
from tests.helpers.default import STUDY, study_of
from workflow.paper import mechanics


@pytest.mark.parametrize("size_um", [30, 120])
def test_the_tips_close_by_what_the_sample_leaves(either_gripper: Gripper, size_um: float) -> None:
    """Each goes half of the way; the stiffer arm asks for the torque."""
    found = find_contact(either_gripper, 150e-6, TABLE_2, 1e-6 * size_um)
    before, after = (math.radians(a) for a in (75.0, found.reference_angle_deg))
    travel = 1.5e-3 * (math.cos(after) - math.cos(before))
    assert travel == pytest.approx(0.5e-6 * (150 - size_um), rel=1e-10)
    assert before - after == pytest.approx(found.closing)
    stiffer = max(arm.stiffness_Nm_per_rad for arm in (either_gripper.left, either_gripper.right))
    assert found.torque_Nm / stiffer == pytest.approx(found.closing)
    assert torque(TABLE_2, found.voltage_V) == pytest.approx(found.torque_Nm)


def test_what_cannot_be_gripped_is_refused(gripper: Gripper) -> None:
    for size_um, gap_um, message in (
        (20, 150, "found a sample of 20 um, allowed are 30 to 120 um"),
        (121, 150, "allowed are 30 to 120 um"),
        (110, 100, "allowed is at most the jaw gap, 100 um"),
        (30, 400, r"takes 7.\d+ degrees of each arm, allowed is the comb's stroke, 4.5 degrees"),
    ):
        with pytest.raises(BiogripError, match=message):
            find_contact(gripper, 1e-6 * gap_um, TABLE_2, 1e-6 * size_um)


def test_the_gripper_yields_as_two_springs_in_a_row(unequal_gripper: Gripper) -> None:
    """Jaws pushed apart by a force turn each hinge by F b/k and open by b times that."""
    force, b = 1e-6, unequal_gripper.lever_m
    opening = sum(b * force * b / k for k in (4.4e-7, 5.5e-7))
    assert unequal_gripper.jaw_stiffness_N_per_m == pytest.approx(force / opening)


def test_what_the_model_leaves_out(gripper: Gripper) -> None:
    """Palmer's fringing, Tirado's drag of a rod, and Hertz' mean pressure, in numbers."""
    assert mechanics.fringing_of_comb(TABLE_2) == pytest.approx(0.12958, rel=1e-4)
    assert mechanics.drag_of_arm(gripper, 40e-6) == pytest.approx(3.16669e-12, rel=1e-5, abs=0)
    assert mechanics.drag_of_sample(120e-6) == pytest.approx(6 * math.pi * 1e-3 * 60e-6)
    milligrams = 1e6 * mechanics.mass_of_sample(100e-6)
    assert milligrams == pytest.approx(1e9 * 4 / 3 * math.pi * (50e-6) ** 3)
    # A wheel of 60 um that turns by 3 mrad, on an arm of 1.5 mm.
    rolling = mechanics.rolling_of_contact(gripper, 120e-6, 3e-3)
    assert rolling == pytest.approx(60e-6 * 3e-3 / 1.5e-3)
    # Of a sphere of 40 um whose sides are each indented by 1 um: 4/3 E* R^(1/2) d^(3/2).
    force = 4 / 3 * 1234.0 / 0.75 * math.sqrt(20e-6) * 1e-6**1.5
    assert mechanics.apparent_modulus(force, 2e-6, 40e-6) == pytest.approx(1234.0, rel=1e-12)


REST = 66, 321e-6, 6.0, 4.5, 1.5
TABLE_2 = CombDrive(40e-6, 4e-6, 3e-6, *REST)


def test_slope_is_the_sum_of_cylindrical_capacitors() -> None:
    """Eq. (7) term by term as printed, in um: each finger of 4 has a gap of 3 on either side."""
    starts = [321 + 14 * finger for finger in range(66)]
    total = sum(1 / math.log((r + 7) / (r + 4)) for r in starts)
    total += sum(1 / math.log(r / (r - 3)) for r in starts[1:])
    assert capacitance_slope(TABLE_2) == pytest.approx(
        8.8541878128e-12 * 40e-6 * total, rel=1e-13, abs=0
    )


@pytest.mark.parametrize(("torque_Nm", "printed_V"), [(1.6e-9, 17), (0.32e-9, 7)])
def test_operating_points_of_the_paper(torque_Nm: float, printed_V: float) -> None:
    """Section 3 says "about" 17 and 7 V: half of the last printed digit, and a little."""
    assert abs(float(voltage(TABLE_2, torque_Nm)) - printed_V) < 0.75


def test_nothing_pushes() -> None:
    with pytest.raises(ValueError, match="only pulls"):
        voltage(TABLE_2, -1e-9)


ARM = Arm(1.0e-14, 3.3e-12, 4.4e-7)
TIME_S = np.arange(1001) / 33e3
CAUSES = (1.6e-9, 2e-13)


@pytest.mark.parametrize("damping", [3.3e-12, 1.3266e-10, 9e-10])
def test_free_motion_is_the_exponential_of_its_matrix(damping: float) -> None:
    """Of arms that ring, are critically damped, and creep."""
    arm = dataclasses.replace(ARM, damping_Nms_per_rad=damping)
    matrix = np.array([[0.0, 1.0], [-4.4e-7 / 1e-14, -damping / 1e-14]])
    motion = calibration.free_motion(arm, TIME_S, *CAUSES)
    causes = (CAUSES[0], 0.0), (0.0, CAUSES[1] / 1e-14)
    for record, (load, rate) in zip(motion, causes, strict=True):
        # From the rest at torque over stiffness, as far as the arm begins away from it.
        rest = np.array([load / 4.4e-7, 0.0])
        expected = rest + expm(TIME_S[:, None, None] * matrix) @ (np.array([0.0, rate]) - rest)
        assert np.max(np.abs(record - expected[:, 0])) < 1e-8 * np.abs(record).max()


def noisy(arm: Arm, level: float, seed: int, time_s: Array = TIME_S) -> Array:
    rng, noise = np.random.default_rng(seed), Noise("gaussian", level, "peak")
    motion = calibration.free_motion(arm, time_s, *CAUSES)
    return np.stack([add_noise(clean, noise, rng) for clean in motion])


@pytest.mark.parametrize("scale", [0.3, 1.0, 3.0])
def test_without_noise_the_arm_itself_is_found(scale: float) -> None:
    arm = Arm(1e-14 * scale, 3.3e-12, 4.4e-7 * scale)
    record, true = calibration.free_motion(arm, TIME_S, *CAUSES), dataclasses.astuple(arm)
    # Decay is read off the first two eighths, frequency off a spectrum.
    np.testing.assert_allclose(calibration._first_guess(TIME_S, record, CAUSES[0]), true, rtol=0.02)
    found, _ = calibration.calibrate(TIME_S, record, *CAUSES)
    np.testing.assert_allclose(dataclasses.astuple(found), true, rtol=1e-7)


@pytest.mark.parametrize("time_s", [TIME_S, TIME_S[:320:5]], ids=["many", "few"])
def test_uncertainties_are_honest(time_s: Array) -> None:
    """Over 40 records the errors have the spread that each record's own uncertainty says."""
    pulls = []
    for seed in range(40):
        record = noisy(ARM, 0.05, seed, time_s)
        found, uncertainty = calibration.calibrate(time_s, record, *CAUSES)
        error = np.subtract(dataclasses.astuple(found), dataclasses.astuple(ARM))
        pulls.append(error / dataclasses.astuple(uncertainty))
    # The standard deviation of 40 draws is known to 11 %, three times that is allowed.
    np.testing.assert_allclose(np.std(pulls, axis=0), 1.0, rtol=0.34)


def test_a_dead_arm_is_no_calibration() -> None:
    still = np.stack((-np.ones_like(TIME_S), np.ones_like(TIME_S)))
    with pytest.raises(BiogripError, match="does not follow"):
        calibration.calibrate(TIME_S, still, *CAUSES)


def test_calibration_is_written_and_read_back(tmp_path: Path) -> None:
    found, uncertainty = calibration.calibrate(TIME_S, noisy(ARM, 0.05, 2), *CAUSES)
    path, nominal = tmp_path / "gripper.yaml", STUDY.case("endothelial_cell").experiment
    both = ({"left": arm, "right": arm} for arm in (found, uncertainty))
    path.write_text(calibration.calibration_yaml(*both))
    read = calibration.with_calibration(nominal, path)
    expected = uncertainty.stiffness_Nm_per_rad
    known = read.uncertainty["left"]["stiffness_Nm_per_rad"]
    assert known == pytest.approx(expected, rel=0.05)
    arms = np.array([dataclasses.astuple(arm) for arm in (read.gripper.left, found)])
    np.testing.assert_allclose(arms[0], arms[1], rtol=1e-6)
    path.write_text("gripper: {left: 3}")
    with pytest.raises(BiogripError, match="cannot be read as a calibration"):
        calibration.with_calibration(nominal, path)


def test_closing_onto_a_sample_leaves_less_stroke() -> None:
    """Each tip goes half of the way: l (cos(hat - phi) - cos hat) = (gap - size)/2."""
    sized = study_of("cases: {endothelial_cell: {sample: {size_m: 100.0e-6}}}")
    hat, closed = math.radians(75), 25e-6 / 1.5e-3
    phi = hat - math.acos(math.cos(hat) + closed)
    assert sized.case("endothelial_cell").stroke == pytest.approx(math.radians(4.5) - phi)
    assert STUDY.case("endothelial_cell").stroke == math.radians(4.5)
