"""Creep and relaxation from a file to verdicts: units, words, checks, and measured traces."""

import json
import re
import shlex
import shutil
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml

from biogrip.arrays import Array
from biogrip.library import Sample, set_up, simulate
from biogrip.physics.instruments import INSTRUMENTS
from biogrip.physics.protocol import hold
from tests.helpers.identified import FEW, by_quantity, identify, told, write_trace
from tests.helpers.places import ROOT
from tests.helpers.runs import ran

SOLID = Sample("zener_maxwell")
TRUTH = {"k": 300.0, "k_p": 200.0, "c": 900.0}
FOUND = TRUTH | {"tau": 3.0}
TIMES: Array = 0.1 * np.arange(1.0, 301.0)
# What only a gripper has; `rad` as a unit or at the end of a key, but for angular frequencies.
OF_A_GRIPPER = re.compile(
    r"\b(jaws?|torques?|rotations?|gripper|arms?|rad(?!/s))\b|_rad\b", re.IGNORECASE
)
NOT_READ = re.compile(r"<style.*?</style>|<script.*?</script>|data:[^\"]*", re.DOTALL)
# What is held, SI units, by what is read: one of each instrument, one over what is held, and one
# without a unit.
CONTROLLED = {"displacement": 3e-9, "stress": 0.02, "compliance": 40.0, "relative_modulus": 0.02}
# Moduli and compliances are over what is held; a relative one is taken as over 1 Pa.
WHOLE = {"relative_modulus": "stress", "compliance": "strain"}


def response(reading: str, held: float) -> Array:
    experiment = set_up(INSTRUMENTS[WHOLE.get(reading, reading)], (hold(30.0, held),), SOLID)
    whole = simulate(experiment, TRUTH, TIMES)
    return whole / held if reading in WHOLE else whole


def noisy(clean: Array, share: float = 0.01, seed: int = 0) -> Array:
    scatter = np.random.default_rng(seed).standard_normal(len(clean))
    return clean + share * np.max(np.abs(clean)) * scatter


@pytest.mark.parametrize("reading", CONTROLLED)
def test_every_reading_is_identified_in_its_own_units_and_words(
    tmp_path: Path, few: Path, reading: str
) -> None:
    instrument, held = INSTRUMENTS[reading], CONTROLLED[reading]
    column = instrument.read.column
    clean = response(reading, held)
    trace = write_trace(tmp_path / "trace.csv", TIMES, noisy(clean), header=f"time_s,{column}")
    page, table, output = (tmp_path / name for name in ("a.html", "a.csv", "a.json"))
    options = ["--model", SOLID.name, "--hold", str(held), "--reading", f"{reading}={column}"]
    options += ["--csv", str(table), "--output", str(output), "--config", str(few)]
    options += ["--report", str(page)] if reading == "compliance" else ["--no-compare"]
    status, printed, _ = identify(trace, *options)
    assert status == 0
    found = json.loads(output.read_text())
    assert found["fit"] == "ok"
    assert "tau value (s),tau low (s),tau high (s)" in table.read_text()
    for name, item in by_quantity(found).items():
        assert item["verdict"] == "determined"
        # Twice the half width of 95 % limits: four standard deviations.
        assert abs(item["value"] - FOUND[name]) < item["high"] - item["low"]
        unit = instrument.stiffness
        assert item["unit"].startswith("s" if name == "tau" else unit[:2].strip("/"))
        assert unit or item["unit"] in ("", "s")
    assert found["instrument"] == instrument.kind
    assert found["reads"] == {"quantity": reading, "unit": instrument.read.unit}
    share = found["noise" + instrument.read.suffix] / np.max(np.abs(clean))
    assert share == pytest.approx(0.01, rel=0.2)
    assert f"noise{instrument.read.suffix},misfit{instrument.read.suffix}," in table.read_text()
    written = page.read_text() if page.exists() else ""
    for said in (printed, json.dumps(found), NOT_READ.sub("", written), table.read_text()):
        assert not OF_A_GRIPPER.search(said), OF_A_GRIPPER.search(said)


@pytest.mark.nightly
def test_the_power_law_of_a_cell_in_an_optical_stretcher() -> None:
    """The exponent is that of a published, independent fit."""
    config = yaml.safe_load((ROOT / "config/measured.yaml").read_text())["cases"]["hl60"]
    given = {key: config[key] for key in ("instrument", "protocol")}
    trace = pd.read_csv(ROOT / "data/measured/hl60.csv")
    found = told(trace["time_s"], trace["strain"], reads="strain", model="springpot", config=given)
    alpha = found.to_frame().loc["alpha"]
    assert alpha["value"] == pytest.approx(0.701, abs=0.011)
    assert alpha["low"] < 0.701 < alpha["high"]


@pytest.mark.nightly
def test_an_instrument_is_added_by_its_recipe(tmp_path: Path) -> None:
    """What the how-to says, done in a copy of the code; and what is said of a wrong unit."""
    for folder in ("src", "config"):
        shutil.copytree(ROOT / folder, tmp_path / folder)
    text = (ROOT / "docs" / "howto" / "instrument.md").read_text(encoding="utf-8")
    difference, apply, simulation, identification = re.findall(r"```\w.*?\n(.*?)```", text, re.S)
    (tmp_path / "tweezers.diff").write_text(difference)
    (tmp_path / "few.yaml").write_text(FEW)
    command = [*shlex.split(identification), "--config", "few.yaml"]
    for line in (shlex.split(apply), [sys.executable, "-c", simulation], command):
        done = ran(tmp_path, *line, PYTHONPATH=str(tmp_path / "src"))
        assert done.status == 0, done.output
    assert re.search(r"elongation +elongation_um, in um", done.output), done.output
    assert re.search(r"k_s +determined: 0\.000\d+ N/m", done.output), done.output
    found = json.loads((tmp_path / "pulled.json").read_text())
    assert (found["fit"], found["instrument"]) == ("ok", "creep")
    assert found["reads"] == {"quantity": "elongation", "unit": "m"}
    assert found["noise_m"] == pytest.approx(2e-8, rel=0.1)
    units = {name: item["unit"] for name, item in by_quantity(found).items()}
    assert units == {"k_s": "N/m", "k_v": "N/m", "c_v": "N s/m", "tau_v": "s"}
    unknown = [*command, "--set", "measurement.reading_unit=mm"]
    refused = ran(tmp_path, *unknown, PYTHONPATH=str(tmp_path / "src"))
    assert refused.status == 1
    assert "found 'mm', allowed are m, um, nm." in refused.output
    assert not OF_A_GRIPPER.search(done.output)
