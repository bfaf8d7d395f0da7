import re
from dataclasses import replace
from pathlib import Path

import pytest

from biogrip.physics.noise import Noise
from tests.study.test_config import load, refusal

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


def test_a_list_of_keys_changes_all_of_them(tmp_path: Path) -> None:
    text = SWEEP.replace("key: measurement.noise.level", f"key: [{', '.join(ARMS)}]")
    study = load(tmp_path, text.replace("[0.1, 2e-2]", "[2.2e-7]"))
    arms = study.points["endothelial_cell--noise--2_2e-07--uniform-peak"].block.gripper
    assert [arm.stiffness_Nm_per_rad for arm in (arms.left, arms.right)] == [2.2e-7] * 2


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("[0.1, 2e-2]", "[0.4, 0.1, 0.3, 0.02]"),
        ("        - {label: a,", "        - {label: c, kind: uniform, reference: signal}\n"
         "        - {label: renamed,"),
        ("cases: [liquid_drop_2,", "cases: [liquid_drop_1, liquid_drop_2,"),
        ("    cases: [liquid", "    title: Another\n    cases: [liquid"),
    ],
)  # fmt: skip
def test_whatever_is_added_changes_no_other_point(tmp_path: Path, old: str, new: str) -> None:
    assert old in SWEEP
    before = load(tmp_path, SWEEP).points
    after = load(tmp_path, SWEEP.replace(old, new)).points
    assert {name: after[name].plain for name in before} == {n: it.plain for n, it in before.items()}


def test_a_whole_number_is_the_same_point_however_it_is_written(tmp_path: Path) -> None:
    names = [
        set(load(tmp_path, SWEEP.replace("[0.1, 2e-2]", f"[{one}]")).points)
        for one in ("1", "1.0", "1e0", "10e-1")
    ]
    assert names[0] == names[1] == names[2] == names[3]


def test_values_are_shown_in_the_axis_unit(tmp_path: Path) -> None:
    text = SWEEP.replace("{label: level,", '{label: level, unit: "%", unit_in_si: 0.01,')
    axis = load(tmp_path, text).config.sweeps["noise"].rows
    assert axis.title == "level (%)"
    assert [it.shown for it in axis.levels] == ["10", "2"]


LEVEL = "key: measurement.noise.level"
BAD = {
    ("  noise:\n", "  no-ise:\n"): r"line 2: sweeps.no-ise: not a usable sweep name: a letter",
    (LEVEL, "key: measurement.noise.levle"): r"line 4: sweeps.noise.rows.values\[0\]: gives "
    r"measurement.noise.levle: unknown key. Did you mean 'level'",
    (LEVEL, "key: sample.k"): r"found 'sample.k', allowed is a key in a block that a case",
    ("key: measurement.noise\n", "key: measurement.rate_Hz\n"): r"liquid_drop_2--noise--0_1--.*: "
    r"gives measurement.rate_Hz: found a block of keys, allowed is a number",
    ("[0.1, 2e-2]", "[0.1, -2]"): r"my.yaml, line 4: sweeps.noise.rows.values\[1\]: gives "
    r"measurement.noise.level: found -2, allowed is at least 0",
    ("[0.1, 2e-2]", "[0.1, 0.1000000000000000001]"): r"rows.values: holds something twice",
    ("label: b, reference: signal, kind: gaussian", "label: b, reference: peak, kind: uniform"): r""
    r"line 2: sweeps.noise: has the point liquid_drop_2--noise--0_1--uniform-peak, a name that",
    ("label: b,", "label: a,"): r"line 10: sweeps.noise.columns.values\[1\]: is called 'a' like",
    ("label: a, kind: uniform", "label: a, kind: unifrom"): r"my.yaml, line 9: "
    r"sweeps.noise.columns.values\[0\]: gives .*kind: found 'unifrom'. Did you mean 'uniform'",
    ("label: a, kind", "label: a, level: 1, kind"): r"columns.values\[0\]: sets "
    r"measurement.noise.level, which the rows do too",
    (LEVEL + ", values: [0.1, 2e-2]", "key: measurement.rate_Hz, values: [1e-3]"): r"my.yaml, "
    r"line 4: sweeps.noise.rows.values\[0\]: gives measurement.rate_Hz: found 0.001, which gives",
}  # fmt: skip


@pytest.mark.parametrize("change", BAD, ids=lambda change: change[1].strip()[:40])
def test_bad_sweeps_are_explained(tmp_path: Path, change: tuple[str, str]) -> None:
    assert change[0] in SWEEP
    said = refusal(tmp_path, SWEEP.replace(*change, 1))
    assert re.search(BAD[change], said), said


def test_a_problem_that_no_value_has_alone_is_placed_at_its_sweep(tmp_path: Path) -> None:
    """Jaws that are 10 um apart cannot hold the sample of 60 um that the case has."""
    text = SWEEP.replace("measurement.noise.level", "gripper.jaw_gap_m").replace("0.1,", "1e-5,")
    said = refusal(tmp_path, f"{text}cases: {{liquid_drop_2: {{sample: {{size_m: 60e-6}}}}}}")
    assert (
        "line 2: sweeps.noise: liquid_drop_2--noise--1e-05--uniform-peak: gives sample.size_m"
        in said
    )


def test_a_case_cannot_have_the_name_of_a_point(tmp_path: Path) -> None:
    name = "endothelial_cell--noise--0_02--uniform-peak"
    said = refusal(tmp_path, f"{SWEEP}cases: {{{name}: {{sample: {{model: damper, c_p: 1.0}}}}}}")
    assert f"sweeps.noise: has the point {name}, a name that there is already" in said


def test_there_are_no_more_points_than_cases(tmp_path: Path) -> None:
    values = [round(0.01 * (i + 1), 2) for i in range(16)]
    axis = f"{{label: a, key: measurement.%s, values: {values}}}"
    cases = ", ".join(f"c{i}: {{sample: {{model: damper, c_p: 1.0}}}}" for i in range(8))
    text = f"cases: {{{cases}}}\nsweeps: {{s: {{cases: {[f'c{i}' for i in range(8)]}, "
    text += f"rows: {axis % 'noise.level'}, columns: {axis % 'rate_Hz'}}}}}"
    assert "sweeps: found 2048 points, allowed are 2000 together" in refusal(tmp_path, text)
