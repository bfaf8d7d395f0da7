import pytest

from biogrip.physics.sample_model import inverse_of, per_second_of, suffix_of

# Stiffness, damping, compliance, slope of a compliance, and ends of columns of the first two.
UNITS = [
    ("N/m", "N s/m", "m/N", "m/(N s)", "_N_per_m", "_Ns_per_m"),
    ("Pa", "Pa s", "1/Pa", "1/(Pa s)", "_Pa", "_Pa_s"),
    ("N m/rad", "N m s/rad", "rad/(N m)", "rad/(N m s)", "_Nm_per_rad", "_Nms_per_rad"),
    ("", "s", "", "1/s", "", "_s"),
]


@pytest.mark.parametrize("named", UNITS, ids=lambda named: named[0])
def test_units_of_a_sample_follow_from_that_of_its_stiffness(named: tuple[str, ...]) -> None:
    stiffness, damping, compliance, slope, *ends = named
    assert per_second_of(stiffness) == damping
    assert (inverse_of(stiffness), inverse_of(damping)) == (compliance, slope)
    assert [suffix_of(stiffness), suffix_of(damping)] == ends
