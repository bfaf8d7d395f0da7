"""The gripper in what `biogrip identify` says: its uncertainty, and samples far stiffer."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from biogrip.physics.simulation import simulated_rotation
from tests.helpers.default import STUDY
from tests.helpers.identified import by_quantity, identified, identify, write_trace

FEW = """
least_squares: {candidates: 200, starts: 6}
model_selection: {models: [maxwell, burgers]}
"""
CASE = STUDY.cases["liquid_drop_2"]
TIMES = np.linspace(0.0, 400.0, 801)


def simulated(
    folder: Path, parameters: dict[str, float], torque: float = 1.0, length: float = 1.0
) -> Path:
    """Write a trace with noise of 1 % of its peak."""
    problem = CASE.problem
    gripper = replace(problem.gripper, arm_length_m=length * problem.gripper.arm_length_m)
    sample, history = problem.searched.sample(parameters), problem.torque.times(torque)
    clean = simulated_rotation(gripper, sample, history, TIMES, nonlinear=False)[0]
    noise = 0.01 * clean.max() * np.random.default_rng(1).standard_normal(len(TIMES))
    return write_trace(folder / "a.csv", TIMES, clean + noise)


@pytest.mark.nightly
def test_limits_hold_the_truth_of_a_wrong_gripper_only_with_its_uncertainty(tmp_path: Path) -> None:
    """Arms 7 % too long and a torque 8 % too large: some 1.5 standard uncertainties each."""
    trace = simulated(tmp_path, CASE.parameters, torque=1.08, length=0.93)
    configs = {
        "exact": "",
        "torque": "gripper: {uncertainty: {arm_length_m: 7.5e-5, torque_percent: 5}}\n",
    }
    told = {name: identified(tmp_path, trace, config=FEW + own) for name, own in configs.items()}
    assert told["exact"]["limits"].startswith("Limits are statistical only")
    assert told["torque"]["limits"].endswith("gripper.arm_length_m, torque.")
    truth = CASE.parameters["c"] + CASE.parameters["c_p"]
    for name, found in told.items():
        held = by_quantity(found)["c + c_p"]
        assert ((held["low"] or np.inf) < truth < (held["high"] or 0.0)) == (name != "exact")
        assert found["fit"] == ("rejected" if name == "exact" else "ok")
    # No model is asked for in place of the gripper's error.
    assert "not adequate" not in told["torque"]["advice"]


def test_a_stiff_sample_is_identified_where_the_noise_is_given(tmp_path: Path) -> None:
    stiff = {"k": 2e4, "k_p": 1e4, "c": 1e6, "c_p": 1.0}
    trace = simulated(tmp_path, stiff)
    status, _, complained = identify(trace)
    assert status != 0
    assert "or less with a given noise (--noise)" in complained
    peak = np.loadtxt(trace, delimiter=",", skiprows=1)[:, 1].max()
    found = identified(tmp_path, trace, "--noise", f"{0.01 * peak:.3g}", config=FEW)
    assert found["fit"] == "ok"
    assert any("the sample is very stiff" in note["text"] for note in found["notes"])
    for name in ("k", "k_p", "c"):
        quantity = by_quantity(found)[name]
        assert quantity["verdict"] == "determined"
        # Limits are 1 % apart from the estimate, or less.
        assert quantity["value"] == pytest.approx(stiff[name], rel=0.02)
