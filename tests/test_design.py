"""`biogrip design`: bounds, limits of trains, jaws that press, and what is written."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from biogrip.arrays import Array
from biogrip.cli import main
from biogrip.design import (
    NO_BOUND,
    Limits,
    Plausible,
    decode,
    information,
    make_limits,
    make_plausible,
    rated,
    relative_bounds,
    search,
)
from biogrip.library import simulate
from biogrip.physics.protocol import Sampling
from biogrip.physics.simulation import compute_grip
from tests.helpers.default import study_of

GRIPPER = """
only: [endothelial_cell]
measurement: {noise: {level_rad: 3.0e-6}}
cases: {endothelial_cell: {fixed: {c_p: 1.0e-3}}}
design: {rate_Hz: 100, steps: 4, factor: 1.3}
"""
CREEP = """
instrument: creep
protocol: {phases: [{duration_s: 30.0, HELD: 1.0}]}
measurement: {rate_Hz: 10.0, noise: {level: 0.02}}
only: [solid]
cases: {solid: {sample: {model: zener_maxwell, k: 300.0, k_p: 200.0, c: 900.0}}}
design: {steps: 3}
"""


def designed(folder: Path, text: str = GRIPPER) -> Path:
    (folder / "my.yaml").write_text(text)
    assert main(["design", str(folder / "my.yaml")]) == 0
    return folder / "my_designed.yaml"


def set_up(text: str = GRIPPER) -> tuple[list[Plausible], Limits]:
    study = study_of(text)
    samples = list(make_plausible(list(study.cases.values()), study.config.design))
    return samples, make_limits(samples, study.config.design)


@pytest.mark.nightly
def test_a_design_is_better_keeps_its_limits_and_runs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    output = designed(tmp_path)
    said = capsys.readouterr().out
    rows = [line for line in said.splitlines() if "worst of 9 samples" in line]
    worst = np.array([[float(number) for number in row.split()[-2:]] for row in rows])
    assert len(worst) == 3
    assert worst[:, 1].max() < 0.7 * worst[:, 0].max()
    # Noise, torque, rate and force stand beside the bounds.
    for label in ("noise of the rotation (rad)", "largest torque (N m)", "highest rate (Hz)"):
        assert label in said
    (case,) = study_of(output.read_text()).cases.values()
    assert max(phase.left.value_Nm for phase in case.phases) <= 1.6e-9 * (1 + 1e-12)
    assert case.problem.torque.end_s == pytest.approx(400.0)
    assert len(case.sampling.over(400.0)) <= 4001
    # The same command gives the same bytes.
    before = output.read_bytes()
    assert designed(tmp_path).read_bytes() == before


def test_the_jaws_press_every_plausible_sample() -> None:
    """By the force of the jaws over the whole protocol, which the search does not compute so."""
    samples, limits = set_up()
    unknowns = np.random.default_rng(0).random((20, 3 * limits.steps))
    for each in unknowns:
        phases = decode(each[None], samples, limits).phases
        case = samples[0].case
        torque = replace(case.problem, phases=phases).torque
        for values in samples[0].parameters:
            network = case.problem.searched.network(values[None])
            assert compute_grip(case.gripper, network, torque, nonlinear=False).lowest_N > 0


def test_bounds_are_those_of_the_inverse_information() -> None:
    """By central differences of simulated readings; the truncation of 1e-4 is some 1e-8.

    Of a train that a short search finds, for which sums over readings are integrals.
    """
    samples, limits = set_up()
    (sample,) = samples
    train, _ = search(samples, limits, 40)
    problem = replace(sample.case.problem, phases=train.phases)
    found = rated(sample, train.phases, Sampling(bursts=train.bursts))
    names, step = problem.searched.names, 1e-4

    def read(shift: Array) -> Array:
        values = dict(zip(names, sample.parameters[0] * np.exp(shift), strict=True))
        return simulate(problem, {**problem.fixed, **values}, found.times_s)

    shifts = step * np.eye(len(names))
    rows = np.array([(read(own) - read(-own)) / (2 * step) for own in shifts]) / sample.noise
    expected = np.sqrt(np.diagonal(np.linalg.inv(rows @ rows.T)))
    assert found.bounds[0] == pytest.approx(expected, rel=1e-4)
    searched = relative_bounds(information(sample, train))[0, 0]
    assert searched == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("rate_Hz", [0.7, 10.0, 1000.0])
def test_trains_keep_their_limits(rate_Hz: float) -> None:
    """Where steps are as many as have room, too: at 0.7 Hz, 12 of five readings and more in 70."""
    block = f"steps: 12, largest: 1.0e-9, duration_s: 100.0, rate_Hz: {rate_Hz}"
    samples, limits = set_up(GRIPPER.split("design:")[0] + f"design: {{{block}}}")
    unknowns = np.random.default_rng(1).random((20, 36 if limits.shares_readings else 24))
    for each in unknowns:
        train = decode(each[None], samples, limits)
        assert np.all((train.levels > 0) & (train.levels <= 1.0e-9 * (1 + 1e-12)))
        assert train.durations_s.min() >= 4.5 / rate_Hz * (1 - 1e-9)
        end_s = sum(phase.duration_s for phase in train.phases)
        assert 100.0 - 1 / rate_Hz < end_s <= 100.0 * (1 + 1e-9)
        times_s = Sampling(bursts=train.bursts).over(end_s)
        assert len(times_s) <= 4001
        assert np.diff(times_s).min() >= (1 - 1e-6) / rate_Hz
        assert times_s[-1] <= end_s


def test_parameters_that_trade_have_no_bound() -> None:
    """All four of the paper's drop under its own protocol: c and c_p show as their sum alone."""
    text = "only: [liquid_drop_2]\nmeasurement: {noise: {level_rad: 3.0e-6}}"
    (one,), _ = set_up(text)
    found = rated(one, one.case.phases, one.case.sampling)
    by_name = dict(zip(one.case.searched.names, found.bounds[0], strict=True))
    assert by_name["c"] == by_name["c_p"] == NO_BOUND
    assert by_name["k_p"] < 0.1


@pytest.mark.parametrize(("instrument", "held"), [("creep", "stress_Pa"), ("relaxation", "strain")])
def test_creep_and_relaxation_are_designed(
    tmp_path: Path, instrument: str, held: str, capsys: pytest.CaptureFixture[str]
) -> None:
    output = designed(tmp_path, CREEP.replace("HELD", held).replace("creep", instrument))
    said = capsys.readouterr().out
    assert "jaws" not in said
    assert f"largest {held.removesuffix('_Pa')}" in said
    phases = yaml.safe_load(output.read_text())["cases"]["solid"]["protocol"]["phases"]
    assert {held, "duration_s"} == set(phases[0])


@pytest.mark.parametrize(
    ("block", "words"),
    [
        ("{stepps: 4}", "Did you mean 'steps'?"),
        ("{steps: 0}", "found 0"),
        ("{parameters: [q]}", "found 'q', allowed are k, k_p, c"),
        ("{rate_Hz: 1.0e-3}", "found room for 0 readings"),
    ],
)
def test_what_cannot_be_designed_is_said(
    tmp_path: Path, block: str, words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    config = tmp_path / "my.yaml"
    config.write_text(f"only: [endothelial_cell]\ndesign: {block}\n")
    assert main(["design", str(config)]) == 1
    said = capsys.readouterr().err
    assert words in said
    assert "Traceback" not in said
    assert not (tmp_path / "my_designed.yaml").exists()
