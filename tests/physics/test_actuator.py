import numpy as np
import pytest
from mpmath import mp, mpf

from biogrip.physics.gripper import (
    CombDrive,
    capacitance_slope,
    torque,
    torque_uncertainty,
    voltage,
)

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
    assert capacitance_slope(TABLE_2) == pytest.approx(float(expected), rel=1e-13)


@pytest.mark.parametrize(("torque_Nm", "printed_V"), [(1.6e-9, 17), (0.32e-9, 7)])
def test_operating_points_of_the_paper(torque_Nm: float, printed_V: float) -> None:
    """Section 3 says "about" 17 and 7 V: half of the last printed digit, and a little."""
    assert abs(float(voltage(TABLE_2, torque_Nm)) - printed_V) < 0.75


def test_voltage_inverts_torque_and_nothing_pushes() -> None:
    volts = np.linspace(0, 100, 11)
    np.testing.assert_allclose(voltage(TABLE_2, torque(TABLE_2, volts)), volts, rtol=1e-14)
    with pytest.raises(ValueError, match="only pulls"):
        voltage(TABLE_2, -1e-9)


def test_the_torque_is_as_uncertain_as_that_of_combs_that_vary() -> None:
    """Torques of combs drawn at random scatter so, to the standard error of 8000 draws."""
    rng = np.random.default_rng(3)
    volts, gap, height = 16.3, 0.06e-6, 0.8e-6
    drawn = [
        torque(
            CombDrive(40e-6 + height * z[0], 4e-6 - gap * z[1], 3e-6 + gap * z[1], *REST),
            volts * (1 + 0.01 * z[2]),
        )
        for z in rng.standard_normal((8000, 3))
    ]
    scatter = np.std(drawn) / float(torque(TABLE_2, volts))
    found = torque_uncertainty(TABLE_2, 0.01, gap, height)
    assert found == pytest.approx(scatter, rel=3 / np.sqrt(2 * len(drawn)))
    assert torque_uncertainty(TABLE_2, 0.01, 0.0, 0.0) == pytest.approx(0.02)
    assert torque_uncertainty(TABLE_2, 0.0, 0.0, height) == pytest.approx(0.02)
