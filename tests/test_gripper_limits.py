import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.identify.prepare import ranges_of
from biogrip.library import simulate
from tests.helpers.default import STUDY, study_of


def test_a_torque_is_uncertain_by_percent_and_a_size_sets_the_angle() -> None:
    """From 150 to 30 um each jaw moves by 60 um, on a circle of 1.5 mm."""
    text = "{gripper: {uncertainty: {torque_percent: 3.0, left: {inertia_kgm2: 1e-15}}}, "
    text += "cases: {liquid_drop_2: {sample: {size_m: 30e-6}}}}"
    found = study_of(text).case("liquid_drop_2").experiment
    assert found.uncertainty == {"left": {"inertia_kgm2": 1e-15}, "torque": {"share": 0.03}}
    angle = np.degrees(np.arccos(np.cos(np.radians(75)) + 60e-6 / 1.5e-3))
    assert found.gripper.reference_angle_deg == pytest.approx(angle)


@pytest.mark.parametrize("case", ["endothelial_cell", "liquid_drop_1", "liquid_drop_2"])
def test_elements_at_the_ends_of_ranges_do_not_show(case: str) -> None:
    """A spring or damper beyond either end is as good as absent, or rigid: less than the noise."""
    chosen = STUDY.cases[case]
    problem, time_s = chosen.experiment, chosen.times_s

    def response(**changes: float) -> Array:
        return simulate(problem, {**chosen.parameters, **changes}, time_s)

    simulated = response()
    noise_sd = 0.1 * simulated.max()
    noise = noise_sd * np.random.default_rng(2).standard_normal(len(time_s))
    ranges = ranges_of(problem, time_s, simulated + noise)
    for name, genes in ((name, ranges[name]) for name in chosen.parameters):
        for end, beyond in ((genes.low, 1e-3), (genes.high, 1e3)):
            change = response(**{name: end}) - response(**{name: end * beyond})
            assert np.linalg.norm(change) < noise_sd, (name, end)
