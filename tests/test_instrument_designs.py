"""`biogrip design` without a gripper: creep and relaxation, against differences of `simulate`."""

import re
from contextlib import redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from scipy.stats import binom

from biogrip.arrays import Array
from biogrip.cli import main
from biogrip.errors import BiogripError
from biogrip.experiment.protocol import Phase, hold, load
from biogrip.experiment.sample import MODELS
from biogrip.experiment.sample_model import in_pascals
from biogrip.instrument.instruments import INSTRUMENTS
from biogrip.library import Sample, identify_sample, judge, set_up, simulate
from biogrip.products.files.identifications import columns
from biogrip.study.design_inputs import plausible
from tests.helpers.default import study_of
from tests.test_instruments import OF_A_GRIPPER

LASTS_S, READINGS = 30.0, 90
RANGES = {"k_alpha": [500.0, 4000.0], "alpha": [0.2, 0.5]}


@dataclass(frozen=True)
class Ask:
    """What is asked of an instrument, by what it reads."""

    model: str
    truth: dict[str, float]
    largest: float
    noise: float
    shape: str = "steps"

    def config(self, reading: str, **more: Any) -> dict[str, Any]:
        instrument = INSTRUMENTS[reading]
        held = instrument.controlled.column
        case: dict[str, Any] = {
            "instrument": instrument.kind,
            "sample": {"model": self.model, **self.truth},
            "protocol": {"phases": [{"duration_s": LASTS_S, held: self.largest}]},
            "measurement": {"rate_Hz": READINGS / LASTS_S},
            "design": {
                f"largest_{held}": self.largest,
                f"noise_{instrument.read.column.rpartition('_')[2]}": self.noise,
                "readings": READINGS,
                "fastest_Hz": 50.0,
                "longest_s": LASTS_S,
                "candidates": 128,
                "most_steps": 4,
                "shapes": [self.shape],
            },
        }
        design = {**case["design"], **more}
        case["design"] = {key: value for key, value in design.items() if value is not None}
        return {"only": ["cell"], "cases": {"cell": case}}


SOLID = {"k": 300.0, "k_p": 200.0, "c": 900.0}
ASKS = {
    "strain": Ask("zener_maxwell", SOLID, 40.0, 2e-3),
    "displacement": Ask("springpot", {"k_alpha": 0.02, "alpha": 0.3}, 1e-9, 1e-9),
    "stress": Ask("zener_maxwell", SOLID, 1.0, 20.0, "sinusoids"),
    "force": Ask("maxwell", {"k": 0.02, "c": 0.1}, 1e-6, 2e-10, "ramps"),
}
# Of samples within RANGES.
RANGED = {
    "strain": Ask(
        "fractional_zener", {"k": 800.0, "k_p": 100.0, "k_alpha": 2e3, "alpha": 0.4}, 40.0, 2e-4
    ),
    "stress": Ask("springpot", {"k_alpha": 1e3, "alpha": 0.4}, 0.5, 2.0),
}


@dataclass(frozen=True)
class Found:
    """What the command said and wrote."""

    reading: str
    ask: Ask
    said: str
    folder: Path

    @property
    def written(self) -> dict[str, Any]:
        case: dict[str, Any] = yaml.safe_load((self.folder / "out.yaml").read_text())
        return case["cases"]["cell"]

    @property
    def phases(self) -> tuple[Phase, ...]:
        held = INSTRUMENTS[self.reading].controlled.column
        loads = [
            load(
                phase["duration_s"],
                phase[held],
                phase.get(f"to_{held}"),
                phase.get(f"amplitude_{held.rpartition('_')[2]}"),
                phase.get("frequency_Hz"),
            )
            for phase in self.written["protocol"]["phases"]
        ]
        lasting = [phase["duration_s"] for phase in self.written["protocol"]["phases"]]
        return tuple(Phase(s, one, one) for s, one in zip(lasting, loads, strict=True))

    @property
    def times_s(self) -> Array:
        bursts = self.written["measurement"]["bursts"]
        return np.concatenate(
            [one["from_s"] + np.arange(one["samples"]) / one["rate_Hz"] for one in bursts]
        )

    @property
    def promised(self) -> list[tuple[float, float]]:
        """Bounds in percent as configured and designed, of each parameter."""
        rows = re.findall(r"^  \w+ +(\S+)(?: %)? \| (\S+)(?: %)?$", self.said, re.MULTILINE)
        return [(float(one.replace("none", "inf")), float(other)) for one, other in rows]


def commanded(
    folder: Path, reading: str, *options: str, ask: Ask | None = None, **more: Any
) -> Found:
    ask = ask or ASKS[reading]
    (folder / "asked.yaml").write_text(yaml.safe_dump(ask.config(reading, **more)))
    said = StringIO()
    command = ["design", str(folder / "asked.yaml"), "--output", str(folder / "out.yaml")]
    with redirect_stdout(said):
        assert main([*command, "--force", *options]) == 0
    return Found(reading, ask, said.getvalue(), folder)


@pytest.fixture(scope="module", params=ASKS)
def found(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Found:
    return commanded(tmp_path_factory.mktemp("design"), request.param)


def bounds(
    found: Found, phases: tuple[Phase, ...], times: Array, truth: dict[str, float] | None = None
) -> Array:
    """Compute bounds in percent from differences of simulated traces."""
    ask, truth = found.ask, truth or found.ask.truth
    experiment = set_up(INSTRUMENTS[found.reading], phases, Sample(ask.model))
    rows = []
    for name, value in truth.items():
        either = [
            simulate(experiment, {**truth, name: value * np.exp(h)}, times) for h in (1e-3, -1e-3)
        ]
        rows.append((either[0] - either[1]) / 2e-3 / ask.noise)
    information = np.array(rows) @ np.array(rows).T
    return 100 * np.sqrt(np.diag(np.linalg.inv(information)))


def test_bounds_are_those_of_simulated_traces_and_beat_a_hold(found: Found) -> None:
    designed = bounds(found, found.phases, found.times_s)
    assert len(found.times_s) == READINGS
    # In print they have two digits.
    np.testing.assert_allclose([own for _, own in found.promised], designed, rtol=0.06)
    assert designed.max() < 20
    plain = (hold(LASTS_S, found.ask.largest),)
    even = np.arange(1, READINGS + 1) * LASTS_S / READINGS
    configured = bounds(found, plain, even)
    assert designed.max() < configured.max()
    np.testing.assert_allclose([one for one, _ in found.promised], configured, rtol=0.06)


def test_it_holds_what_was_asked_in_the_units_of_the_instrument(found: Found) -> None:
    highest = max(
        float(abs(one.left.at(np.linspace(0, one.duration_s, 10_000))).max())
        for one in found.phases
    )
    assert 0.9 * found.ask.largest < highest <= found.ask.largest * (1 + 1e-9)
    text = (found.folder / "out.yaml").read_text()
    held = INSTRUMENTS[found.reading].controlled.column
    part = {"ramps": f"to_{held}:", "sinusoids": f"amplitude_{held.rpartition('_')[2]}:"}
    assert part.get(found.ask.shape, held) in text
    merged = found.ask.config(found.reading)
    merged["cases"]["cell"] |= found.written
    case = study_of(yaml.safe_dump(merged)).cases["cell"]
    assert case.noise.level_rad == found.ask.noise
    assert case.samples == READINGS
    assert case.problem.torque.end_s == pytest.approx(LASTS_S)


def test_its_words_are_those_of_the_instrument(found: Found) -> None:
    page = (found.folder / "out.html").read_text()
    assert not re.search(r'(src|href)="(?!data:|#)', page)
    assert page.count("<img") == 2
    shown = re.sub(r"<meta[^>]*>|<style.*?</style>|data:[^\"]*", "", page, flags=re.DOTALL)
    text = (found.folder / "out.yaml").read_text().replace("level_rad", "")
    for words in (found.said, shown, text):
        assert not OF_A_GRIPPER.search(words), OF_A_GRIPPER.search(words)
        assert not re.search(r"\b(camera|voltage|nN m|µrad)\b", words)
    held = INSTRUMENTS[found.reading].controlled
    assert f"this {held.name} is better" in found.said
    assert (f"<th>{held.name} ({held.unit})</th>" if held.unit else "<th>strain</th>") in page


@pytest.mark.parametrize("found", ["strain"], indirect=True)
def test_intervals_from_traces_of_it_hold_the_truth(found: Found) -> None:
    """Fewer of 50 with a chance of one in a thousand."""
    experiment = set_up(INSTRUMENTS[found.reading], found.phases, Sample(found.ask.model))
    clean = simulate(experiment, found.ask.truth, found.times_s)
    rng = np.random.default_rng(3)
    held = dict.fromkeys(found.ask.truth, 0)
    for _ in range(50):
        trace = clean + found.ask.noise * rng.standard_normal(READINGS)
        best = identify_sample(experiment, found.times_s, trace)
        for finding in judge(experiment, found.times_s, trace, best).findings:
            name = finding.quantity.label
            if name in held:
                assert finding.low is not None
                assert finding.high is not None
                held[name] += finding.low <= found.ask.truth[name] <= finding.high
    fewest = int(binom.ppf(1e-3 / len(held), 50, 0.95))
    assert min(held.values()) >= fewest


@pytest.mark.parametrize("reading", RANGED)
def test_of_plausible_fractional_samples_the_worst_is_said(reading: str, tmp_path: Path) -> None:
    """With names of several lengths one below the other."""
    ask = RANGED[reading]
    found = commanded(tmp_path, reading, ask=ask, ranges=RANGES, plausible_samples=3)
    case = study_of((tmp_path / "asked.yaml").read_text()).cases["cell"]
    drawn = plausible(case, case.design)
    assert len(drawn) == 3
    names = list(ask.truth)
    for name, (low, high) in RANGES.items():
        own = drawn[:, names.index(name)]
        assert low < own.min() < own.max() < high
    even = np.arange(1, READINGS + 1) * LASTS_S / READINGS
    experiments = ((hold(LASTS_S, ask.largest),), even), (found.phases, found.times_s)
    worst = [
        np.max([bounds(found, *each, dict(zip(names, one, strict=True))) for one in drawn], axis=0)
        for each in experiments
    ]
    np.testing.assert_allclose(np.transpose(found.promised), worst, rtol=0.06)
    assert worst[1].max() < 0.7 * worst[0].max()
    rows = [line for line in found.said.splitlines() if " | " in line][1:]
    assert len({line.index("|") for line in rows}) == 1


@pytest.mark.parametrize("found", ["strain"], indirect=True)
def test_after_a_trace_the_next_experiment_tells_more(found: Found, tmp_path: Path) -> None:
    ask = found.ask
    experiment = set_up(INSTRUMENTS["strain"], (hold(LASTS_S, ask.largest),), Sample(ask.model))
    times = np.arange(1, READINGS + 1) * LASTS_S / READINGS
    trace = simulate(experiment, ask.truth, times)
    trace += ask.noise * np.random.default_rng(0).standard_normal(READINGS)
    rows = [f"{t:.6g},{v:.9e}" for t, v in zip(times, trace, strict=True)]
    (tmp_path / "first.csv").write_text("\n".join(["time_s,strain", *rows]) + "\n")
    after = ("--after", str(tmp_path / "first.csv"))
    both = commanded(tmp_path, "strain", *after, plausible_samples=2)
    for (_, one), (_, other) in zip(both.promised, found.promised, strict=True):
        assert one < other
    command = ["design", str(tmp_path / "asked.yaml"), "--output", str(tmp_path / "out.yaml")]
    for options in (("--reading", "compliance=strain"), ("--hold", "40")):
        assert main([*command, *after, *options, "--force"]) == 1


@pytest.mark.parametrize(
    ("design", "said"),
    [
        ({"noise_strain": None, "noise_rad": 1e-3}, "noise_rad: is not of stress that is held and"),
        ({"noise_strain": None}, "found none, allowed is noise_strain."),
        ({"largest_stress_Pa": None, "largest_torque_Nm": 1e-9}, "allowed is largest_stress_Pa"),
        ({"largest_strain": 1.0}, "largest_strain: is not of stress that is held and strain"),
        (
            {"sequence": {"cells": 2, "experiments": 2}, "ranges": {"k": [200.0, 400.0]}},
            "sequence: is of the gripper; leave it out with creep",
        ),
    ],
)
def test_what_is_not_of_the_instrument_is_refused(design: dict[str, Any], said: str) -> None:
    config = ASKS["strain"].config("strain", **design)
    with pytest.raises(BiogripError, match=said):
        study_of(yaml.safe_dump(config))


def test_estimates_of_stressed_samples_are_written_in_pascals() -> None:
    """The paper's four columns are in N/m, and a study's figures look for their own."""
    stressed = in_pascals(MODELS["zener_maxwell"])
    assert {p.column for p in stressed.parameters} <= set(columns(stressed))
    assert {"k_N_per_m", "c_p_Ns_per_m"} <= set(columns(MODELS["zener_maxwell"]))
