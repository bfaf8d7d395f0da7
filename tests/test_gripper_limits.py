"""The gripper and its limits: its uncertainty in what is said, and samples far stiffer or softer.

So are ranges, which follow from a trace.
"""

from dataclasses import replace

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.errors import BiogripError
from biogrip.identify.prepare import ranges_of
from biogrip.library import set_up, simulate
from biogrip.physics.gripper import Arm, Gripper
from biogrip.physics.models import Sample
from biogrip.physics.protocol import hold
from tests.helpers.default import STUDY, study_of
from tests.helpers.identified import told

CASE = STUDY.cases["liquid_drop_2"]
TIMES = np.linspace(0.0, 400.0, 801)


def simulated(parameters: dict[str, float], torque: float = 1.0, length: float = 1.0) -> Array:
    """A trace with noise of 1 % of its peak."""
    problem = CASE.experiment
    gripper = replace(problem.gripper, arm_length_m=length * problem.gripper.arm_length_m)
    phases = tuple(hold(200.0, torque * torque_Nm) for torque_Nm in (1.6e-9, 0.32e-9))
    clean = simulate(set_up(gripper, phases, problem.sample), parameters, TIMES)
    return clean + 0.01 * clean.max() * np.random.default_rng(1).standard_normal(len(TIMES))


def test_a_torque_is_uncertain_by_percent() -> None:
    study = study_of("gripper: {uncertainty: {torque_percent: 3.0, left: {inertia_kgm2: 1e-15}}}")
    expected = {"left": {"inertia_kgm2": 1e-15}, "torque": {"share": 0.03}}
    assert study.case("liquid_drop_1").experiment.uncertainty == expected


def test_a_stiff_sample_is_identified_where_the_noise_is_given() -> None:
    stiff = {"k": 2e4, "k_p": 1e4, "c": 1e6, "c_p": 1.0}
    trace = simulated(stiff)
    with pytest.raises(BiogripError, match=r"or less with a given noise \(noise\)"):
        told(TIMES, trace)
    found = told(TIMES, trace, noise=0.01 * trace.max())
    assert found.status == "ok"
    assert "the sample is very stiff" in str(found)
    for name in ("k", "k_p", "c"):
        quantity = found.to_frame().loc[name]
        assert quantity["verdict"] == "determined"
        # Limits are 1 % apart from the estimate, or less.
        assert quantity["value"] == pytest.approx(stiff[name], rel=0.02)


@pytest.mark.nightly
def test_the_size_of_a_sample_sets_the_angle_at_which_it_is_met() -> None:
    """A trace tells stiffnesses times the square of the sine: smaller samples seem stiffer."""
    trace = simulated(CASE.parameters)
    unsized, sized = (
        told(TIMES, trace, model="liquid_drop", config={"sample": own}).to_frame()["value"]
        for own in ({}, {"size_m": 30e-6})
    )
    # From 150 to 30 um each jaw moves by 60 um, on a circle of 1.5 mm.
    angle = np.arccos(np.cos(np.radians(75)) + 60e-6 / 1.5e-3)
    ratio = (np.sin(angle) / np.sin(np.radians(75))) ** 2
    for name in ("k_p", "c"):
        assert unsized[name] / sized[name] == pytest.approx(ratio, rel=1e-3)


# Creep of polystyrene, in Pa and Pa s, as of a gripper: jaws of l = b at 90 degrees whose arms have
# 0.25 % of the sample's stiffness.
K_P, C = 5.26e3, 8.7e7
LEVER_M, DURATION_S, TORQUE_NM, NOISE_RAD = 1.5e-3, 3e4, 2.7e-5, 1e-5
ARM = {
    "inertia_kgm2": 1e-14,
    "damping_Nms_per_rad": 1e-9,
    "stiffness_Nm_per_rad": 0.0025 * K_P * 2 * LEVER_M**2,
}
POLYSTYRENE = {
    "gripper": {"arm_length_m": LEVER_M, "reference_angle_deg": 90.0, "left": ARM, "right": ARM},
    "protocol": {"phases": [{"duration_s": DURATION_S, "torque_Nm": TORQUE_NM}]},
}


@pytest.mark.nightly
def test_ranges_hold_samples_beyond_those_of_the_paper_and_given_ones_stay() -> None:
    given = {name: {"exponent": [-4, 8]} for name in ("c", "c_p")}
    gripper = Gripper(LEVER_M, 90.0, Arm(**ARM), Arm(**ARM))
    problem = set_up(gripper, (hold(DURATION_S, TORQUE_NM),), Sample("generalized_maxwell"))
    times = np.geomspace(1.0, DURATION_S, 200)
    clean = simulate(problem, {"k": 1e6, "k_p": K_P, "c": C, "c_p": 1e3}, times)
    noise = NOISE_RAD * np.random.default_rng(1).standard_normal(len(times))
    found = told(times, clean + noise, config={**POLYSTYRENE, "search_range": given})
    assert found.diagnosis.experiment is not None
    ranges = found.diagnosis.experiment.ranges
    assert ranges["k"].exponent != (-3, 8)
    assert ranges["c"].exponent == ranges["c_p"].exponent == (-4, 8)
    assert found.status == "ok"
    for name, truth in (("k_p", K_P), ("c + c_p", C + 1e3)):
        own = found.to_frame().loc[name]
        assert own["verdict"] == "determined"
        assert own["low"] < truth < own["high"]


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
    for name, genes in ranges_of(problem, time_s, simulated + noise).items():
        for end, beyond in ((genes.low, 1e-3), (genes.high, 1e3)):
            change = response(**{name: end}) - response(**{name: end * beyond})
            assert np.linalg.norm(change) < noise_sd, (name, end)
