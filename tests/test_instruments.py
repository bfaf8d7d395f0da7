"""Creep and relaxation from a file to verdicts: units, words, checks, and measured traces."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from biogrip.arrays import Array
from biogrip.cli import main
from biogrip.errors import BiogripError
from biogrip.library import Sample, identify_sample, judge, set_up, simulate
from biogrip.physics.instruments import INSTRUMENTS
from biogrip.physics.protocol import Harmonic, Load, Phase, hold
from tests.helpers.default import study_of
from tests.helpers.places import ROOT

FEW = "least_squares: {candidates: 100, starts: 4}\nmodel_selection: {models: [maxwell]}\n"
MEASURED = ROOT / "data/measured"
SOLID = Sample("zener_maxwell")
TRUTH = {"k": 300.0, "k_p": 200.0, "c": 900.0}
TIMES: Array = 0.1 * np.arange(1.0, 301.0)
# What only a gripper has; `rad` as a unit or at the end of a key.
OF_A_GRIPPER = re.compile(
    r"\b(jaws?|torques?|rotations?|gripper|arms?|rad)\b|_rad\b", re.IGNORECASE
)
# What is held, SI units, by what is read.
CONTROLLED = {
    "displacement": 3e-9,
    "strain": 5.0,
    "compliance": 1.0,
    "force": 2e-6,
    "stress": 0.02,
    "modulus": 1.0,
}


def response(reading: str, held: float, parameters: dict[str, float] = TRUTH) -> Array:
    experiment = set_up(INSTRUMENTS[reading], (hold(30.0, held),), SOLID)
    return simulate(experiment, parameters, TIMES)


def written(path: Path, column: str, values: Array, times: Array = TIMES) -> Path:
    rows = [f"{t:.6g},{v:.9e}" for t, v in zip(times, values, strict=True)]
    path.write_text("\n".join([f"time_s,{column}", *rows]) + "\n")
    return path


def noisy(clean: Array, share: float = 0.01, seed: int = 0) -> Array:
    scatter = np.random.default_rng(seed).standard_normal(len(clean))
    return clean + share * np.max(np.abs(clean)) * scatter


def identified(trace: Path, *options: str, config: str = FEW) -> dict[str, Any]:
    given = trace.with_suffix(".yaml")
    given.write_text(config)
    output = trace.with_suffix(".json")
    command = ["identify", str(trace), "--config", str(given), "--output", str(output)]
    assert main([*command, *options]) == 0
    found: dict[str, Any] = json.loads(output.read_text())
    return found


def by_name(found: dict[str, Any]) -> dict[str, dict[str, Any]]:
    return {item["quantity"]: item for item in found["quantities"]}


@pytest.mark.parametrize("reading", CONTROLLED)
def test_every_reading_is_identified_in_its_own_units_and_words(
    tmp_path: Path, reading: str, capsys: pytest.CaptureFixture[str]
) -> None:
    instrument, held = INSTRUMENTS[reading], CONTROLLED[reading]
    column = instrument.read.column
    trace = written(tmp_path / "trace.csv", column, noisy(response(reading, held)))
    page, table = tmp_path / "page.html", tmp_path / "table.csv"
    options = ["--model", SOLID.name, "--hold", str(held), "--report", str(page)]
    options += ["--csv", str(table)]
    found = identified(trace, "--reading", f"{reading}={column}", *options)
    assert found["fit"] == "ok"
    for name, item in by_name(found).items():
        assert item["verdict"] == "determined"
        # Twice the half width of 95 % limits: four standard deviations.
        assert abs(item["value"] - TRUTH[name]) < item["high"] - item["low"]
        unit = "Pa" if instrument.per_area else "N/m"
        assert item["unit"].startswith(unit[:2].strip("/"))
    assert found["instrument"] == instrument.kind
    assert found["reads"] == {"quantity": reading, "unit": instrument.read.unit}
    share = found["noise" + instrument.read.suffix] / np.max(np.abs(response(reading, held)))
    assert share == pytest.approx(0.01, rel=0.2)
    text = re.sub(
        r"<style.*?</style>|<script.*?</script>|data:[^\"]*", "", page.read_text(), flags=re.S
    )
    assert f"noise{instrument.read.suffix},misfit{instrument.read.suffix}," in table.read_text()
    for said in (capsys.readouterr().out, json.dumps(found), text, table.read_text()):
        assert not OF_A_GRIPPER.search(said), OF_A_GRIPPER.search(said)


def test_what_is_not_held_is_asked_for_and_kinds_do_not_mix(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    trace = written(tmp_path / "t.csv", "strain", response("strain", 1.0))
    held = "protocol: {phases: [{duration_s: 5, stress_Pa: 1}]}\n"
    (relaxing := tmp_path / "relaxing.yaml").write_text(f"instrument: relaxation\n{held}")
    (mistyped := tmp_path / "mistyped.yaml").write_text(f"instrument: creeep\n{held}")
    strain = ("--reading", "strain=strain")
    refusals = {
        strain: "--hold: is missing; allowed is the stress in Pa that was",
        ("--reading", "strian=strain"): "--reading: measurement.strian: unknown key. Did you mean",
        ("--reading", "modulus=strain", "--set", "measurement.reading_unit=mm"): "--set: "
        "measurement.reading_unit: found 'mm', allowed are Pa, kPa",
        ("--reading", "strain=x", "--hold", "1"): "Say which is which by time and strain",
        (*strain, "--hold", "1e99"): "--hold: protocol.phases[0].stress_Pa: found 1e+99, allowed",
        (*strain, "--config", str(relaxing)): "--reading: measurement.strain: is not what "
        "relaxation reads where",
        (*strain, "--config", str(mistyped)): "mistyped.yaml, line 1: instrument: found 'creeep'. "
        "Did you mean 'creep'?",
    }
    for options, message in refusals.items():
        assert main(["identify", str(trace), *options]) == 1
        assert message in capsys.readouterr().err


@pytest.mark.parametrize(
    ("config", "message"),
    [
        ("instrument: creeep", r"found 'creeep'. Did you mean 'creep'\? Allowed: gripper, creep, "),
        ("instrument: creep", r"torque_Nm: is not what creep holds; allowed is force_N or stress_"),
        (
            "instrument: relaxation\nprotocol: {phases: [{duration_s: 5, stress_Pa: 1}]}",
            "stress_Pa: is not what relaxation holds; allowed is displacement_m or strain",
        ),
        (
            "instrument: creep\n"
            "protocol: {phases: [{duration_s: 5, stress_Pa: 1}, {duration_s: 5, force_N: 1}]}",
            "force_N: does not go with stress_Pa in another phase",
        ),
    ],
)
def test_a_config_that_holds_what_its_instrument_cannot_is_explained(
    config: str, message: str
) -> None:
    with pytest.raises(BiogripError, match=message):
        study_of(config)


def test_a_study_mixes_instruments() -> None:
    study = study_of(
        "only: [pipette, endothelial_cell]\n"
        "cases:\n"
        "  pipette:\n"
        "    instrument: creep\n"
        "    sample: {model: maxwell, k: 0.05, c: 0.2}\n"
        "    protocol: {phases: [{duration_s: 60, force_N: 1.0e-9}]}\n"
    )
    units = {name: case.sample.model.stiffness_unit for name, case in study.cases.items()}
    assert units == {"pipette": "N/m", "endothelial_cell": "N/m"}
    assert study.gripped == ["endothelial_cell"]
    assert not study.cases["pipette"].problem.torque.deforms


def test_a_compliance_is_the_strain_over_the_stress(tmp_path: Path) -> None:
    strain = noisy(response("strain", 40.0), seed=3)
    protocol = "instrument: creep\nprotocol: {phases: [{duration_s: 30, stress_Pa: 40}]}\n"
    options = ("--model", SOLID.name, "--reading")
    compliance = written(tmp_path / "j.csv", "J (1/kPa)", 1e3 * strain / 40)
    one = identified(
        written(tmp_path / "s.csv", "strain", strain), *options, "strain=strain",
        config=protocol + FEW,
    )  # fmt: skip
    other = identified(compliance, *options, "compliance=J (1/kPa)", config=protocol + FEW)
    for name, item in by_name(one).items():
        assert by_name(other)[name]["value"] == pytest.approx(item["value"], rel=1e-4)


def test_readings_at_the_instant_of_a_step_are_left_out(tmp_path: Path) -> None:
    """A rheometer's first row is at 0, with the modulus that it jumped to."""
    times = np.append(0.0, TIMES)
    values = np.append(500.0, noisy(response("modulus", 1.0)))
    trace = written(tmp_path / "g.csv", "modulus_Pa", values, times)
    found = identified(trace, "--reading", "modulus=modulus_Pa", "--model", SOLID.name)
    assert found["fit"] == "ok"
    assert found["samples"] == len(TIMES)
    assert any(
        "Left out at the instant of a step: 1 reading" in note["text"] for note in found["notes"]
    )


@pytest.mark.nightly
def test_readings_that_scatter_more_at_first_are_doubted_and_can_be_left_out(
    tmp_path: Path,
) -> None:
    """As a rheometer's, which averages for longer and longer."""
    times = np.geomspace(0.05, 60.0, 400)
    experiment = set_up(INSTRUMENTS["modulus"], (hold(60.0, 1.0),), SOLID)
    clean = simulate(experiment, TRUTH, times)
    scatter = np.random.default_rng(1).standard_normal(len(times))
    trace = written(tmp_path / "g.csv", "modulus_Pa", clean + 3 / times * scatter, times)
    options = ["--reading", "modulus=modulus_Pa", "--model", SOLID.name]
    found = identified(trace, *options)
    assert found["fit"] == "doubtful"
    assert "The noise differs from one part of the trace to another" in " ".join(found["reasons"])
    later = identified(trace, *options, "--from", "10")
    assert later["samples"] == np.count_nonzero(times >= 10)
    assert by_name(later)["k_p"]["value"] == pytest.approx(TRUTH["k_p"], rel=0.01)
    # A protocol that is not the right one is still rejected.
    ramp = (
        "instrument: relaxation\n"
        "protocol:\n  phases:\n"
        "    - {duration_s: 6, strain: 0, to_strain: 1}\n    - {duration_s: 54, strain: 1}\n"
    )
    assert identified(trace, *options, config=ramp + FEW)["fit"] == "rejected"


@pytest.mark.parametrize("reading", ["stress", "modulus"])
def test_oscillations_about_zero_are_identified(tmp_path: Path, reading: str) -> None:
    """Nothing is held at the ends of the phase: the amplitude is what is."""
    amplitude = 0.02
    swing = Load(0.0, harmonics=(Harmonic(amplitude, np.pi, -np.pi / 2),))
    experiment = set_up(INSTRUMENTS["stress"], (Phase(20.0, swing, swing),), SOLID)
    times: Array = 0.02 * np.arange(1.0, 1000.0)
    values = noisy(simulate(experiment, TRUTH, times)) / (1 if reading == "stress" else amplitude)
    trace = written(tmp_path / "t.csv", INSTRUMENTS[reading].read.column, values, times)
    config = (
        "instrument: relaxation\nprotocol:\n  phases:\n"
        "    - {duration_s: 20, strain: 0, amplitude_strain: 0.02, frequency_Hz: 0.5}\n"
    )
    column = INSTRUMENTS[reading].read.column
    options = ["--reading", f"{reading}={column}", "--model", SOLID.name]
    for name, item in by_name(identified(trace, *options, config=config + FEW)).items():
        assert abs(item["value"] - TRUTH[name]) < item["high"] - item["low"]


def test_the_library_takes_any_instrument() -> None:
    experiment = set_up(INSTRUMENTS["modulus"], (hold(30.0, 1.0),), SOLID)
    trace = noisy(simulate(experiment, TRUTH, TIMES))
    found = identify_sample(experiment, TIMES, trace)
    for finding in judge(experiment, TIMES, trace, found).findings:
        assert finding.low is not None
        assert finding.high is not None
        error = finding.value - TRUTH[finding.quantity.label]
        assert abs(error) < finding.high - finding.low
        assert finding.quantity.unit.startswith("Pa")


# Published fits, and how close ours come: HL60 by an independent fit, fish muscle by pyRheo, which
# minimises relative residuals as equal relative weights do.
def test_the_power_law_of_a_cell_in_an_optical_stretcher(tmp_path: Path) -> None:
    config = yaml.safe_load((ROOT / "config/measured.yaml").read_text())["cases"]["hl60"]
    trace = tmp_path / "hl60.csv"
    trace.write_text((MEASURED / "hl60.csv").read_text())
    text = yaml.safe_dump({key: config[key] for key in ("instrument", "protocol")}) + FEW
    found = identified(trace, "--reading", "strain=strain", "--model", "springpot", config=text)
    alpha = by_name(found)["alpha"]
    assert alpha["value"] == pytest.approx(0.701, abs=0.011)
    assert alpha["low"] < 0.701 < alpha["high"]


def test_the_two_springpots_of_fish_muscle() -> None:
    """Fitted only: limits of two springpots take fifty times as long."""
    times, modulus, sd = np.loadtxt(MEASURED / "fish_muscle.csv", delimiter=",", skiprows=1).T
    model = Sample("springpots_in_series")
    experiment = set_up(INSTRUMENTS["modulus"], (hold(times[-1], 1.0),), model).weighted(sd)
    found = identify_sample(experiment, times, modulus)
    values = dict(zip(model.model.names, found.parameters, strict=True))
    published = {"k_alpha": 869957.81, "alpha": 0.67438, "k_beta": 22074.487, "beta": 0.11006}
    assert values == pytest.approx(published, rel=0.01)


@pytest.mark.nightly
def test_mucus_is_fitted_better_than_published(tmp_path: Path) -> None:
    """With the published model; exact inversion of the published values leaves 0.0039."""
    trace = tmp_path / "mucus.csv"
    trace.write_text((MEASURED / "mucus.csv").read_text())
    options = ["--reading", "compliance=compliance_per_Pa", "--model", "springpot_beside_damper"]
    found = identified(trace, *options)
    assert found["samples"] * found["misfit_per_Pa"] ** 2 < 0.0039
