import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft202012Validator

from biogrip.config.loading import read_configs
from biogrip.config.source import LARGEST_BYTES, read_config, read_source
from biogrip.errors import BiogripError
from biogrip.physics.gripper import torque
from biogrip.physics.noise import Noise
from biogrip_study.config.study import DEFAULTS, Study, load_given_study, load_study
from biogrip_study.config.study_blocks import OVERRIDABLE
from biogrip_study.methods.registry import METHODS
from tests.helpers.key_reference import STUDY, file_schema, leaves
from tests.helpers.places import CONFIG, ROOT

SCHEMA: dict[str, Any] = json.loads(file_schema())
DROP = "sample: {model: liquid_drop, k: 1.0, k_p: 1.0, c: 1.0}"


def load(tmp_path: Path, text: str) -> Study:
    file = tmp_path / "my.yaml"
    file.write_text(text)
    return load_study(read_configs([*DEFAULTS, file]), [*DEFAULTS, file])


def refusal(tmp_path: Path, text: str) -> str:
    with pytest.raises(BiogripError) as caught:
        load(tmp_path, text)
    said = str(caught.value)
    assert said.count("\n") <= 7
    return said


def test_the_default_study_holds_the_papers_targets() -> None:
    study = load_study(read_configs(DEFAULTS), DEFAULTS)
    targets = {name: case.parameters for name, case in study.cases.items()}
    assert targets == {
        "endothelial_cell": {"k": 35.0, "k_p": 12.3, "c": 299.9, "c_p": 1e-3},
        "liquid_drop_1": {"k": 9.5, "k_p": 1e-4, "c": 10.0, "c_p": 1e-4},
        "liquid_drop_2": {"k": 1.0, "k_p": 1e-4, "c": 10.0, "c_p": 1e-3},
    }
    assert [case.seeds for case in study.cases.values()] == [50, 50, 50]


def test_a_case_is_one_block_and_yaml_1_1_numbers_are_numbers(tmp_path: Path) -> None:
    sample = "{model: generalized_maxwell, k: 20.0, k_p: 5.0, c: 80.0, c_p: 1e-3}"
    study = load(tmp_path, f"seeds: 1e2\ncases: {{my_cell: {{sample: {sample}}}}}")
    assert list(study.cases)[-1] == "my_cell"
    case = study.cases["my_cell"]
    assert (case.seeds, case.parameters["c_p"], case.title) == (100, 0.001, "my_cell")
    other = study.cases["endothelial_cell"].block
    assert case.block == replace(other, sample=case.block.sample, title=None, published=None)


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


# A config, or what stands for what in `SWEEP`, and a regular expression of what is said of it.
REFUSED = re.findall(
    r"(.+?)\n=> (.+?)\n", Path(__file__).with_name("refused.txt").read_text("utf-8"), re.DOTALL
)


@pytest.mark.parametrize(("text", "words"), REFUSED, ids=[text[:40] for text, _ in REFUSED])
def test_bad_config_is_explained(tmp_path: Path, text: str, words: str) -> None:
    if text.startswith("SWEEP with "):
        old, new = text.removeprefix("SWEEP with ").split(" -> ")
        assert SWEEP.count(old) == 1
        text = SWEEP.replace(old, new)
    said = refusal(tmp_path, text.replace("MANY", ", ".join(map(str, range(6000)))))
    assert re.search(words, said), said


def test_a_wrong_block_of_the_study_is_said_once_and_not_of_every_case(tmp_path: Path) -> None:
    said = refusal(tmp_path, "seeds: 3\nprotocol: 5\n").splitlines()
    assert len(said) == 2
    assert "my.yaml, line 2: protocol: found 5" in said[1]


def test_all_problems_are_said_once_and_many_are_cut_short(tmp_path: Path) -> None:
    said = refusal(tmp_path, "gripper: {arm_length_m: -1}\nseedz: 3\nmethods: [gentic]")
    keys = ("arm_length_m: found", "seedz: ", "methods[0]")
    assert [said.count(key) for key in keys] == [1, 1, 1]
    assert "and 44 more" in refusal(tmp_path, "\n".join(f"wrong_{i}: 1" for i in range(50)))


def test_models_have_their_usual_names_too(tmp_path: Path) -> None:
    text = "{model_selection: {models: [SLS, kv]}, traces: {table: x.csv, model: Zener}, "
    text += "cases: {a: {sample: {model: drop, k: 1, k_p: 1, c: 1}}}}"
    config = load(tmp_path, text).config
    assert config.model_selection.models == ("zener_maxwell", "kelvin_voigt")
    assert config.traces
    assert config.traces.model == "zener_maxwell"
    assert config.cases["a"].sample.model == "liquid_drop"


def test_a_config_and_a_block_without_default_must_be_there(tmp_path: Path) -> None:
    said = r"nowhere.yaml: cannot be read: No such file .* in the folder .*test_a_con"
    with pytest.raises(BiogripError, match=said):
        load_study({}, [tmp_path / "nowhere.yaml"])
    config = read_configs(DEFAULTS)
    del config["gripper"]["left"]["inertia_kgm2"]
    with pytest.raises(BiogripError, match=r"gripper.left.inertia_kgm2: is missing"):
        load_study(config, [])


def test_cases_in_volts_and_in_torque_share_a_study(tmp_path: Path) -> None:
    volts = "protocol: {phases: [{duration_s: 100.0, voltage_V: 10.0}]}"
    study = load(tmp_path, f"cases: {{endothelial_cell: {{{volts}}}, my_drop: {{{DROP}}}}}")
    (phase,) = study.cases["endothelial_cell"].experiment.phases
    assert phase.duration_s == 100.0
    assert phase.level == pytest.approx(float(torque(study.actuator, 10.0)))


def test_with_coloured_noise_an_offset_and_a_drift_are_fitted(tmp_path: Path) -> None:
    known = {"white": (False, False), "coloured": (True, True)}
    for noise_model, along in {**known, "coloured, drift: false": (True, False)}.items():
        study = load(tmp_path, f"measurement: {{rate_Hz: 1.0, noise_model: {noise_model}}}")
        cases = (case.experiment for case in study.cases.values())
        assert {(experiment.offset, experiment.drift) for experiment in cases} == {along}


def test_the_paper_s_errors_are_signed_numbers(tmp_path: Path) -> None:
    """They are printed as they stand, in tables that spreadsheets open."""
    published = "published: {table: 5, identified: {}, error_percent: {k: 'ERROR'}}"
    text = f"cases: {{x: {{{DROP}, {published}}}}}"
    for error in ("-0.8", ">100", "0", "6.1", "<0.001", ">+5", "+2.6"):
        case = load(tmp_path, text.replace("ERROR", error)).cases["x"]
        assert case.published.error_percent["k"] == error
    for error in ("=1+1", "+1+1", "@SUM(A1)", "a|b", ">>100", "1111111111111", "-"):
        said = refusal(tmp_path, text.replace("ERROR", error))
        assert "allowed is a number of at most 12 characters" in said


# Snakemake hands over all that stands in a block of its command line as text.
TYPED: dict[str, Any] = {
    "evaluation": {"near_noise_tolerance": "0.03"},
    "search_range": {"k": {"exponent": ["-2", "3"]}},
    "measurement": {
        "rate_Hz": "1e1",
        "drift": "false",
        "offset": "True",
        "noise": {"kind": "uniform"},
    },
    "protocol": {"phases": [{"duration_s": "200", "torque_Nm": "1.6e-9"}]},
    "cases": {"liquid_drop_1": {"title": "5", "sample": {"k": "9"}}},
}


def test_numbers_of_the_command_line_are_numbers() -> None:
    study = load_given_study(TYPED, [])
    assert study.near_noise_tolerance == 0.03
    case = study.cases["liquid_drop_1"]
    assert case.experiment.ranges["k"].exponent == (-2, 3)
    read = case.block.measurement
    assert (read.rate_Hz, read.drift, read.offset) == (10.0, False, True)
    assert [phase.duration_s for phase in case.phases] == [200.0]
    assert (case.title, case.parameters["k"]) == ("5", 9.0)


BOMB = "\n".join(f"a{i}: &a{i} [{f'*a{i - 1}, ' * 10 if i else 'x'}]" for i in range(30))

UNREADABLE: dict[str, tuple[str | bytes, str]] = {
    "latin 1": (b"seeds: 1\n# \xe9\n", r"line 2: found the byte 0xe9, allowed is text in UTF-8"),
    "a program": (b"\x7fELF\x02\x01\x01" + bytes(99), r"not usable YAML: .*not allowed"),
    "aliases of aliases": (
        BOMB,
        r"line \d+: .*found more than 50 levels or 100000 values, those of",
    ),
    "large": ("# " + "x" * LARGEST_BYTES, r"my.yaml: found more than 1000000 bytes; allowed are"),
    "open": ("seeds: [1\n", r"line 2: not usable YAML"),
}


@pytest.mark.parametrize("name", UNREADABLE)
def test_what_cannot_be_read_is_refused_with_its_line(tmp_path: Path, name: str) -> None:
    content, message = UNREADABLE[name]
    file = tmp_path / "my.yaml"
    file.write_bytes(content if isinstance(content, bytes) else content.encode())
    for read in (read_config, read_source):
        with pytest.raises(BiogripError, match=r"my\.yaml") as caught:
            read(file)
        assert re.search(message, str(caught.value)), caught.value


CLEAR = (
    *("\ufeffseeds: 90", "seeds: 0x5a", "seeds: 9_0", "seeds: '9e1'", "seeds: 9e1", "seeds: '90'"),
    *("seeds: &a 90\nbatch_size: *a", '{"seeds": 90}', "---\nseeds: 90\n...\n"),
    "seeds: 90\ngripper: {<<: {arm_length_m: 1e-3}, jaw_gap_m: 1e-4}",
    "seeds: 90\nmeasurement: {offset: null}",
)


@pytest.mark.parametrize("text", CLEAR)
def test_what_is_unusual_but_clear_works(tmp_path: Path, text: str) -> None:
    assert {case.seeds for case in load(tmp_path, text).cases.values()} == {90}


@pytest.mark.parametrize("file", sorted(CONFIG.parent.glob("*.yaml")), ids=lambda it: it.stem)
def test_shipped_studies_load_by_the_schema(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    Draft202012Validator.check_schema(SCHEMA)
    assert [e.message for e in Draft202012Validator(SCHEMA).iter_errors(read_config(file))] == []
    assert load_study(read_configs([*DEFAULTS, file]), [*DEFAULTS, file]).cases


def test_every_key_says_what_it_means_and_every_number_has_bounds() -> None:
    known = {path: shape.node for path, shape in leaves(STUDY).items()}
    assert [path for path, node in known.items() if not node.get("description")] == []
    numbers = {path: it for path, it in known.items() if it.get("type") in ("integer", "number")}
    assert len(numbers) > 40
    assert [path for path, node in numbers.items() if "maximum" not in node] == []
    assert [p for p, node in numbers.items() if not {*node} & {"minimum", "exclusiveMinimum"}] == []


def test_every_block_refuses_unknown_keys() -> None:
    """All but those that take names of the user's or of a model's."""
    blocks = {"": SCHEMA, **SCHEMA["$defs"]}
    with_keys = {name: block for name, block in blocks.items() if "properties" in block}
    open_ = [n for n, b in with_keys.items() if b.get("additionalProperties") is not False]
    assert sorted(open_) == ["SampleBlock", "ValueBlock"]


def test_a_case_may_override_the_blocks_of_the_study_and_of_every_method() -> None:
    methods = {method.key for method in METHODS.values()}
    assert methods < set(OVERRIDABLE)
    assert set(OVERRIDABLE) == set(STUDY.keys["cases"].values.keys) & set(STUDY.keys)


ARMS = ("gripper.left.stiffness_Nm_per_rad", "gripper.right.stiffness_Nm_per_rad")
SWEEP = """\
sweeps:
  noise:
    cases: [liquid_drop_2, endothelial_cell]
    rows: {label: level, key: measurement.noise.level, values: [0.1, 2e-2]}
    columns:
      label: kind
      key: measurement.noise
      values:
        - {label: a, kind: uniform, reference: peak}
        - {label: b, reference: signal, kind: gaussian}
"""


def test_points_are_the_base_case_with_two_values_changed(tmp_path: Path) -> None:
    study = load(tmp_path, SWEEP)
    assert list(study.points) == [
        f"{case}--noise--{level}--{kind}"
        for case in ("liquid_drop_2", "endothelial_cell")
        for level in ("0_1", "0_02")
        for kind in ("uniform-peak", "gaussian-signal")
    ]
    base = study.cases["liquid_drop_2"]
    point = study.points["liquid_drop_2--noise--0_02--uniform-peak"]
    noisier = replace(base.block.measurement, noise=Noise("uniform", 0.02, "peak"))
    assert point.block == replace(base.block, measurement=noisier)
    assert (point.parameters, point.sample) == (base.parameters, base.sample)
    assert base.block.measurement.noise.level == 0.1
    assert not set(study.points) & set(study.cases)
    # However a whole number is written.
    texts = [SWEEP.replace("[0.1, 2e-2]", f"[{one}]") for one in ("1", "1.0", "1e0", "10e-1")]
    first, *others = (set(load(tmp_path, text).points) for text in texts)
    assert others == [first] * 3


def test_a_list_of_keys_changes_all_of_them(tmp_path: Path) -> None:
    text = SWEEP.replace("key: measurement.noise.level", f"key: [{', '.join(ARMS)}]")
    study = load(tmp_path, text.replace("[0.1, 2e-2]", "[2.2e-7]"))
    arms = study.points["endothelial_cell--noise--2_2e-07--uniform-peak"].block.gripper
    assert [arm.stiffness_Nm_per_rad for arm in (arms.left, arms.right)] == [2.2e-7] * 2


def test_whatever_is_added_changes_no_other_point(tmp_path: Path) -> None:
    before = {name: point.plain for name, point in load(tmp_path, SWEEP).points.items()}
    one = "        - {label: "
    for old, new in (
        ("[0.1, 2e-2]", "[0.4, 0.1, 0.3, 0.02]"),
        (f"{one}a,", f"{one}c, kind: uniform, reference: signal}}\n{one}renamed,"),
        ("cases: [liquid_drop_2,", "cases: [liquid_drop_1, liquid_drop_2,"),
        ("    cases: [liquid", "    title: Another\n    cases: [liquid"),
    ):
        assert old in SWEEP
        after = load(tmp_path, SWEEP.replace(old, new)).points
        assert {name: after[name].plain for name in before} == before


def test_a_wrong_block_of_the_study_is_told_once(tmp_path: Path) -> None:
    """Below a headline, and not once more of each of the three cases, which inherit it."""
    assert refusal(tmp_path, "protocol: 5").count("\n") == 1
