import math

import numpy as np
import pytest

from biogrip.errors import BiogripError
from biogrip.physics.actuator import torque
from biogrip.physics.contact import contact
from biogrip.physics.gripper import Gripper, displacement_of_tip, rotation_of_tip
from tests.physics.test_actuator import TABLE_2


@pytest.mark.parametrize("size_um", [30, 60, 120])
def test_the_tips_close_by_what_the_sample_leaves(gripper: Gripper, size_um: float) -> None:
    found = contact(gripper, 150e-6, TABLE_2, 1e-6 * size_um)
    before, after = (math.radians(a) for a in (75.0, found.reference_angle_deg))
    # Tip positions from their coordinates: each goes half of the way.
    travel = 1.5e-3 * (math.cos(after) - math.cos(before))
    assert travel == pytest.approx(0.5e-6 * (150 - size_um), rel=1e-10)
    assert before - after == pytest.approx(found.closing_rad)
    assert found.torque_Nm == pytest.approx(4.4e-7 * found.closing_rad)


def test_of_unequal_arms_the_stiffer_one_asks_for_the_torque(unequal_gripper: Gripper) -> None:
    found = contact(unequal_gripper, 150e-6, TABLE_2, 60e-6)
    assert found.torque_Nm == pytest.approx(5.5e-7 * found.closing_rad)
    assert torque(TABLE_2, found.voltage_V) == pytest.approx(found.torque_Nm)


def test_largest_sample_costs_ten_milliradian(gripper: Gripper) -> None:
    assert contact(gripper, 150e-6, TABLE_2, 120e-6).closing_rad == pytest.approx(0.0104, abs=1e-4)


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


def test_a_tip_goes_where_its_rotation_takes_it(gripper: Gripper) -> None:
    turns = np.array([1e-9, 1e-3, 0.07])
    there = displacement_of_tip(gripper, turns)
    np.testing.assert_allclose(rotation_of_tip(gripper, there), turns, rtol=1e-14)
    coordinates = [
        1.5e-3 * (math.cos(math.radians(75) - t) - math.cos(math.radians(75))) for t in turns
    ]
    np.testing.assert_allclose(there[1:], coordinates[1:], rtol=1e-11)
