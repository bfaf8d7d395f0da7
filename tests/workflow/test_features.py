"""Every kind of case comes to its results."""

import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml

from biogrip.experiment.protocol import hold, torque_history
from biogrip.experiment.sample import MODELS
from biogrip.instrument.gripper import Gripper
from biogrip.response.linear import rotation, step_response
from biogrip.study.source import read_config
from tests.helpers.default import study_of
from tests.helpers.in_process import inputs_and_outputs, make_in_process
from tests.helpers.pictures import assert_drawn, in_coarse_dots
from tests.helpers.places import ROOT
from tests.helpers.runs import built_once
from tests.test_instruments import OF_A_GRIPPER

pytestmark = pytest.mark.nightly

CASES = """
seeds: 2
genetic_algorithm: {population: 300, survivors: 150}
methods: [genetic]
least_squares: {candidates: 100, starts: 2}
identifiability: {coverage_seeds: 0}
model_selection: {models: [damper]}
measurement: {rate_Hz: 1.0, noise: {level: 0.01}}
cases:
  endothelial_cell: null
  liquid_drop_1: null
  liquid_drop_2: null
  silent:
    sample: {model: liquid_drop, k: 1.0, k_p: 0.1, c: 10.0}
    measurement: {noise: {level: 0, reference: signal}}
  kelvin_voigt: {sample: {model: kelvin_voigt, k_p: 0.05, c_p: 5.0}}
  maxwell: {sample: {model: maxwell, k: 2.0, c: 50.0}}
  zener: {sample: {model: zener_kelvin, k_s: 3.0, k_v: 2.0, c_v: 40.0}}
  burgers: {sample: {model: burgers, k_s: 3.0, c_s: 200.0, k_v: 2.0, c_v: 40.0}}
  branches:
    sample: {model: generalized_maxwell, branches: 2, k_1: 5.0, k_2: 2.0, k_p: 1.0, c_1: 9.0,
             c_2: 99.0, c_p: 0}
    fixed: {c_p: 0}
  sized: {sample: {model: liquid_drop, k: 1.0, k_p: 0.1, c: 10.0, size_m: 60e-6}}
  swinging:
    sample: {model: liquid_drop, k: 1.0, k_p: 0.1, c: 10.0}
    protocol:
      phases:
        - {duration_s: 50, voltage_V: 12, amplitude_V: 3, frequency_Hz: 0.1}
        - {duration_s: 50, torque_Nm: 1e-9, to_torque_Nm: 0}
  uneven:
    sample: {model: liquid_drop, k: 1.0, k_p: 0.1, c: 10.0}
    measurement:
      times_s: [0.1, 0.3, 1, 3, 9, 20, 50, 100, 200, 200.1, 200.3, 201, 203, 209, 220, 250, 400]
  nonlinear:
    sample: {model: liquid_drop, k: 1.0, k_p: 1e-3, c: 10.0}
    models: {target: nonlinear, identification: nonlinear}
    measurement: {rate_Hz: 0.5}
  calibrated:
    sample: {model: liquid_drop, k: 1.0, k_p: 0.1, c: 10.0}
    assumed_gripper: calibrated
  crept:
    instrument: creep
    sample: {model: zener_maxwell, k: 300.0, k_p: 200.0, c: 900.0}
    protocol: {phases: [{duration_s: 30, stress_Pa: 40}, {duration_s: 10, stress_Pa: 0}]}
  relaxed:
    instrument: relaxation
    sample: {model: springpot, k_alpha: 0.02, alpha: 0.3}
    protocol:
      phases:
        - {duration_s: 0.5, displacement_m: 0, to_displacement_m: 1.0e-6}
        - {duration_s: 39.5, displacement_m: 1.0e-6}
"""
NAMES = [name for name, case in yaml.safe_load(CASES)["cases"].items() if case]
NOISY = [name for name in NAMES if name != "silent"]
# The one has a panel a parameter, of which there are two to six.
FIGURES = {"fit": NAMES, "evolution": ["silent", "kelvin_voigt", "burgers", "branches"]}
# One of each kind; a trace of the nonlinear model would take minutes.
JUDGED = (
    "silent",
    "kelvin_voigt",
    "burgers",
    "branches",
    "swinging",
    "uneven",
    "calibrated",
    "crept",
    "relaxed",
)
WANTED = [
    *(f"results/figures/{figure}_{name}.png" for figure, of in FIGURES.items() for name in of),
    *(f"results/tables/errors_{name}.csv" for name in NAMES),
    *(f"results/tables/verdicts_{name}.csv" for name in JUDGED),
    *(f"results/figures/{figure}_silent.png" for figure in ("profiles", "scatter")),
    "results/figures/moduli.png",
    *(f"results/summaries/{name}.html" for name in ("silent", "crept", "relaxed")),
]


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory, worker_id: str) -> Path:
    folder = built_once("features", made, tmp_path_factory, worker_id)
    return folder / "results"


def made(folder: Path) -> None:
    with in_coarse_dots():
        make_in_process(folder, study_of(CASES), WANTED)


@pytest.mark.parametrize("name", NAMES)
def test_a_case_has_its_results(study: Path, name: str) -> None:
    for figure in (figure for figure, names in FIGURES.items() if name in names):
        assert_drawn(study / "figures" / f"{figure}_{name}.png")
    errors = pd.read_csv(study / "tables" / f"errors_{name}.csv")
    assert errors["typical_identified"].notna().all()
    found = pd.read_csv(study / "identifications" / f"{name}.csv")
    assert len(found) == 2
    if name in NOISY:
        # Misfits end near the 1 % noise, not near the signal, a hundred times that.
        assert np.all(found["misfit"] < 8 * found["noise_rms"])


def test_without_noise_all_is_determined_and_drawn(study: Path) -> None:
    found = pd.read_csv(study / "tables" / "verdicts_silent.csv")
    assert set(found["expected_verdict"]) == {"determined"}
    assert_drawn(study / "figures" / "moduli.png")
    for figure in ("profiles", "scatter"):
        assert (study / "figures" / f"{figure}_silent.png").exists()


@pytest.mark.parametrize(("name", "unit"), [("crept", "Pa"), ("relaxed", "N/m")])
def test_cases_of_other_instruments_stand_beside_those_of_the_gripper(
    study: Path, name: str, unit: str
) -> None:
    found = pd.read_csv(study / "tables" / f"verdicts_{name}.csv")
    assert set(found["expected_verdict"]) == {"determined"}
    assert found["unit"].str.startswith(unit).any()
    page = (study / "summaries" / f"{name}.html").read_text(encoding="utf-8")
    words = re.sub(r'"data:[^"]*"|<style.*?</style>', "", page, flags=re.DOTALL)
    assert not OF_A_GRIPPER.search(words), OF_A_GRIPPER.search(words)
    beside = (study / "summaries" / "silent.html").read_text(encoding="utf-8")
    assert "take the gripper as exact" in beside


def test_what_is_fixed_stays(study: Path) -> None:
    assert np.all(pd.read_csv(study / "identifications" / "branches.csv")["c_p_Ns_per_m"] == 0)


def test_nonlinear_targets_differ_from_linear_ones_as_the_model_says(
    study: Path, gripper: Gripper
) -> None:
    """By some 1e-4 of the peak at 75 degrees and the paper's torque."""
    target = pd.read_csv(study / "targets" / "nonlinear.csv")
    linear = rotation(
        step_response(gripper, MODELS["liquid_drop"].network([1, 1e-3, 10])),
        torque_history((hold(200.0, 1.6e-9), hold(200.0, 0.32e-9))),
        target["time_s"].to_numpy(float),
    )[0]
    difference = np.abs(target["rotation_rad"] - linear).max() / linear.max()
    assert 1e-4 < difference < 1e-3


def test_a_calibrated_gripper_can_be_laid_over_a_study(study: Path) -> None:
    text = (study / "calibrations" / "calibrated.yaml").read_text()
    block = yaml.safe_load(text)["gripper"]
    laid_over = study_of(text).gripper
    for name, arm in (("left", laid_over.left), ("right", laid_over.right)):
        found = block[name]["stiffness_Nm_per_rad"]
        assert arm.stiffness_Nm_per_rad == found
        uncertainty = block["uncertainty"][name]["stiffness_Nm_per_rad"]
        assert 0 < abs(found - 4.4e-7) < 5 * uncertainty


CONFIGS = sorted((ROOT / "config").glob("*.yaml"))


@pytest.mark.parametrize("file", CONFIGS, ids=lambda file: file.stem)
def test_shipped_configurations_are_valid(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """All that they ask for can be made: what is read is made, too, or is there."""
    assert len(CONFIGS) >= 3
    monkeypatch.chdir(ROOT)
    inputs, outputs = inputs_and_outputs(study_of(yaml.safe_dump(read_config(file))))
    assert len(outputs) > 50
    assert [read for read in inputs - outputs if not Path(read).is_file()] == []
