import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from biogrip.errors import BiogripError
from biogrip.physics.gripper import torque
from biogrip.study.load import load_study
from biogrip.study.source import overlaid, read_config
from biogrip.study.study import Study
from tests.helpers.places import CONFIG

DROP = "sample: {model: liquid_drop, k: 1.0, k_p: 1.0, c: 1.0}"


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
        seeds: 1e2
        cases:
          my_cell:
            sample: {model: generalized_maxwell, k: 20.0, k_p: 5.0, c: 80.0, c_p: 1e-3}
        """,
    )
    assert list(study.cases)[-1] == "my_cell"
    case = study.cases["my_cell"]
    assert (case.seeds, case.parameters["c_p"], case.title) == (100, 0.001, "my_cell")
    other = study.cases["endothelial_cell"].block
    assert case.block == replace(other, sample=case.block.sample, title=None, published=None)


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
    """And a title that begins like a number stays text."""
    case = load(tmp_path, f"cases: {{{name}: {{{DROP}, title: 1e-3}}}}").cases[name]
    assert (case.parameters["c"], case.title) == (1.0, "1e-3")


def test_a_study_has_only_the_cases_that_it_names_or_does_not_drop(tmp_path: Path) -> None:
    study = load(tmp_path, f"cases: {{liquid_drop_1: null, drop: {{{DROP}}}}}")
    assert list(study.cases) == ["endothelial_cell", "liquid_drop_2", "drop"]
    only = ["drop", "liquid_drop_1"]
    assert list(load(tmp_path, f"only: {only}\ncases: {{drop: {{{DROP}}}}}").cases) == only


# A config, and a regular expression of what is said of it.
REFUSED = re.findall(
    r"(.+?)\n=> (.+?)\n", Path(__file__).with_name("refused.txt").read_text("utf-8"), re.DOTALL
)


@pytest.mark.parametrize(("text", "words"), REFUSED, ids=[text[:40] for text, _ in REFUSED])
def test_bad_config_is_explained(tmp_path: Path, text: str, words: str) -> None:
    said = refusal(tmp_path, text.replace("MANY", ", ".join(map(str, range(6000)))))
    assert re.search(words, said), said


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
    ("noise_model", "along"),
    [
        ("white", (False, False)),
        ("coloured", (True, True)),
        ("coloured, drift: false", (True, False)),
    ],
)
def test_with_coloured_noise_an_offset_and_a_drift_are_fitted(
    tmp_path: Path, noise_model: str, along: tuple[bool, bool]
) -> None:
    study = load(tmp_path, f"measurement: {{rate_Hz: 1.0, noise_model: {noise_model}}}")
    assert {(case.problem.offset, case.problem.drift) for case in study.cases.values()} == {along}


SIGNED = ("-0.8", ">100", "0", "6.1", "<0.001", ">+5", "+2.6")
UNSIGNED = ("=1+1", "+1+1", "@SUM(A1)", "a|b", ">>100", "1" * 13, "-")


@pytest.mark.parametrize("error", [*SIGNED, *UNSIGNED])
def test_the_paper_s_errors_are_signed_numbers(tmp_path: Path, error: str) -> None:
    """They are printed as they stand, in tables that spreadsheets open."""
    published = f"{{table: 5, identified: {{}}, error_percent: {{k: '{error}'}}}}"
    text = f"cases: {{x: {{{DROP}, published: {published}}}}}"
    if error in SIGNED:
        assert load(tmp_path, text).cases["x"].published.error_percent["k"] == error
    else:
        assert "allowed is a number of at most 12 characters" in refusal(tmp_path, text)


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
