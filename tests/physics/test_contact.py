import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest
from mpmath import mp, mpf
from scipy.linalg import expm

from biogrip.arrays import Array
from biogrip.errors import BiogripError
from biogrip.physics import calibration
from biogrip.physics.gripper import (
    Arm,
    CombDrive,
    Gripper,
    capacitance_slope,
    contact,
    torque,
    voltage,
)
from biogrip.physics.noise import Noise, add_noise
from workflow.paper import mechanics


@pytest.mark.parametrize("size_um", [30, 60, 120])
def test_the_tips_close_by_what_the_sample_leaves(gripper: Gripper, size_um: float) -> None:
    found = contact(gripper, 150e-6, TABLE_2, 1e-6 * size_um)
    before, after = (math.radians(a) for a in (75.0, found.reference_angle_deg))
    # Tip positions from their coordinates: each goes half of the way.
    travel = 1.5e-3 * (math.cos(after) - math.cos(before))
    assert travel == pytest.approx(0.5e-6 * (150 - size_um), rel=1e-10)
    assert before - after == pytest.approx(found.closing)
    assert found.torque_Nm / 4.4e-7 == pytest.approx(found.closing)


def test_of_unequal_arms_the_stiffer_one_asks_for_the_torque(unequal_gripper: Gripper) -> None:
    found = contact(unequal_gripper, 150e-6, TABLE_2, 60e-6)
    assert found.torque_Nm / 5.5e-7 == pytest.approx(found.closing)
    assert torque(TABLE_2, found.voltage_V) == pytest.approx(found.torque_Nm)


@pytest.mark.parametrize(
    ("size_um", "gap_um", "message"),
    [
        (20, 150, "found a sample of 20 um, allowed are 30 to 120 um"),
        (121, 150, "allowed are 30 to 120 um"),
        (110, 100, "allowed is at most the jaw gap, 100 um"),
        (30, 400, r"takes 7.\d+ degrees of each arm, allowed is the comb's stroke, 4.5 degrees"),
    ],
)
def test_what_cannot_be_gripped_is_refused(
    gripper: Gripper, size_um: float, gap_um: float, message: str
) -> None:
    with pytest.raises(BiogripError, match=message):
        contact(gripper, 1e-6 * gap_um, TABLE_2, 1e-6 * size_um)


def test_the_gripper_yields_as_two_springs_in_a_row(unequal_gripper: Gripper) -> None:
    """Jaws pushed apart by a force turn each hinge by F b/k and open by b times that."""
    force, b = 1e-6, unequal_gripper.lever_m
    opening = sum(b * force * b / k for k in (4.4e-7, 5.5e-7))
    assert unequal_gripper.jaw_stiffness_N_per_m == pytest.approx(force / opening)


def test_fringing_against_charges_on_two_strips() -> None:
    """Line charges on strips at +-1/2 V, unknown at as many points as the voltage is given."""
    h, g, n = TABLE_2.thickness_m / TABLE_2.finger_gap_m, 1.0, 300
    # Narrow towards the edges, where charge gathers.
    edges = 0.5 * h * np.cos(np.linspace(math.pi, 0, n + 1))
    middle, width = 0.5 * (edges[1:] + edges[:-1]), np.diff(edges)
    apart = np.abs(middle[:, None] - middle)
    with np.errstate(divide="ignore"):
        own = np.where(apart > 0, np.log(apart), np.log(width / 2) - 1)
    potential = (0.5 * np.log(apart**2 + g**2) - own) / (2 * math.pi)
    charge = np.linalg.solve(potential, np.full(n, 0.5)).sum()
    # Palmer's terms are the first two of a series; n segments give three digits.
    assert 1 + mechanics.fringing_of_comb(TABLE_2) == pytest.approx(charge * g / h, rel=5e-3)


def test_drag_of_an_arm_is_summed_along_it(gripper: Gripper) -> None:
    x = np.linspace(0, 1.5e-3, 10_001)
    per_length = 4 * math.pi * 1e-3 / (math.log(1.5e-3 / 40e-6) + 0.84)
    expected = np.trapezoid(per_length * x * x, x)
    assert mechanics.drag_of_arm(gripper, 40e-6) == pytest.approx(expected, rel=1e-7, abs=0)


def test_small_things(gripper: Gripper) -> None:
    assert mechanics.drag_of_sample(120e-6) == pytest.approx(6 * math.pi * 1e-3 * 60e-6)
    milligrams = 1e6 * mechanics.mass_of_sample(100e-6)
    assert milligrams == pytest.approx(1e9 * 4 / 3 * math.pi * (50e-6) ** 3)
    # A wheel of 60 um that turns by 3 mrad, on an arm of 1.5 mm.
    rolling = mechanics.rolling_of_contact(gripper, 120e-6, 3e-3)
    assert rolling == pytest.approx(60e-6 * 3e-3 / 1.5e-3)


@pytest.mark.parametrize(("size_m", "strain"), [(30e-6, 0.02), (120e-6, 0.1)])
def test_against_the_pressure_in_the_contact(size_m: float, strain: float) -> None:
    """Hertz' pressure p_0 sqrt(1 - r^2/a^2) with p_0 = 2 E* a/(pi R), E* = E/(1 - 1/4)."""
    modulus, radius, indentation = 1234.0, size_m / 2, strain * size_m / 2
    a = math.sqrt(radius * indentation)
    p_0 = 2 * modulus / 0.75 * a / (math.pi * radius)
    force = 2 / 3 * p_0 * math.pi * a**2
    found = mechanics.apparent_modulus(force, strain * size_m, size_m)
    assert found == pytest.approx(modulus, rel=1e-12)


REST = 66, 321e-6, 6.0, 4.5, 1.5
TABLE_2 = CombDrive(40e-6, 4e-6, 3e-6, *REST)


def test_slope_is_the_sum_of_cylindrical_capacitors() -> None:
    """Eq. (7) term by term as printed, in 30 digits."""
    mp.dps = 30
    r_0, d, g = mpf("321e-6"), mpf("4e-6"), mpf("3e-6")
    total = mpf(0)
    for i in range(66):
        if i:
            total += 1 / mp.log((r_0 + 2 * i * (d + g)) / (r_0 + 2 * i * (d + g) - g))
        total += 1 / mp.log((r_0 + (2 * i + 1) * (d + g)) / (r_0 + 2 * i * (d + g) + d))
    expected = mpf("8.8541878128e-12") * mpf("40e-6") * total
    # ln(outer/inner) of radii 1 % apart loses two of sixteen digits.
    assert capacitance_slope(TABLE_2) == pytest.approx(float(expected), rel=1e-13, abs=0)


@pytest.mark.parametrize(("torque_Nm", "printed_V"), [(1.6e-9, 17), (0.32e-9, 7)])
def test_operating_points_of_the_paper(torque_Nm: float, printed_V: float) -> None:
    """Section 3 says "about" 17 and 7 V: half of the last printed digit, and a little."""
    assert abs(float(voltage(TABLE_2, torque_Nm)) - printed_V) < 0.75


def test_voltage_inverts_torque_and_nothing_pushes() -> None:
    volts = np.linspace(0, 100, 11)
    np.testing.assert_allclose(voltage(TABLE_2, torque(TABLE_2, volts)), volts, rtol=1e-14)
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
    step, kicked = (motion.step, CAUSES[0], 0.0), (motion.impulse, 0.0, CAUSES[1] / 1e-14)
    for record, load, rate in (step, kicked):
        # From the rest at torque over stiffness, as far as the arm begins away from it.
        rest = np.array([load / 4.4e-7, 0.0])
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
