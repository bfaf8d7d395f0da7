"""The gripper in what `biogrip identify` says: its uncertainty, and samples far stiffer."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.cli import main
from biogrip.physics.gripper import voltage
from biogrip.physics.simulation import simulated_rotation
from tests.helpers.default import STUDY

FEW = """
least_squares: {candidates: 200, starts: 6}
model_selection: {models: [maxwell, burgers]}
"""
STATISTICAL = "Limits are statistical only: the gripper is taken as exact."
CASE = STUDY.cases["liquid_drop_2"]
TIMES = np.linspace(0.0, 400.0, 801)
# Torques of the default study, as voltages.
VOLTS = [float(voltage(STUDY.actuator, torque)) for torque in (1.6e-9, 0.32e-9)]
PHASES = ", ".join(f"{{duration_s: 200.0, voltage_V: {volts!r}}}" for volts in VOLTS)
IN_VOLTS = f"protocol: {{phases: [{PHASES}]}}\n"


def simulated(parameters: dict[str, float], torque: float = 1.0, length: float = 1.0) -> Array:
    problem = CASE.problem
    gripper = replace(problem.gripper, arm_length_m=length * problem.gripper.arm_length_m)
    sample, history = problem.searched.sample(parameters), problem.torque.times(torque)
    return simulated_rotation(gripper, sample, history, TIMES, nonlinear=False)[0]


def identified(folder: Path, trace: Array, config: str, *options: str) -> tuple[int, Path]:
    file, output, settings = folder / "a.csv", folder / "a.json", folder / "a.yaml"
    rows = np.column_stack((TIMES, trace))
    np.savetxt(file, rows, delimiter=",", header="time_s,rotation_rad", comments="")
    settings.write_text(FEW + config)
    arguments = ["--config", str(settings), "--output", str(output), *options]
    return main(["identify", str(file), *arguments]), output


def noisy(clean: Array) -> Array:
    noise: Array = 0.01 * clean.max() * np.random.default_rng(1).standard_normal(len(TIMES))
    return clean + noise


@pytest.mark.nightly
def test_limits_hold_the_truth_of_a_wrong_gripper_only_with_its_uncertainty(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Arms 7 % too long and a torque 8 % too large: some 1.5 standard uncertainties each."""
    trace = noisy(simulated(CASE.parameters, torque=1.08, length=0.93))
    told: dict[str, Any] = {}
    uncertain = "gripper: {uncertainty: {arm_length_m: 7.5e-5, "
    configs = {
        "exact": "",
        "torque": f"{uncertain}torque_percent: 5}}}}\n",
        "comb": f"{uncertain}finger_gap_m: 0.05e-6, voltage_percent: 2.4}}}}\n{IN_VOLTS}",
    }
    for name, config in configs.items():
        page = tmp_path / "a.html"
        status, output = identified(tmp_path, trace, config, "--report", str(page))
        assert status == 0
        told[name] = json.loads(output.read_text())
        for said in (capsys.readouterr().out, page.read_text()):
            assert said.count(told[name]["limits"]) == (told[name]["fit"] != "rejected")
    assert told["exact"]["limits"] == STATISTICAL
    assert "gripper" in told["torque"]["by_default"]
    assert told["torque"]["limits"] == told["comb"]["limits"]
    assert told["comb"]["limits"].endswith("gripper.arm_length_m, torque.")
    truth = CASE.parameters["c"] + CASE.parameters["c_p"]
    for name, found in told.items():
        held = next(q for q in found["quantities"] if q["quantity"] == "c + c_p")
        assert ((held["low"] or np.inf) < truth < (held["high"] or 0.0)) == (name != "exact")
        assert found["fit"] == ("rejected" if name == "exact" else "ok")
    # No model is asked for in place of the gripper's error.
    assert "not adequate" not in told["comb"]["advice"]


def test_a_stiff_sample_is_identified_where_the_noise_is_given(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    stiff = {"k": 2e4, "k_p": 1e4, "c": 1e6, "c_p": 1.0}
    trace = noisy(simulated(stiff))
    assert identified(tmp_path, trace, "")[0] != 0
    assert "or less with a given noise (--noise)" in capsys.readouterr().err
    noise = f"{0.01 * trace.max():.3g}"
    status, output = identified(tmp_path, trace, "", "--noise", noise)
    found = json.loads(output.read_text())
    assert status == 0
    assert found["fit"] == "ok"
    assert any("the sample is very stiff" in note["text"] for note in found["notes"])
    quantities = {each["quantity"]: each for each in found["quantities"]}
    for name in ("k", "k_p", "c"):
        assert quantities[name]["verdict"] == "determined"
        # Limits are 1 % apart from the estimate, or less.
        assert quantities[name]["value"] == pytest.approx(stiff[name], rel=0.02)
