import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import yaml

from biogrip.errors import BiogripError
from biogrip.physics.actuator import torque
from biogrip.physics.noise import Noise
from biogrip.study.load import load_study
from biogrip.study.source import overlaid, read_config
from biogrip.study.study import Study
from tests.helpers.places import CONFIG, ROOT

DROP = "sample: {model: liquid_drop, k: 1.0, k_p: 1.0, c: 1.0}"
SOLID = "model: fractional_kelvin_voigt, k_p: 0.3, k_alpha: 10.0"
LONG = "protocol: {phases: [{duration_s: 2e5, torque_Nm: 1e-9}]}, measurement: {rate_Hz: 0.01}"


def load(tmp_path: Path, text: str) -> Study:
    """Load a config that is laid over the default study."""
    file = tmp_path / "my.yaml"
    file.write_text(text)
    return load_study(overlaid(read_config(CONFIG), read_config(file)), [CONFIG, file])


def refusal(tmp_path: Path, text: str) -> str:
    """What is said of a config that cannot be used."""
    with pytest.raises(BiogripError) as caught:
        load(tmp_path, text)
    said = str(caught.value)
    assert said.count("\n") <= 7
    return said


def test_the_default_study_holds_the_papers_targets() -> None:
    study = load_study(read_config(CONFIG), [CONFIG])
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
    other = study.cases["endothelial_cell"].block
    assert case.block == replace(other, sample=case.block.sample, title=None, published=None)


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
    "only: []": r"my.yaml, line 1: only: found a list of 0 items, allowed are at least 1",
    "cases: {x: {sample: {model: liquid_drop, k: 1e11, k_p: 0.1, c: 1}}}": r"x.sample.k: found "
    r"1e\+11, which is not searched for; allowed is .* N/m, or another search_range",
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
    r"allowed is at least 1e-18 and at most 1e\+12 N/m",
    "cases: {x: 3}": r"cases.x: found 3, allowed is a block of keys",
    "protocol:\n  phases:\n    - {duration_s: -5, torque_Nm: 1e-9}": r"my.yaml, line 3: "
    r"protocol.phases\[0\].duration_s: found -5, allowed is at least 1e-06 and at most 1e\+09 s",
    "protocol: {phases: []}": r"protocol.phases: found a list of 0 items, allowed are at least 1",
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
    f"cases: {{off: {{{DROP}}}}}": r"cases.off: is no text: YAML reads on, off, yes, no",
    "protocol: {phases: [{duration_s: 5, torque_Nm: 1e-9, to_voltage_V: 3}]}": r"to_voltage_V: does"
    r" not go with torque_Nm",
    "protocol: {phases: [{duration_s: 5, torque_Nm: 1e-9, amplitude_Nm: 1e-10}]}": r"has one of "
    r"amplitude_Nm and frequency_Hz; allowed are both or neither",
    "protocol: {phases: [{duration_s: 5}]}": r"found neither, allowed is one of torque_Nm and volt",
    "models: {target: cubic}": r"models.target: found 'cubic'. Allowed: linear, nonlinear",
    "measurement: {times_s: [1, 3, 2, 4, 5, 6]}": r"times_s\[2\]: found 2, allowed is later than 3",
    "cases: null": r"cases: found nothing, allowed is a block of keys",
    "gripper: {left: {damping_Nms_per_rad: 1e-20}}": r"gripper.left.damping_Nms_per_rad: makes the "
    r"arm's quality factor 6.63e\+09, allowed is",
    f"cases: {{x: {{{DROP}, assumed_gripper: {{left: {{damping_Nms_per_rad: 1e-20}}}}}}}}": r""
    r"x.assumed_gripper.left.damping_Nms_per_rad: makes the arm's quality factor 6.63e\+09",
    "measurement: {rate_Hz: 1.0e+999}": r"rate_Hz: found inf, allowed is a finite number",
    "measurement: {rate_Hz: many}": r"measurement.rate_Hz: found 'many', allowed is a number",
    f"measurement: {{times_s: {list(range(6000))}}}": r"times_s: found a list of 6000 items, "
    r"allowed are at most 5000",
    "search_range: {k: {exponent: [2, 2], digit: [3, 3]}}": r"search_range.k: leaves one value, "
    r"and nothing to search for; .* the case's key fixed",
    "search_range: {k: {digit: [0, 0]}}": r"search_range.k.digit: found \[0, 0\], allowed is a "
    r"highest digit of at least 1",
    "search_range: {alpha: {exponent: [-1, 1]}}": r"search_range.alpha.exponent: found 1, which "
    r"makes exponents of springpots above 1; allowed is at most 0",
    f'cases: {{x: {{{DROP}, title: "a|b"}}}}': r"x.title: found 'a\|b', allowed is text of 1 to 60",
    "gripper: {uncertainty: {left: {'=1+1': 1}}}": r"gripper.uncertainty.left: found '=1\+1'. "
    r"Allowed: inertia_kgm2, damping_Nms_per_rad",
    "protocol: {phases: [&a {duration_s: 6e8, torque_Nm: 1e-9}, *a]}": r"protocol.phases: found "
    r"1.2e\+09 s in all phases together, allowed is at most 1e\+09 s",
    "least_squares: null": r"least_squares: found nothing, allowed is a block of keys",
    "interpretations: {a: {title: x, changes: {genetic_algorithm: {survivors: 500}}}}": r"line 1: "
    r"interpretations.a.changes.genetic_algorithm.survivors: found 500, allowed is less than",
    f"cases: {{x: {{sample: {{{SOLID}, alpha: 1.0}}}}}}": r"x.sample.alpha: found 1, allowed is "
    r"at least 1e-18 and below 1",
    f"cases: {{x: {{sample: {{{SOLID}, alpha: 0.001}}}}}}": r"x.sample.alpha: found 0.001, which "
    r"is not searched for; allowed is 0.01 to 1, or another search_range",
    f"cases: {{x: {{sample: {{{SOLID}, alpha: 0.3}}, {LONG}}}}}": r"x.sample.model: found a "
    r"protocol of 200000 s, allowed are at most 100000 s with fractional_kelvin_voigt",
    "model_selection: {models: [damper, fractional_maxwell]}\n"
    f"cases: {{x: {{sample: {{model: damper, c_p: 1.0}}, {LONG}}}}}": r"models\[1\]: "
    r"found fractional_maxwell and a protocol of 200000 s, allowed are at most 100000 s with it",
    f"cases: {{x: {{sample: {{{SOLID}, alpha: 0.3}}, measurement: {{rate_Hz: 2e5}}, protocol: "
    "{phases: [{duration_s: 0.1, torque_Nm: 1e-9}]}}}": r"x.measurement.rate_Hz: found 200000, "
    r"allowed is at most 100000 Hz with fractional_kelvin_voigt",
    "measurement: {bursts: [{from_s: 0.0, rate_Hz: 1.0, samples: 2}]}": r"bursts: found 2 samples",
    "measurement: {bursts: [{from_s: 0.0, rate_Hz: 10.0, samples: 30}, "
    "{from_s: 2.0, rate_Hz: 10.0, samples: 9}]}": r"bursts\[1\]: found 2 to 2.8, allowed is later "
    r"than 2.9 and at most 400 s",
    "measurement: {bursts: [{from_s: 399.0, rate_Hz: 10.0, samples: 20}]}": r"and at most 400 s",
    "measurement: {file: x.csv, rotation: r}": r"measurement.time: is missing: a recorded trace",
    "measurement: {file: x.csv, time: t, strain: e}": r"measurement.file: found 'x.csv', allowed "
    r"is a file that exists",
    "design: {parameters: [q]}": r"design.parameters\[0\]: found 'q', allowed are k, k_p, c, c_p",
}  # fmt: skip


@pytest.mark.parametrize("text", BAD, ids=lambda text: text.replace("\n", " ")[:40])
def test_bad_config_is_explained(tmp_path: Path, text: str) -> None:
    said = refusal(tmp_path, text)
    assert re.search(BAD[text], said), said


def test_contact_and_noise_of_an_instrument(tmp_path: Path) -> None:
    noise = "measurement: {noise: {level_rad: 2e-6}}"
    case = load(tmp_path, f"cases: {{x: {{contact: unilateral, {noise}, {DROP}}}}}").cases["x"]
    assert case.unilateral
    assert case.noise == Noise("gaussian", 0.1, "peak", 2e-6)
    other = load(tmp_path, f"cases: {{x: {{contact: bilateral, {DROP}}}}}").cases["x"]
    assert not other.unilateral
    assert other.noise == Noise("gaussian", 0.1, "peak")


def test_all_problems_are_said_once_and_many_are_cut_short(tmp_path: Path) -> None:
    said = refusal(tmp_path, "gripper: {arm_length_m: -1}\nseedz: 3\nmethods: [gentic]")
    keys = ("arm_length_m: found", "seedz: ", "methods[0]")
    assert [said.count(key) for key in keys] == [1, 1, 1]
    assert "and 44 more" in refusal(tmp_path, "\n".join(f"wrong_{i}: 1" for i in range(50)))


def test_a_block_without_default_must_be_there() -> None:
    config = read_config(CONFIG)
    del config["gripper"]["left"]["inertia_kgm2"]
    with pytest.raises(BiogripError, match=r"gripper.left.inertia_kgm2: is missing"):
        load_study(config, [])


def test_cases_in_volts_and_in_torque_share_a_study(tmp_path: Path) -> None:
    """What only some cases have is not taken for what all have."""
    volts = "protocol: {phases: [{duration_s: 100.0, voltage_V: 10.0}]}"
    study = load(tmp_path, f"cases: {{endothelial_cell: {{{volts}}}, my_drop: {{{DROP}}}}}")
    (phase,) = study.cases["endothelial_cell"].problem.phases
    assert phase.duration_s == 100.0
    assert phase.left.value_Nm == pytest.approx(float(torque(study.actuator, 10.0)))


@pytest.mark.parametrize(
    ("keys", "along"),
    [
        ("noise_model: white", (False, False)),
        ("noise_model: coloured", (True, True)),
        ("noise_model: coloured, drift: false", (True, False)),
    ],
)
def test_a_coloured_noise_model_has_every_identification_fit_an_offset_and_a_drift(
    tmp_path: Path, keys: str, along: tuple[bool, bool]
) -> None:
    study = load(tmp_path, f"measurement: {{rate_Hz: 1.0, {keys}}}")
    assert {(case.problem.offset, case.problem.drift) for case in study.cases.values()} == {along}


@pytest.mark.parametrize(
    ("error", "works"),
    [
        *((error, True) for error in ("-0.8", ">100", "0", "6.1", "<0.001", ">+5", "+2.6")),
        *((error, False) for error in ("=1+1", "+1+1", "@SUM(A1)", "a|b", ">>100", "1" * 13, "-")),
    ],
)
def test_the_paper_s_errors_are_signed_numbers(tmp_path: Path, error: str, works: bool) -> None:
    """They are printed as they stand, in tables that spreadsheets open."""
    case = yaml.safe_load(f"{{{DROP}}}")
    case["published"] = {"table": 5, "identified": {}, "error_percent": {"k": error}}
    text = yaml.safe_dump({"cases": {"x": case}})
    if works:
        assert load(tmp_path, text).cases["x"].published.error_percent["k"] == error
    else:
        assert "allowed is a number of at most 12 characters" in refusal(tmp_path, text)


def test_the_study_of_power_law_cells_compares_springpots_with_branches(tmp_path: Path) -> None:
    study = load(tmp_path, (ROOT / "config" / "power_law.yaml").read_text(encoding="utf-8"))
    for case in study.cases.values():
        assert {"generalized_maxwell", "fractional_maxwell"} <= set(case.models)


# Snakemake hands over all that stands in a block of its command line as text.
TYPED: dict[str, Any] = {
    "evaluation": {"near_noise_tolerance": "0.03"},
    "search_range": {"k": {"exponent": ["-2", "3"]}},
    "measurement": {"rate_Hz": "1e1", "drift": "false", "noise": {"kind": "uniform"}},
    "protocol": {"phases": [{"duration_s": "200", "torque_Nm": "1.6e-9"}]},
    "cases": {"liquid_drop_1": {"title": "5", "sample": {"k": "9"}}},
}


def test_numbers_of_the_command_line_are_numbers() -> None:
    study = load_study(overlaid(read_config(CONFIG), TYPED), [CONFIG], TYPED)
    assert study.near_noise_tolerance == 0.03
    case = study.cases["liquid_drop_1"]
    assert case.ranges["k"].exponent == (-2, 3)
    assert (case.sampling.rate_Hz, case.block.measurement.drift) == (10.0, False)
    assert [phase.duration_s for phase in case.phases] == [200.0]
    assert (case.title, case.parameters["k"]) == ("5", 9.0)


def test_what_is_wrong_on_the_command_line_is_said_of_it() -> None:
    typed = {"evaluation": {"near_noise_tolerance": "few"}, "methods": ["gentic"]}
    with pytest.raises(BiogripError) as caught:
        load_study(overlaid(read_config(CONFIG), typed), [CONFIG], typed)
    said = str(caught.value)
    place = "command line, --config: "
    assert f"{place}evaluation.near_noise_tolerance: found 'few', allowed is a number." in said
    assert f"{place}methods[0]: found 'gentic'. Did you mean 'genetic'?" in said
