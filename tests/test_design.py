from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from biogrip import design
from biogrip.cli import main
from biogrip.design import NO_BOUND, Limits, Specimen
from biogrip.library import simulate
from biogrip.physics.protocol import sample_times
from biogrip.physics.response import compute_grip
from tests.helpers.default import study_of

GRIPPER = """
only: [endothelial_cell, liquid_drop_2]
measurement: {noise: {level_rad: 3.0e-6}}
fixed: {c_p: 1.0e-3}
design: {steps: 4}
"""
CREEP = """
instrument: creep
protocol: {phases: [{duration_s: 30.0, HELD: 1.0}]}
measurement: {rate_Hz: 10.0, noise: {level: 0.02}}
only: [solid]
cases: {solid: {sample: {model: zener_maxwell, k: 300.0, k_p: 200.0, c: 900.0}}}
design: {steps: 3}
"""
MAXWELL, ZENER = "maxwell, k: 300.0, k_p: 200.0, c:", "kelvin, k_s: 500.0, k_v: 300.0, c_v:"
STRESS = CREEP.replace("HELD", "stress_Pa")
DRIFTING = STRESS.replace("rate_Hz", "offset: true, drift: true, rate_Hz")
KELVIN = DRIFTING.replace(MAXWELL, ZENER)


def designed(folder: Path, text: str = GRIPPER, *given: str) -> Path:
    (folder / "my.yaml").write_text(text)
    assert main(["design", str(folder / "my.yaml"), *given]) == 0
    return folder / "my_designed.yaml"


def set_up_of(text: str = GRIPPER) -> tuple[Limits, list[Specimen]]:
    study = study_of(text)
    return design.set_up(list(study.cases.values()), study.config.design)


@pytest.mark.parametrize("text", [GRIPPER, DRIFTING])
def test_the_search_knows_the_bounds_of_a_train(text: str) -> None:
    """By central differences. At 0, where a stress starts, nothing is read."""
    limits, specimens = set_up_of(text)
    ((train,), _), step = design.search(specimens, limits, 20), 1e-4
    drifts = int(text == DRIFTING)
    for one in specimens:
        found = design.rated(one, [train.phases], limits.rate_Hz)
        problem = replace(one.case.experiment, phases=train.phases)
        times_s = sample_times(problem.torque.end_s, limits.rate_Hz)[drifts:]
        names, read = problem.searched.names, []
        for shift in step * np.vstack((np.eye(len(names)), -np.eye(len(names)))):
            values = dict(zip(names, one.parameters * np.exp(shift), strict=True))
            read.append(simulate(problem, {**problem.fixed, **values}, times_s))
        rows = -np.diff(np.reshape(read, (2, len(names), -1)), axis=0)[0] / (2 * step * one.noise)
        line = np.linspace(-1, 1, rows.shape[1])
        rows = np.vstack((rows, *([line**0 / one.noise, line / one.noise] if drifts else [])))
        expected = np.sqrt(np.diagonal(np.linalg.inv(rows @ rows.T)))[: len(names)]
        assert found.bounds == pytest.approx(expected, rel=1e-4)
        assert one.told([train])[0] == pytest.approx(found.bounds, rel=1e-9)
        # The jaws press every sample, which they do not under many random trains.
        assert drifts or (found.force_N or 0) > 0


def test_the_search_knows_the_force_of_the_jaws() -> None:
    limits, (_, one) = set_up_of()
    pressed = []
    for unknowns in np.random.default_rng(0).random((30, 2 * limits.steps)):
        (train,) = design.decode(unknowns, limits)
        torque = replace(one.case.experiment, phases=train.phases).torque
        network = one.case.experiment.searched.network(one.parameters[None])
        grip = compute_grip(one.case.gripper, network, torque)
        pressed.append(grip.lowest_N > 0)
        share = one.told([train])[1]
        assert (share > 0) == pressed[-1] or abs(share) < 0.01
    assert 0.1 < np.mean(pressed) < 0.9


@pytest.mark.parametrize("rate_Hz", [0.7, 10.0, 100.0])
def test_trains_keep_their_limits(rate_Hz: float) -> None:
    """Where steps are as many as have room, too: at 0.7 Hz, 12 of five readings and more in 70."""
    text = f"measurement: {{rate_Hz: {rate_Hz}, noise: {{level_rad: 3.0e-6}}}}\n"
    text += "only: [endothelial_cell]\ndesign: {steps: 12, largest: 1.0e-9, duration_s: 100.0}"
    limits, _ = set_up_of(text)
    for each in np.random.default_rng(1).random((20, 24)):
        (train,) = design.decode(each, limits)
        assert np.all((train.levels > 0) & (train.levels <= 1.0e-9 * (1 + 1e-12)))
        # Steps start between readings.
        assert np.all(train.starts[1:] % 2 == 1)
        durations_s = [phase.duration_s for phase in train.phases]
        assert min(durations_s) >= 4.5 / rate_Hz * (1 - 1e-9)
        assert 100.0 - 1 / rate_Hz < sum(durations_s) <= 100.0 * (1 + 1e-9)


def test_parameters_that_are_told_to_less_than_an_e_fold_or_trade_have_no_bound() -> None:
    """All four of the paper's drop under its own protocol: c and c_p show as their sum alone."""
    _, (one,) = set_up_of("only: [liquid_drop_2]\nmeasurement: {noise: {level_rad: 3.0e-6}}")
    found = design.rated(one, [one.case.phases], one.case.block.measurement.rate_Hz)
    by_name = dict(zip(one.case.experiment.searched.names, found.bounds, strict=True))
    assert by_name["c"] == by_name["c_p"] == NO_BOUND
    assert by_name["k_p"] < 0.1
    less = design.relative_bounds(np.array([[0.3, 0.0], [0.0, 4.0]]), 1.0)
    assert less == pytest.approx([NO_BOUND, 0.25])


@pytest.mark.parametrize(
    ("text", "held"),
    [
        pytest.param(
            GRIPPER.replace(", liquid_drop_2", ""), "torque_Nm", marks=pytest.mark.nightly
        ),
        (STRESS, "stress_Pa"),
        (CREEP.replace("HELD", "strain").replace("creep", "relaxation"), "strain"),
    ],
)
def test_a_design_is_better_and_keeps_its_limits(
    tmp_path: Path, text: str, held: str, capsys: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(design, "GENERATIONS", 20)
    output = designed(tmp_path, text)
    said = capsys.readouterr().out
    rows = [line for line in said.splitlines() if "bound (%)" in line]
    bounds = np.array([[float(number) for number in row.split()[-2:]] for row in rows])
    assert len(bounds) == 3
    assert bounds[:, 1].max() < 0.7 * bounds[:, 0].max()
    assert "noise of the " in said
    assert "highest rate (Hz)" in said
    assert f"largest {held.partition('_')[0]}" in said
    assert ("jaws" in said) == (held == "torque_Nm")
    (case,) = study_of(output.read_text()).cases.values()
    given = study_of(text).case(case.name)
    largest = max(phase.level for phase in given.phases)
    assert max(phase.level for phase in case.phases) <= largest * (1 + 1e-12)
    assert case.experiment.torque.end_s == pytest.approx(given.experiment.torque.end_s)
    assert len(case.times_s) == len(given.times_s)
    phases = yaml.safe_load(output.read_text())["cases"][case.name]["protocol"]["phases"]
    assert {held, "duration_s"} == set(phases[0])
    before = output.read_bytes()
    assert designed(tmp_path, text).read_bytes() == before


def test_traces_of_one_sample_are_designed_together(
    tmp_path: Path, capsys: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One trace twice has half the variance; two trains tell more than one."""
    monkeypatch.setattr(design, "GENERATIONS", 20)
    limits, (one,) = set_up_of(STRESS)
    ((train,), _) = design.search([one], limits, 20)
    once, twice = one.told([train])[0], one.told([train, train])[0]
    np.testing.assert_allclose(twice, once / np.sqrt(2), rtol=1e-9)
    output = designed(tmp_path, STRESS.replace("steps: 3", "steps: 3, traces: 2"))
    rows = [line.split() for line in capsys.readouterr().out.splitlines() if "bound (%)" in line]
    assert max(float(row[-1]) for row in rows) < 100 * once.max()
    first, second = study_of(output.read_text()).cases.values()
    assert (first.name, second.name) == ("solid_1", "solid_2")
    assert first.parameters == second.parameters
    assert len(first.phases) == len(second.phases) == 3


def test_what_cannot_be_designed_is_said(tmp_path: Path, capsys: Any) -> None:
    config = tmp_path / "my.yaml"
    for block, words in (
        ("design: {stepps: 4}", "Did you mean 'steps'?"),
        ("design: {duration_s: 0.1}", "my.yaml: design.duration_s: found 0.1 s, room for 1 "),
        ("design: {duration_s: 1.0e+9}", "room for 10000000000 readings at 10 Hz; allowed are"),
        ("measurement: {rate_Hz: 1.0e+4}", "room for 4000000 readings at 10000 Hz; allowed"),
        ("measurement: {noise: {level: 0.1, reference: signal}}", "noise: allowed is white no"),
    ):
        config.write_text(f"only: [endothelial_cell]\n{block}\n")
        assert main(["design", str(config)]) == 1
        assert words in capsys.readouterr().err
        assert [*tmp_path.iterdir()] == [config]
