"""`biogrip design` with a price: the table, the page and the experiments of the chosen set."""

import re
from contextlib import redirect_stdout
from dataclasses import replace
from io import StringIO
from pathlib import Path

import numpy as np
import pytest

from biogrip.cli import main
from biogrip.design import several, within_reach
from biogrip.design.experiment import compute_information, relative_bounds
from biogrip.own_design import at_a_price
from biogrip.study.design_inputs import make_design_inputs, plausible
from biogrip.study.load import load_study, read_configs
from tests.helpers.places import CONFIG

PRICE = """
    {per_second: 1.0, per_reading: 0.01, per_change: 2.0, per_experiment: 5.0, within: 0.12,
     share: 0.7, cells: 8, experiments: 3}"""
ASKED = """
design:
  {{noise_rad: 3.07e-6, readings: 300, fastest_Hz: 1.0e+5, longest_s: 40.0,
   largest_torque_Nm: 1.6e-9, most_steps: 4, candidates: 128, plausible_samples: 2,
   {ranges}
   price: {price}}}
only: [endothelial_cell]
"""
RANGES = "ranges: {k: [30.0, 40.0], c: [150.0, 300.0], c_p: [0.5, 1.0]},"


def design(place: Path, *more: str, price: str = PRICE, ranges: str = RANGES) -> int:
    (place / "asked.yaml").write_text(ASKED.format(price=price, ranges=ranges))
    return main(["design", str(place / "asked.yaml"), "--output", str(place / "out.yaml"), *more])


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    place = tmp_path_factory.mktemp("price")
    said = StringIO()
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(said):
        # What is climbed, and for how many durations, is not what this is about.
        patch.setattr(within_reach, "climb", lambda inputs, torques, *_: list(torques))
        patch.setattr(several, "_DURATIONS", (1.0, 0.5))
        patch.setattr(several, "_READINGS", (1.0, 0.25))
        patch.setattr(at_a_price, "_TRIED", 1)
        assert design(place, "--export", str(place / "bench")) == 0
    return place, said.getvalue()


def test_the_chosen_experiments_tell_and_cost_what_is_said(finished: tuple[Path, str]) -> None:
    """From the files that a study takes, by other code."""
    place, said = finished
    chosen = re.search(r"cheapest, for (\S+): (.*)", said)
    assert chosen
    times = [int(often) for often in re.findall(r"(\d+) × ", chosen[2])]
    total, cost = np.zeros(()), 0.0
    for number, often in enumerate(times, 1):
        files = [CONFIG, place / "asked.yaml", place / f"out_{number}.yaml"]
        case = load_study(read_configs(files), files).cases["endothelial_cell"]
        block = case.design
        cells = plausible(case, replace(block, plausible_samples=40))[8:]
        inputs = replace(make_design_inputs(case), parameters=cells)
        torque = case.problem.torque
        time_s = case.sampling.over(torque.end_s)
        total = total + often * compute_information(inputs.sensitivities(torque, time_s))
        cost += often * (torque.end_s + 0.01 * len(time_s) + 2 * len(case.phases) + 5)
        assert f"endothelial_cell: # {often} × with each cell" in files[-1].read_text()
        readings = (place / "bench" / f"endothelial_cell_{number}_readings.csv").read_text()
        np.testing.assert_allclose(np.array(readings.splitlines()[2:], dtype=float), time_s)
        protocol = (place / "bench" / f"endothelial_cell_{number}_protocol.csv").read_text()
        last_s = float(protocol.splitlines()[-1].split(",")[0])
        assert last_s == pytest.approx(torque.end_s)
    assert cost == pytest.approx(float(chosen[1]), rel=1e-3)
    known = np.all(1.959964 * relative_bounds(total) <= np.log(1.12), axis=1)
    # Of cells that they were not chosen for.
    assert known.mean() >= 0.7
    assert not (place / f"out_{len(times) + 1}.yaml").exists()
    assert len(list((place / "bench").iterdir())) == 2 * (1 + len(times))


def test_the_page_shows_the_front_and_the_chosen_experiments(finished: tuple[Path, str]) -> None:
    place, said = finished
    page = (place / "out.html").read_text()
    assert page.count("<img") == 3
    assert "Costs: 5 an experiment, 1 a second, 0.01 a reading, 2 a change." in page
    chosen = re.search(r"cheapest, for \S+: (.*)", said)
    assert chosen
    for experiment in chosen[1].split("; "):
        assert f"<h2>{experiment}</h2>" in page
    at_once = [
        float(cost)
        for cost in re.findall(r"^ +\d+ \| +(\S+) \|", said, re.MULTILINE)
        if cost != "none"
    ]
    assert at_once == sorted(at_once)
    # One of them again and again is a set, too.
    for once, again in re.findall(r"^ +\d+ \| +(\S+) \| +(\S+) \|", said, re.MULTILINE):
        assert again == "none" or float(once) <= float(again)


SLOW = """
design:
  {noise_rad: 3.07e-6, readings: 300, fastest_Hz: 20.0, longest_s: 40.0,
   largest_torque_Nm: 1.6e-9, most_steps: 4, candidates: 128, plausible_samples: 2,
   ranges: {k: [30.0, 40.0], c: [150.0, 300.0], c_p: [0.5e-3, 1.0e-3]}, price: PRICE}
only: [endothelial_cell]
"""
CREEP = """
only: [cell]
cases:
  cell:
    instrument: creep
    sample: {model: zener_maxwell, k: 300.0, k_p: 200.0, c: 900.0}
    protocol: {phases: [{duration_s: 30.0, stress_Pa: 40.0}]}
    design:
      {largest_stress_Pa: 40.0, noise_strain: 2.0e-4, readings: 60, fastest_Hz: 20.0,
       longest_s: 40.0, most_steps: 4, candidates: 128, plausible_samples: 2,
       ranges: {k: [200.0, 400.0]}, price: PRICE}
"""


@pytest.mark.parametrize(
    ("asked", "named"),
    [(SLOW, "k, k_p and c within"), (CREEP, "k, k_p and c within")],
    ids=["c_p out of reach", "creep"],
)
def test_what_is_asked_of_a_set_is_what_can_be_told(
    asked: str,
    named: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(within_reach, "climb", lambda inputs, torques, *_: list(torques))
    monkeypatch.setattr(several, "_DURATIONS", (1.0,))
    monkeypatch.setattr(at_a_price, "_TRIED", 1)
    # Of an earlier, larger set.
    (tmp_path / "out_3.yaml").write_text("# written_by_biogrip")
    (tmp_path / "asked.yaml").write_text(asked.replace("PRICE", PRICE.strip()))
    files = [str(tmp_path / name) for name in ("asked.yaml", "out.yaml")]
    assert main(["design", files[0], "--output", files[1]]) == 0
    said = capsys.readouterr().out
    assert named in said
    assert "cheapest, for " in said
    assert (tmp_path / "out_1.yaml").is_file()
    assert f"Of an earlier set: {tmp_path / 'out_3.yaml'}." in said


@pytest.mark.parametrize(
    ("price", "ranges", "message"),
    [
        (
            "{cells: 8}",
            RANGES,
            "price: found no cost, allowed is one above zero at least: per_second",
        ),
        (PRICE, "", "price: found no design.ranges, which cells are drawn from; allowed is one"),
        ("{per_second: -1.0}", RANGES, "per_second"),
        ("{per_s: 1.0}", RANGES, "per_second"),
        ("{per_second: 1.0, share: 1.5}", RANGES, "share"),
    ],
)
def test_prices_that_make_no_sense_are_refused(
    price: str, ranges: str, message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert design(tmp_path, price=price, ranges=ranges) != 0
    assert message in capsys.readouterr().err
    assert not (tmp_path / "out.yaml").exists()


def test_a_cell_with_a_trace_has_no_population(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert design(tmp_path, "--after", str(tmp_path / "trace.csv")) != 0
    assert "leave it out with --after" in capsys.readouterr().err
