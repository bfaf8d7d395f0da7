"""The gripper and its limits: its uncertainty in what is said, and samples far stiffer or softer.

So are ranges, which follow from a trace.
"""

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.identify.prepare import for_trace, ranges_of
from biogrip.library import simulate
from biogrip.traces.columns import Columns
from biogrip.traces.reader import recording_of_arrays
from tests.helpers.default import STUDY, study_of

CASE = STUDY.cases["liquid_drop_2"]
TIMES = np.linspace(0.0, 400.0, 801)


def simulated(parameters: dict[str, float]) -> Array:
    """A trace with noise of 1 % of its peak."""
    clean = simulate(CASE.experiment, parameters, TIMES)
    return clean + 0.01 * clean.max() * np.random.default_rng(1).standard_normal(len(TIMES))


def test_a_torque_is_uncertain_by_percent() -> None:
    study = study_of("gripper: {uncertainty: {torque_percent: 3.0, left: {inertia_kgm2: 1e-15}}}")
    expected = {"left": {"inertia_kgm2": 1e-15}, "torque": {"share": 0.03}}
    assert study.case("liquid_drop_1").experiment.uncertainty == expected


def test_the_size_of_a_sample_sets_the_angle_at_which_it_is_met() -> None:
    """From 150 to 30 um each jaw moves by 60 um, on a circle of 1.5 mm."""
    case = study_of("cases: {liquid_drop_2: {sample: {size_m: 30e-6}}}").case("liquid_drop_2")
    angle = np.degrees(np.arccos(np.cos(np.radians(75)) + 60e-6 / 1.5e-3))
    assert case.experiment.gripper.reference_angle_deg == pytest.approx(angle)


def test_ranges_follow_from_a_trace_and_given_ones_stay() -> None:
    case = study_of("search_range: {c: {exponent: [-4, 8]}}").case("liquid_drop_2")
    columns = Columns("time_s", "rotation_rad")
    trace = recording_of_arrays(columns, TIMES, 1e-3 * simulated(CASE.parameters))
    ranges = for_trace(case.judged_experiment, trace).ranges
    of_trace = ranges_of(case.experiment, TIMES, trace.readings)
    assert ranges["k"] == of_trace["k"] != STUDY.ranges["k"]
    assert ranges["c"].exponent == (-4, 8)


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
