"""`biogrip design --export`: what a generator and a camera take, against equations (7) to (9)."""

import math
import os
from contextlib import redirect_stdout
from dataclasses import replace
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from biogrip.arrays import Array
from biogrip.cli import main
from biogrip.design import within_reach
from biogrip.design.experiment import DesignInputs
from biogrip.design.rating import Rater, Torque
from biogrip.design.schedule import Plan
from biogrip.design.shapes import SHAPES
from biogrip.experiment.protocol import Load, Phase, load, torque_at
from biogrip.experiment.sampling import Burst
from biogrip.own_design.breakpoints import FINENESS, breakpoints
from biogrip.study.load import load_study, read_configs
from biogrip.study.study import Case
from tests.helpers.places import CONFIG

DROP: dict[str, Any] = {
    "search_range": {"k_p": {"exponent": [-5, 8]}},
    "design": {
        "noise_rad": 3e-6,
        "readings": 400,
        "fastest_Hz": 1e5,
        "longest_s": 60.0,
        "largest_torque_Nm": 8e-9,
        "most_steps": 4,
        "candidates": 128,
    },
    "only": ["liquid_drop_2"],
}
CELL: dict[str, Any] = {
    "instrument": "creep",
    "sample": {"model": "zener_maxwell", "k": 300.0, "k_p": 200.0, "c": 900.0},
    "protocol": {"phases": [{"duration_s": 30.0, "stress_Pa": 40.0}]},
    "design": {
        "largest_stress_Pa": 40.0,
        "noise_strain": 2e-3,
        "readings": 90,
        "fastest_Hz": 50.0,
        "longest_s": 30.0,
        "candidates": 128,
    },
}
# Up and down, and nothing that a search would have to look for.
SHARES = {
    "steps": [0.5, 0.3, 0.6, 0.5, 1.0, 1.0, 0.6, 0.6, 0.8],
    "ramps": [0.5, 0.3, 0.6, 0.5, 1.0, 1.0, 0.6, 0.6, 0.8, 0.3, 0.4],
    "sinusoids": [0.4, 0.3, 0.5, 0.6, 0.5, 0.6, 0.7, 0.3, 0.3, 0.8],
}


def asked(config: dict[str, Any], **design: Any) -> dict[str, Any]:
    """Return a config with other settings of its design; None takes one out."""
    both = {**config["design"], **design}
    return {**config, "design": {key: value for key, value in both.items() if value is not None}}


def command(place: Path, config: dict[str, Any], *more: str) -> int:
    (place / "asked.yaml").write_text(yaml.safe_dump(config))
    paths = ["--output", str(place / "out.yaml"), "--export", str(place / "generator")]
    with redirect_stdout(StringIO()):
        return main(["design", str(place / "asked.yaml"), *paths, *more])


def case_in(place: Path, name: str = "liquid_drop_2") -> Case:
    """The case as a study takes it from the file that is written beside."""
    files = [CONFIG, place / "asked.yaml", place / "out.yaml"]
    return load_study(read_configs(files), files).cases[name]


def read(file: Path) -> tuple[list[str], Array]:
    lines = file.read_text().splitlines()
    assert lines[0].startswith("# written_by_biogrip")
    return lines[1].split(","), np.loadtxt(lines[2:], delimiter=",", ndmin=2)


def torque_of(volts: Array) -> Array:
    """Torque by equations (7) to (9), summed finger by finger."""
    comb = yaml.safe_load(CONFIG.read_text())["actuator"]
    h, d, g = (comb[f"{name}_m"] for name in ("thickness", "finger_width", "finger_gap"))
    slope = 0.0
    for i in range(comb["fingers"]):
        r = comb["first_radius_m"] + 2 * i * (d + g)
        slope += 1 / math.log((r + d + g) / (r + d))
        slope += 1 / math.log(r / (r - g)) if i else 0.0
    return 0.5 * 8.8541878128e-12 * h * slope * volts**2


def between(times: Array, values: Array) -> tuple[Array, Array]:
    """Return instants on the lines between breakpoints, ends of them included, and values."""
    share = np.linspace(1e-9, 1 - 1e-9, 9)
    there = np.diff(times) > 0
    start, lasting = times[:-1][there], np.diff(times)[there]
    first, change = values[:-1][there], np.diff(values)[there]
    return (
        (start[:, None] + share * lasting[:, None]).ravel(),
        (first[:, None] + share * change[:, None]).ravel(),
    )


@pytest.fixture
def any_torque(monkeypatch: pytest.MonkeyPatch) -> None:
    """Some torque of the first shape in place of a search, which takes seconds."""

    def some(inputs: DesignInputs, *_: Any) -> list[Torque]:
        (shape,) = inputs.shapes
        waveform = SHAPES[shape].waveform(np.array(SHARES[shape]), inputs.limits)
        return [Rater(inputs).torque(waveform)]

    monkeypatch.setattr(within_reach, "best_torques", some)
    monkeypatch.setattr(within_reach, "climb", lambda inputs, torques, *_: list(torques))


def check_held(case: Case, columns: list[str], rows: Array) -> None:
    """What is drawn between the rows is what the case holds, from nothing until the end."""
    history = case.problem.torque
    times, held = rows[:, 0], rows[:, 1]
    assert columns[0] == "time_s"
    assert np.all(np.diff(times) >= 0)
    assert np.all(rows[0, :2] == 0)
    assert times[-1] == pytest.approx(history.end_s)
    instants, values = between(times, held)
    if columns[1] == "voltage_V":
        values = torque_of(values)
    expected = torque_at(history, instants)
    deviation = np.abs(values - expected) / expected.max()
    assert deviation.max() <= 1e-4 * (1 + 1e-3)
    # No finer than need be: only a few hundred points for a period, a few dozen for a ramp.
    assert len(rows) < 60 * len(case.phases) + 170 * sum(
        phase.duration_s * harmonic.frequency_Hz + 1
        for phase in case.phases
        for harmonic in phase.left.harmonics
    )
    # The first is a jump from nothing.
    ends = [0.0, *(float(phase.left.at(phase.duration_s)) for phase in case.phases[:-1])]
    starts = [float(phase.left.at(0.0)) for phase in case.phases]
    jumps = ~np.isclose(ends, starts, rtol=1e-8, atol=1e-9 * expected.max())
    assert np.sum(np.diff(times) == 0) == jumps.sum()


def check_readings(case: Case, file: Path) -> None:
    columns, rows = read(file)
    expected = case.sampling.over(case.problem.torque.end_s)
    assert columns == ["time_s"]
    assert len(rows) == case.design.readings
    np.testing.assert_allclose(rows[:, 0], expected, rtol=1e-12, atol=0)


def test_a_design_that_was_searched_for(tmp_path: Path) -> None:
    assert command(tmp_path, DROP) == 0
    case = case_in(tmp_path)
    check_held(case, *read(tmp_path / "generator" / "liquid_drop_2_protocol.csv"))
    check_readings(case, tmp_path / "generator" / "liquid_drop_2_readings.csv")
    before = sorted(path.read_bytes() for path in (tmp_path / "generator").iterdir())
    assert len(before) == 2
    assert command(tmp_path, DROP) == 0
    assert sorted(path.read_bytes() for path in (tmp_path / "generator").iterdir()) == before


@pytest.mark.usefixtures("any_torque")
@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("instrument", ["gripper", "creep"])
def test_lines_between_rows_are_what_is_held(instrument: str, shape: str, tmp_path: Path) -> None:
    config, name = asked(DROP, shapes=[shape], shortest_step_s=1e-3), "liquid_drop_2"
    if instrument == "creep":
        config, name = {"only": ["cell"], "cases": {"cell": asked(CELL, shapes=[shape])}}, "cell"
    assert command(tmp_path, config) == 0
    case = case_in(tmp_path, name)
    columns, rows = read(tmp_path / "generator" / f"{name}_protocol.csv")
    assert columns[1:] == ["voltage_V" if instrument == "gripper" else "stress_Pa"]
    check_held(case, columns, rows)
    check_readings(case, tmp_path / "generator" / f"{name}_readings.csv")


@pytest.mark.parametrize("root", [False, True])
@pytest.mark.parametrize(
    "held",
    [
        load(2.0, 8.0, 0.0),
        load(2.0, 0.0, 8.0),
        load(2.0, 7.3, 7.9),
        load(2.0, 4.0, amplitude_Nm=4.0, frequency_Hz=3.3),
        load(2.0, 4.0, amplitude_Nm=3.99, frequency_Hz=3.5),
        load(2.0, 7.0, amplitude_Nm=1e-4, frequency_Hz=40.0),
        load(2.0, 5.0, amplitude_Nm=3.0, frequency_Hz=0.1),
    ],
)
def test_lines_deviate_by_no_more_than_is_said(held: Load, *, root: bool) -> None:
    """Of ramps to zero and from it, of sinusoids that touch it, and of parts of a period."""
    phases = (Phase(1.0, load(1.0, 8.0), load(1.0, 8.0)), Phase(2.0, held, held))
    _, (times, values) = breakpoints(phases, root=root)
    np.testing.assert_allclose(times[[0, -1]], [1.0, 3.0], rtol=1e-15)
    np.testing.assert_allclose(values, np.maximum(held.at(times - 1.0), 0.0), rtol=0, atol=1e-9)
    instants, drawn = between(times, np.sqrt(values) if root else values)
    deviation = (drawn**2 if root else drawn) - held.at(instants - 1.0)
    assert np.abs(deviation).max() <= 8.0 * FINENESS * (1 + 1e-3)
    if held.value_Nm == 8.0 or held.value_Nm == 0.0:
        assert values.min() == 0.0


def test_a_ramp_to_zero_is_one_that_a_study_takes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of rates and durations with which rounding would leave a torque below zero."""
    down = load(44.07, 6.75e-10, 0.0)
    assert down.at(44.07) < 0

    def to_zero(inputs: DesignInputs, *_: Any, **_more: Any) -> tuple[DesignInputs, Plan]:
        plan = Plan((Phase(44.07, down, down),), (Burst(1.0, 10.0, 400),), np.eye(4)[None], 0.0)
        return inputs, plan

    monkeypatch.setattr("biogrip.own_design.designed.plan_within_reach", to_zero)
    assert command(tmp_path, DROP) == 0
    assert case_in(tmp_path).phases[0].left.value_Nm == 6.75e-10
    _, rows = read(tmp_path / "generator" / "liquid_drop_2_protocol.csv")
    assert rows[-1].tolist() == [44.07, 0.0]


@pytest.mark.usefixtures("any_torque")
def test_onto_a_sample_of_known_size_the_jaws_are_closed_first(tmp_path: Path) -> None:
    """The torques add, not the voltages; from contact it is the same file."""
    sample = {"liquid_drop_2": {"sample": {"size_m": 60e-6}}}
    assert command(tmp_path, {**DROP, "cases": sample}) == 0
    columns, rows = read(tmp_path / "generator" / "liquid_drop_2_protocol.csv")
    assert columns == ["time_s", "voltage_V", "with_closing_V"]
    case = case_in(tmp_path)
    check_held(case, columns, rows)
    closing = torque_of(rows[:, 2]) - torque_of(rows[:, 1])
    # Jaws 150 um apart: 45 um for each arm, at about 1.5 mm from its pivot, by hinges of 4.4e-7.
    np.testing.assert_allclose(closing, closing[0], rtol=1e-6)
    assert closing[0] == pytest.approx(4.4e-7 * 45e-6 / 1.5e-3, rel=0.15)


@pytest.mark.usefixtures("any_torque")
@pytest.mark.parametrize(
    ("design", "said"),
    [
        ({}, "found 8.08e-09 N m, allowed by design.largest_torque_Nm is 8e-09 N m"),
        (
            {"largest_torque_Nm": None, "largest_voltage_V": 40.0},
            "V, allowed by design.largest_voltage_V is 40 V",
        ),
    ],
)
def test_more_than_the_config_allows_is_refused(
    design: dict[str, Any],
    said: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """As of a search that went too far; nothing is written."""
    usual = within_reach.plan_within_reach

    def too_far(*given: Any, **_more: Any) -> tuple[DesignInputs, Plan]:
        inputs, plan = usual(*given)
        one = load(1.0, 1.01 * inputs.largest_Nm)
        return inputs, replace(plan, phases=(*plan.phases[:-1], Phase(1.0, one, one)))

    monkeypatch.setattr("biogrip.own_design.designed.plan_within_reach", too_far)
    assert command(tmp_path, asked(DROP, **design)) == 1
    assert said in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["asked.yaml"]


@pytest.mark.parametrize("arm", ["left", "right"])
def test_more_than_the_stroke_is_refused(
    arm: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Of either arm, of which a soft one turns further than the search looks at."""

    def whatever(inputs: DesignInputs, *_: Any) -> list[Torque]:
        waveform = SHAPES["steps"].waveform(np.array(SHARES["steps"]), inputs.limits)
        found = Rater(inputs).torque(waveform)
        return [replace(found, largest_Nm=inputs.largest_Nm)]

    monkeypatch.setattr(within_reach, "best_torques", whatever)
    monkeypatch.setattr(within_reach, "climb", lambda inputs, torques, *_: list(torques))
    # The soft arm turns by 11 mrad, the other one by less than 10.
    config = {**DROP, "gripper": {arm: {"stiffness_Nm_per_rad": 2.0e-7}}}
    assert command(tmp_path, {**config, "actuator": {"stroke_deg": math.degrees(0.012)}}) == 0
    for name in ("out.yaml", "out.html"):
        (tmp_path / name).unlink()
    assert command(tmp_path, {**config, "actuator": {"stroke_deg": math.degrees(0.0105)}}) == 1
    error = capsys.readouterr().err
    assert "actuator.stroke_deg leaves for gripping, 10.5 mrad" in error
    assert "liquid_drop_2" in error
    assert not (tmp_path / "out.yaml").exists()


@pytest.mark.usefixtures("any_torque")
def test_no_link_is_followed_and_nothing_of_others_replaced(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, mine = tmp_path / "generator" / "liquid_drop_2_readings.csv", tmp_path / "mine"
    file.parent.mkdir()
    mine.write_text("mine\n")
    for make in (lambda: file.symlink_to(mine), lambda: file.write_text("mine\n")):
        make()
        assert command(tmp_path, DROP) == 1
        assert "biogrip did not write it" in capsys.readouterr().err
        file.unlink()
    file.symlink_to(mine)
    assert command(tmp_path, DROP, "--force") == 0
    assert mine.read_text() == "mine\n"
    assert not file.is_symlink()


@pytest.mark.parametrize("folder", ["asked.yaml", "no/folder", "nowhere"])
def test_folders_that_cannot_be(
    folder: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    os.symlink(tmp_path / "not there", tmp_path / "nowhere")
    assert command(tmp_path, DROP, "--export", str(tmp_path / folder)) == 1
    assert "cannot be made; allowed with --export is a folder" in capsys.readouterr().err
    assert not (tmp_path / "out.yaml").exists()


def test_a_file_is_not_written_twice(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    twice = str(tmp_path / "generator" / "liquid_drop_2_readings.csv")
    assert command(tmp_path, DROP, "--output", twice) == 1
    assert "is a file of --export, too" in capsys.readouterr().err


@pytest.mark.usefixtures("any_torque")
def test_files_of_several_cases_have_their_names(tmp_path: Path) -> None:
    both = ["liquid_drop_1", "liquid_drop_2"]
    assert command(tmp_path, {**DROP, "only": both}) == 0
    found = sorted(path.name for path in (tmp_path / "generator").iterdir())
    assert found == [f"{name}_{what}.csv" for name in both for what in ("protocol", "readings")]
