import math

import pytest

from biogrip.physics.contact import apparent_modulus


@pytest.mark.parametrize(("size_m", "strain"), [(30e-6, 0.02), (120e-6, 0.1)])
def test_against_the_pressure_in_the_contact(size_m: float, strain: float) -> None:
    """Hertz' pressure p_0 sqrt(1 - r^2/a^2) with p_0 = 2 E* a/(pi R), summed over the contact."""
    modulus, radius, indentation = 1234.0, size_m / 2, strain * size_m / 2
    effective = modulus / (1 - 0.5**2)
    a = math.sqrt(radius * indentation)
    p_0 = 2 * effective * a / (math.pi * radius)
    force = 2 / 3 * p_0 * math.pi * a**2
    assert apparent_modulus(force, strain * size_m, size_m) == pytest.approx(modulus, rel=1e-12)


def test_a_compressible_sphere_is_of_a_stiffer_material() -> None:
    ours = (apparent_modulus(1e-6, 1e-6, 50e-6, nu) for nu in (0.5, 0.0))
    assert next(ours) == pytest.approx(0.75 * next(ours))
