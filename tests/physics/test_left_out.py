import math

import numpy as np
import pytest

from biogrip.physics.contact import (
    drag_of_arm,
    drag_of_sample,
    fringing_of_comb,
    mass_of_sample,
    rolling_of_contact,
)
from biogrip.physics.gripper import Gripper
from tests.physics.test_actuator import TABLE_2


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
    assert 1 + fringing_of_comb(TABLE_2) == pytest.approx(charge * g / h, rel=5e-3)


def test_drag_of_an_arm_is_summed_along_it(gripper: Gripper) -> None:
    x = np.linspace(0, 1.5e-3, 10_001)
    per_length = 4 * math.pi * 1e-3 / (math.log(1.5e-3 / 40e-6) + 0.84)
    expected = np.trapezoid(per_length * x * x, x)
    assert drag_of_arm(gripper, 40e-6) == pytest.approx(expected, rel=1e-7)


def test_small_things(gripper: Gripper) -> None:
    assert drag_of_sample(120e-6) == pytest.approx(6 * math.pi * 1e-3 * 60e-6)
    assert mass_of_sample(100e-6) == pytest.approx(1e3 * 4 / 3 * math.pi * (50e-6) ** 3)
    # A wheel of 60 um that turns by 3 mrad, on an arm of 1.5 mm.
    assert rolling_of_contact(gripper, 120e-6, 3e-3) == pytest.approx(60e-6 * 3e-3 / 1.5e-3)
