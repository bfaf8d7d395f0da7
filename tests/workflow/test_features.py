"""Every kind of case runs through the whole workflow."""

import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml

from tests.workflow.conftest import ROOT, snakemake

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
  calibrated:
    sample: {model: liquid_drop, k: 1.0, k_p: 0.1, c: 10.0}
    assumed_gripper: calibrated
"""
NAMES = [name for name, case in yaml.safe_load(CASES)["cases"].items() if case]
FIGURES = ("fit", "evolution")
# One of each kind; a trace of the nonlinear model would take minutes.
JUDGED = ("kelvin_voigt", "burgers", "branches", "swinging", "uneven", "calibrated")
WANTED = [
    *(f"results/figures/{figure}_{name}.png" for figure in FIGURES for name in NAMES),
    *(f"results/tables/errors_{name}.csv" for name in NAMES),
    *(f"results/tables/verdicts_{name}.csv" for name in JUDGED),
]


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("features")
    run = snakemake(folder, *WANTED, config=CASES)
    assert run.status == 0, run.output
    return folder / "results"


@pytest.mark.parametrize("name", NAMES)
def test_a_case_has_its_results(study: Path, name: str) -> None:
    for figure in FIGURES:
        assert (study / "figures" / f"{figure}_{name}.png").stat().st_size > 5000
    errors = pd.read_csv(study / "tables" / f"errors_{name}.csv")
    assert errors["best_identified"].notna().all()
    found = pd.read_csv(study / "identifications" / f"{name}.csv")
    assert len(found) == 2
    # Misfits end near the 1 % noise, not near the signal, a hundred times that.
    assert np.all(found["misfit_rad"] < 8 * found["noise_rms_rad"])


def test_what_is_fixed_stays(study: Path) -> None:
    assert np.all(pd.read_csv(study / "identifications" / "branches.csv")["c_p_Ns_per_m"] == 0)


def test_nonlinear_targets_differ_from_linear_ones_as_the_model_says(study: Path) -> None:
    """By some 1e-4 of the peak at 75 degrees and the paper's torque."""
    from biogrip.experiment.protocol import held, torque_history
    from biogrip.experiment.sample import MODELS
    from biogrip.instrument.gripper import Arm, Gripper
    from biogrip.response.linear import rotation, step_response

    target = pd.read_csv(study / "targets" / "nonlinear.csv")
    arm = Arm(1.0e-14, 3.3e-12, 4.4e-7)
    linear = rotation(
        step_response(
            Gripper(1.5e-3, 75.0, arm, arm), MODELS["liquid_drop"].network([1, 1e-3, 10])
        ),
        torque_history((held(200.0, 1.6e-9), held(200.0, 0.32e-9))),
        target["time_s"].to_numpy(float),
    )[0]
    difference = np.abs(target["rotation_rad"] - linear).max() / linear.max()
    assert 1e-4 < difference < 1e-3


def test_a_calibrated_gripper_can_be_laid_over_a_study(study: Path, tmp_path: Path) -> None:
    calibrated = study / "calibrations" / "calibrated.yaml"
    shutil.copy(calibrated, tmp_path / "gripper.yaml")
    run = snakemake(tmp_path, "-n", "results/tables/gripper.csv", config=calibrated.read_text())
    assert run.status == 0, run.output
    block = yaml.safe_load(calibrated.read_text())["gripper"]
    for arm in ("left", "right"):
        error = abs(block[arm]["stiffness_Nm_per_rad"] - 4.4e-7)
        assert error < 5 * block["uncertainty"][arm]["stiffness_Nm_per_rad"]


def test_shipped_configurations_are_valid(tmp_path: Path) -> None:
    shutil.copytree(ROOT / "data", tmp_path / "data")
    for file in (ROOT / "config").glob("*.yaml"):
        run = snakemake(tmp_path, "-n", config=file.read_text())
        assert run.status == 0, run.output
