import copy
import re
from pathlib import Path
from typing import Any

import pytest
import yaml
from biogrip.products.digest import digest

from biogrip.errors import BiogripError
from biogrip.experiment.noise import Noise
from biogrip.instrument.actuator import torque
from biogrip.study.load import load_study
from biogrip.study.study import Study
from biogrip.tables import coverage
from tests.helpers.default import study_of

DEFAULT = Path(__file__).parents[2] / "config" / "config.yaml"
DROP = "sample: {model: liquid_drop, k: 1.0, k_p: 1.0, c: 1.0}"


def overlaid(base: Any, over: Any) -> Any:
    """Lay a config over another, as Snakemake does."""
    if isinstance(base, dict) and isinstance(over, dict):
        return {**base, **{k: overlaid(base.get(k), v) for k, v in over.items()}}
    return over


def load(tmp_path: Path, text: str) -> Study:
    file = tmp_path / "my.yaml"
    file.write_text(text)
    merged = overlaid(yaml.safe_load(DEFAULT.read_text()), yaml.safe_load(text))
    return load_study(merged, [DEFAULT, file])


def test_the_default_study_holds_the_papers_targets() -> None:
    study = load_study(yaml.safe_load(DEFAULT.read_text()), [DEFAULT])
    targets = {name: case.parameters for name, case in study.cases.items()}
    assert targets == {
        "endothelial_cell": {"k": 35.0, "k_p": 12.3, "c": 299.9, "c_p": 1e-3},
        "liquid_drop_1": {"k": 9.5, "k_p": 1e-4, "c": 10.0, "c_p": 1e-4},
        "liquid_drop_2": {"k": 1.0, "k_p": 1e-4, "c": 10.0, "c_p": 1e-3},
    }
    assert [case.seeds for case in study.cases.values()] == [50, 50, 50]


def test_a_case_is_one_block_and_yaml_1_1_numbers_are_numbers(tmp_path: Path) -> None:
    study = load(
        tmp_path,
        """
        seeds: 50
        cases:
          my_cell:
            sample: {model: generalized_maxwell, k: 20.0, k_p: 5.0, c: 80.0, c_p: 1e-3}
        """,
    )
    assert list(study.cases)[-1] == "my_cell"
    case = study.cases["my_cell"]
    assert case.parameters["c_p"] == 0.001
    assert case.title == "my_cell"
    other = study.cases["endothelial_cell"]
    sample = other.block.sample
    changes = {"sample": sample, "title": None, "published": None}
    blocks = [c.block.model_copy(update=changes) for c in (case, other)]
    assert blocks[0] == blocks[1]


def test_text_numbers_work_for_whole_numbers_too(tmp_path: Path) -> None:
    assert load(tmp_path, "seeds: 1e2").cases["endothelial_cell"].seeds == 100


def test_a_case_may_change_a_block_for_itself(tmp_path: Path) -> None:
    study = load(
        tmp_path,
        f"cases: {{soft: {{{DROP}, gripper: {{left: {{stiffness_Nm_per_rad: 1.0e-7}}}}}}}}",
    )
    arms = study.cases["soft"].block.gripper
    assert arms.left.stiffness_Nm_per_rad == 1e-7
    assert arms.right.stiffness_Nm_per_rad == 4.4e-7
    other = study.cases["endothelial_cell"].block.gripper
    assert other.left.stiffness_Nm_per_rad == 4.4e-7


@pytest.mark.parametrize("name", ["unit", "title", "label", "error_percent"])
def test_a_case_may_have_the_name_of_a_key(tmp_path: Path, name: str) -> None:
    sample = "{model: generalized_maxwell, k: 2e1, k_p: 5.0, c: 80.0, c_p: 1e-3}"
    study = load(tmp_path, f"cases: {{{name}: {{sample: {sample}, title: 1e-3 of it}}}}")
    assert study.cases[name].parameters["c_p"] == 1e-3
    assert study.cases[name].title == "1e-3 of it"


def test_text_that_is_like_a_number_stays_text(tmp_path: Path) -> None:
    assert load(tmp_path, f"cases: {{x: {{{DROP}, title: 1e-3}}}}").cases["x"].title == "1e-3"


def test_more_jobs_than_can_be_planned_are_refused(tmp_path: Path) -> None:
    with pytest.raises(BiogripError, match=r"line 2: batch_size: found 1, which makes 20000 seeds"):
        load(tmp_path, "seeds: 20000\nbatch_size: 1")


def test_a_case_set_to_nothing_is_dropped(tmp_path: Path) -> None:
    study = load(tmp_path, f"cases: {{liquid_drop_1: null, drop: {{{DROP}}}}}")
    assert list(study.cases) == ["endothelial_cell", "liquid_drop_2", "drop"]


def test_a_study_has_only_the_cases_that_it_names(tmp_path: Path) -> None:
    study = load(tmp_path, f"only: [drop]\ncases: {{drop: {{{DROP}}}}}")
    assert list(study.cases) == ["drop"]
    two = load(tmp_path, f"only: [drop, liquid_drop_1]\ncases: {{drop: {{{DROP}}}}}")
    assert list(two.cases) == ["drop", "liquid_drop_1"]


BAD = {
    "only: [liquid_drop_3]": r"my.yaml, line 1: only\[0\]: found 'liquid_drop_3', allowed are "
    r"endothelial_cell, liquid_drop_1, liquid_drop_2. Did you mean 'liquid_drop_",
    "only: []": r"my.yaml, line 1: only: found a list of 0, allowed are at least 1",
    "cases: {x: {sample: {model: liquid_drop, k: 1e11, k_p: 0.1, c: 1}}}": r"x.sample.k: found "
    r"1e\+11, which is not searched for; allowed is .* N/m, or another search_range",
    "readings: {}": r"my.yaml, line 1: readings: unknown key, now called `interpretations`",
    "measurement: {noise: {relaxing: {}}}": r"noise.relaxing: unknown key, now called `ar1`",
    "models: {inertia: true}": r"my.yaml, line 1: models.inertia: unknown key, no longer needed: ",
    "seedz: 3": r"my.yaml, line 1: seedz: unknown key. Did you mean 'seeds'\? Allowed here: .*see",
    "seeds: many": r"my.yaml, line 1: seeds: found 'many', allowed is an integer",
    "seeds: 0": r"my.yaml, line 1: seeds: found 0, allowed is at least 1",
    "seeds: 2.5": r"seeds: found 2.5, allowed is an integer",
    "seeds: true": r"seeds: found True, allowed is an integer",
    "gripper:\n  left: {stiffness_Nm_per_rad: -4e-7}": r"my.yaml, line 2: "
    r"gripper.left.stiffness_Nm_per_rad: found -4e-07, allowed is at least 1e-12 and at most 1000",
    "gripper: {arm_length_m: .inf}": r"gripper.arm_length_m: found inf, allowed is a finite number",
    f"cases:\n  a/b: {{{DROP}}}": r"my.yaml, line 2: cases.a/b: not a usable case name",
    f"cases:\n  ../x: {{{DROP}}}": r"my.yaml, line 2: cases.../x: not a usable case name",
    "cases: {x: {sample: {model: liquid_dorp, k: 1, k_p: 1, c: 1}}}": r"x.sample.model: found "
    r"'liquid_dorp'. Did you mean 'liquid_drop'\? Allowed: generalized_maxwell, liquid_drop",
    "cases: {x: {sampel: {model: liquid_drop}}}": r"x.sampel: unknown key. Did you mean 'sample'",
    "cases: {x: {sample: {model: liquid_drop, k: 1, k_p: 1}}}": r"cases.x.sample.c: is missing: "
    r"liquid_drop needs k, k_p, c",
    f"cases: {{x: {{{DROP[:-1]}, c_p: 1}}}}}}": r"x.sample.c_p: is no parameter of liquid_drop",
    "cases: {x: {sample: {model: liquid_drop, k: -1, k_p: 1, c: 1}}}": r"x.sample.k: found -1, "
    r"allowed is at least 1e-18 N/m",
    "cases: {x: 3}": r"cases.x: found 3, allowed is a block of keys",
    "protocol:\n  phases:\n    - {duration_s: -5, torque_Nm: 1e-9}": r"my.yaml, line 3: "
    r"protocol.phases\[0\].duration_s: found -5, allowed is at least 1e-06 and at most 1e\+09 s",
    "protocol: {phases: []}": r"protocol.phases: found a list of 0, allowed are at least 1",
    "protocol: {phases: [{duration_s: 5, torque_Nm: 0}]}": r"phases: no phase has a torque",
    "measurement: {rate_Hz: 1e-6}": r"measurement.rate_Hz: found 1e-06, which gives 1.0004 samples",
    "measurement: {noise: {level_rad: -1e-6}}": r"my.yaml, line 1: measurement.noise.level_rad: "
    r"found -1e-06, allowed is at least 0 and at most 1e[+]12 rad",
    f"cases: {{x: {{contact: loose, {DROP}}}}}": r"x.contact: found 'loose'. Allowed: bilat",
    f"cases: {{x: {{contact: unilateral, models: {{target: nonlinear}}, {DROP}}}}}": (
        r"my.yaml, line 1: cases.x.contact: found unilateral and a nonlinear target, allowed is "
        r"models.target: linear"
    ),
    "measurement: {noise: {flicker: {share: 2}}}": r"noise.flicker.share: found 2, allowed is "
    r"greater than 0 and at most 1",
    "measurement: {rate_Hz: 1000, noise_model: coloured}": r"allowed are 7 to 50000 with a "
    r"coloured noise model",
    "gripper: {uncertainty: {left: {stiffness_Nm_per_rad: 1e-6}}}": r"uncertainty.left."
    r"stiffness_Nm_per_rad: found 1e-06, allowed is less than half of 4.4e-07",
    "gripper: {uncertainty: {arm_length_m: 1e-3}}": r"uncertainty.arm_length_m: found 0.001, "
    r"allowed is less than half of 0.0015",
    "gripper: {uncertainty: {thickness_m: 1e-6}}": r"uncertainty.thickness_m: needs a protocol in "
    r"voltages; allowed with torques is torque_percent",
    "gripper: {uncertainty: {finger_gap_m: 2e-6}}\n"
    "protocol: {phases: [{duration_s: 400.0, voltage_V: 16.0}]}": r"finger_gap_m: found 2e-06, "
    r"allowed is less than half of 3e-06",
    "measurement: {noise: {kind: pink}}": r"noise.kind: found 'pink'. Allowed: gaussian, uniform",
    "genetic_algorithm: {survivors: 500}": r"survivors: found 500, allowed is less than population",
    "search_range: {k: {exponent: [3, -3]}}": r"found \[3, -3\], allowed is \[lowest, highest\]",
    "reconstructed: [gripper.lenght]": r"found 'gripper.lenght', allowed is a key of this study",
    f"cases: {{x: {{{DROP}, assumed_gripper: {{left: 5}}}}}}": r"x.assumed_gripper.left: found 5, "
    r"allowed is a block of keys",
    f"cases: {{x: {{{DROP}, assumed_gripper: {{jaw_gap_m: 5}}}}}}": r"jaw_gap_m: unknown key",
    f"cases: {{x: {{{DROP}, assumed_gripper: measured}}}}": r"allowed is 'calibrated' or keys",
    f"cases: {{x: {{{DROP}, assumed_gripper: calibrated, calibration: {{rate_Hz: 1000.0}}}}}}": r""
    r"calibration.rate_Hz: found 1000.0, allowed is at least ten times the arms' natural frequency",
    f"cases: {{x: {{{DROP}, assumed_gripper: calibrated, calibration: {{duration_s: 1e-5}}}}}}": r""
    r"calibration.duration_s: found 1e-05, allowed is from five periods",
    f"cases: {{x: {{{DROP}, fixed: {{k: 1, c: 1, k_p: 1}}}}}}": r"fixed: leaves nothing to",
    f"cases: {{x: {{{DROP}, fixed: {{q: 1}}}}}}": r"x.fixed.q: is no parameter of the sample",
    f"cases: {{x: {{{DROP[:-1]}, size_m: 20e-6}}}}}}": r"size_m: found 2e-05, allowed is at least",
    f"cases: {{off: {{{DROP}}}}}": r"cases\[False\]: is no text: YAML reads on, off, yes, no",
    "protocol: {phases: [{duration_s: 5, torque_Nm: 1e-9, to_voltage_V: 3}]}": r"to_voltage_V: does"
    r" not go with torque_Nm",
    "protocol: {phases: [{duration_s: 5, torque_Nm: 1e-9, amplitude_Nm: 1e-10}]}": r"has one of "
    r"amplitude_Nm and frequency_Hz; allowed are both or neither",
    "protocol: {phases: [{duration_s: 5}]}": r"found neither, allowed is one of torque_Nm and volt",
    "models: {target: cubic}": r"models.target: found 'cubic'. Allowed: linear, nonlinear",
    "measurement: {times_s: [1, 3, 2, 4, 5, 6]}": r"times_s\[2\]: found 2, allowed is later than 3",
    "cases: null": r"cases: found nothing, allowed is a block of keys",
}


@pytest.mark.parametrize("text", BAD, ids=lambda text: text.replace("\n", " ")[:40])
def test_bad_config_is_explained(tmp_path: Path, text: str) -> None:
    with pytest.raises(BiogripError) as caught:
        load(tmp_path, text)
    message = str(caught.value)
    assert re.search(BAD[text], message), message
    assert message.count("\n") < 10


def test_contact_and_noise_of_an_instrument(tmp_path: Path) -> None:
    noise = "measurement: {noise: {level_rad: 2e-6}}"
    case = load(tmp_path, f"cases: {{x: {{contact: unilateral, {noise}, {DROP}}}}}").cases["x"]
    assert case.unilateral
    assert case.noise == Noise("gaussian", 0.1, "peak", 2e-6)
    other = load(tmp_path, f"cases: {{x: {{contact: bilateral, {DROP}}}}}").cases["x"]
    assert not other.unilateral
    assert other.noise == Noise("gaussian", 0.1, "peak")


def test_a_wrong_inherited_block_is_reported_once(tmp_path: Path) -> None:
    with pytest.raises(BiogripError) as caught:
        load(tmp_path, "gripper: {arm_length_m: -1}")
    assert str(caught.value).count("arm_length_m") == 1


def test_many_problems_are_cut_short(tmp_path: Path) -> None:
    names = "\n".join(f"wrong_{i}: 1" for i in range(50))
    with pytest.raises(BiogripError, match=r"and 44 more") as caught:
        load(tmp_path, names)
    assert str(caught.value).count("\n") < 20


def test_a_block_without_default_must_be_there() -> None:
    config = yaml.safe_load(DEFAULT.read_text())
    short = copy.deepcopy(config)
    del short["gripper"]["left"]["inertia_kgm2"]
    with pytest.raises(BiogripError, match=r"gripper.left.inertia_kgm2: is missing"):
        load_study(short, [])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("seeds: 1\nseeds: 2\n", "line 2: seeds: is given twice, first in line 1"),
        ("seeds: [1\n", "line 2: not valid YAML"),
    ],
)
def test_files_that_are_no_good_yaml(tmp_path: Path, text: str, message: str) -> None:
    file = tmp_path / "my.yaml"
    file.write_text(text)
    with pytest.raises(BiogripError, match=re.escape(message)):
        load_study({}, [file])


@pytest.mark.parametrize(
    ("bursts", "message"),
    [
        ("[{from_s: 0.0, rate_Hz: 1.0, samples: 2}]", "found 2 samples"),
        (
            "[{from_s: 0.0, rate_Hz: 10.0, samples: 30}, {from_s: 2.0, rate_Hz: 10.0, samples: 9}]",
            "allowed is after 2.9",
        ),
        ("[{from_s: 399.0, rate_Hz: 10.0, samples: 20}]", "at most until 400.0 s"),
    ],
)
def test_bursts_follow_each_other_within_the_protocol(
    tmp_path: Path, bursts: str, message: str
) -> None:
    with pytest.raises(BiogripError, match=re.escape(message)):
        load(tmp_path, f"measurement: {{bursts: {bursts}}}")


def test_missing_config_file(tmp_path: Path) -> None:
    with pytest.raises(BiogripError, match=r"nowhere.yaml: cannot be read: No such file"):
        load_study({}, [tmp_path / "nowhere.yaml"])


def test_cases_in_volts_and_in_torque_share_a_study(tmp_path: Path) -> None:
    """What only some cases have is not taken for what all have."""
    volts = "protocol: {phases: [{duration_s: 100.0, voltage_V: 10.0}]}"
    study = load(tmp_path, f"cases: {{endothelial_cell: {{{volts}}}, my_drop: {{{DROP}}}}}")
    shown: Any = coverage.COVERAGE.settings(study, {})
    (phase,) = shown.cases["endothelial_cell"].problem.phases
    actuator = study.actuator
    assert phase.duration_s == 100.0
    assert phase.left.value_Nm == pytest.approx(float(torque(actuator, 10.0)))
    # What a volt is worth is in the settings of the one, and not in those of the other.
    wider = load(
        tmp_path,
        f"""
        actuator: {{thickness_m: {2 * actuator.thickness_m}}}
        cases: {{endothelial_cell: {{{volts}}}, my_drop: {{{DROP}}}}}
    """,
    )
    changed: Any = coverage.COVERAGE.settings(wider, {})
    assert digest(changed.cases["endothelial_cell"]) != digest(shown.cases["endothelial_cell"])
    assert digest(changed.cases["my_drop"]) == digest(shown.cases["my_drop"])


@pytest.mark.parametrize(("noise_model", "along"), [("white", False), ("coloured", True)])
def test_a_coloured_noise_model_has_every_identification_fit_an_offset_and_a_drift(
    noise_model: str, along: bool
) -> None:
    study = study_of(f"measurement: {{rate_Hz: 1.0, noise_model: {noise_model}}}")
    found = {(case.problem.offset, case.problem.drift) for case in study.cases.values()}
    assert found == {(along, along)}


def test_a_drift_that_is_refused_is_not_fitted() -> None:
    study = study_of("measurement: {rate_Hz: 1.0, noise_model: coloured, drift: false}")
    found = {(case.problem.offset, case.problem.drift) for case in study.cases.values()}
    assert found == {(True, False)}
