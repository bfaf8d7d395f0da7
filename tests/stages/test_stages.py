import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from biogrip.errors import BiogripError
from biogrip.physics.instruments import GRIPPER
from biogrip.physics.models import Sample
from biogrip.physics.protocol import Phase, hold, join_phases, sample_times
from biogrip_study.records.traces import read_measurements, read_target
from biogrip_study.stages import targets as target
from biogrip_study.stages.identification import experiment_for
from biogrip_study.stages.judgement import expect
from tests.helpers.default import STUDY, seen, study_of
from tests.helpers.places import EXAMPLE


def drop(torque_Nm: float, *more: Phase, contact: str | None = None) -> Any:
    torque, sample = join_phases((hold(100.0, torque_Nm), *more)), Sample("maxwell")
    device = {"instrument": GRIPPER, "gripper": STUDY.gripper, "stroke": 0.0785}
    held = {"torque": torque, "times_s": sample_times(torque.end_s, 1.0)}
    held |= {"block": seen(contact=contact)}
    known = {"name": "Drop", "sample": sample, "nonlinear_target": False, **device, **held}
    return seen(network=sample.model.network([1.0, 1.0]), **known)


def test_arms_cannot_turn_further_than_their_combs(tmp_path: Path) -> None:
    said = r"turns the arms by 90.\d+ mrad, allowed is .* 78.5 mrad"
    with pytest.raises(BiogripError, match=said):
        target.simulate_target(drop(4e-8), tmp_path / "t.csv")
    assert not list(tmp_path.iterdir())
    target.simulate_target(drop(3e-8), tmp_path / "t.csv")


def test_a_protocol_that_makes_the_jaws_pull_is_warned_of(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "t.csv"
    target.simulate_target(drop(1e-9), file)
    assert capsys.readouterr().out == ""
    target.simulate_target(drop(1e-9, hold(100.0, 1e-10)), file)
    said = capsys.readouterr()
    assert "biogrip: warning: Drop: under this protocol the jaws would have to pull" in said.out
    assert "from 100 s on" in said.err
    time_s = drop(1e-9, hold(100.0, 1e-10)).times_s
    force = pd.read_csv(file)["jaw_force_N"].to_numpy()
    assert np.all(force[time_s < 100] >= 0)
    assert force[time_s > 100].max() < 0
    target.simulate_target(drop(1e-9, hold(100.0, 1e-10), contact="unilateral"), file)
    assert "contact is lost there, which its identification ignores" in capsys.readouterr().out
    force = pd.read_csv(file)["jaw_force_N"].to_numpy()
    assert np.all(force[time_s > 100] == 0)
    # Left to their hinges, the arms open at once.
    rotation = read_target(file, time_s)[2]
    np.testing.assert_allclose(rotation[time_s > 100], 1e-10 / 4.4e-7, rtol=1e-8)


def test_all_stages_weight_the_readings_of_a_recorded_trace(tmp_path: Path) -> None:
    keys = f"{{file: {EXAMPLE}, time: time_s, rotation: rotation_rad, noise_share: 0.1}}"
    mine = f"cases: {{mine: {{sample: {{model: liquid_drop}}, measurement: {keys}}}}}"
    case = study_of(mine).cases["mine"]
    target.record(case, EXAMPLE, tmp_path / "t.npz")
    found = experiment_for(case.experiment, read_measurements(tmp_path / "t.npz", [0]))
    assert found.sd is not None
    assert found.noise_sd == pytest.approx(np.sqrt(np.mean(found.sd**2)))


def test_without_noise_the_fit_is_the_truth_and_not_the_rounding_of_digits(tmp_path: Path) -> None:
    case, file = STUDY.case("endothelial_cell"), tmp_path / "expected.json"
    target.simulate_target(case, tmp_path / "target.csv")
    expect(case, tmp_path / "target.csv", file)
    found = json.loads(file.read_text())
    values = {each["quantity"]: each["value"] for each in found["quantities"]}
    # The damper that is not there has the lower end of its search range.
    assert values == {"k": 35.0, "k_p": 12.3, "c": 299.9, "c_p": 0.001, "c + c_p": 299.9}
    assert found["fit"] == "ok"


def test_of_a_target_of_another_sample_its_parameters_are_expected(tmp_path: Path) -> None:
    """Not those that the case is said to have, which fit it worse, by less than profiles show."""
    case, file = STUDY.case("endothelial_cell"), tmp_path / "expected.json"
    stiffer = study_of("cases: {endothelial_cell: {sample: {k: 35.2}}}").case("endothelial_cell")
    target.simulate_target(stiffer, tmp_path / "target.csv")
    expect(case, tmp_path / "target.csv", file)
    values = {row["quantity"]: row["value"] for row in json.loads(file.read_text())["quantities"]}
    # Fits leave out the inertia that targets have; 35.0 is off by 6e-3.
    assert values["k"] == pytest.approx(35.2, rel=3e-3)
    assert values["k_p"] == pytest.approx(12.3, rel=1e-3)
