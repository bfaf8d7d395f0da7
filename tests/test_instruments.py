import json
import re
from pathlib import Path

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.library import Sample, set_up, simulate
from biogrip.physics.instruments import INSTRUMENTS
from biogrip.physics.protocol import hold
from tests.helpers.identified import by_quantity, identify, write_trace

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


@pytest.mark.parametrize("reading", CONTROLLED)
def test_every_reading_is_identified_in_its_own_units_and_words(
    tmp_path: Path, few: Path, reading: str
) -> None:
    instrument, held = INSTRUMENTS[reading], CONTROLLED[reading]
    column = instrument.read.column
    experiment = set_up(INSTRUMENTS[WHOLE.get(reading, reading)], (hold(30.0, held),), SOLID)
    clean = simulate(experiment, TRUTH, TIMES) / (held if reading in WHOLE else 1)
    noisy = clean + 0.01 * clean.max() * np.random.default_rng(0).standard_normal(len(clean))
    trace = write_trace(tmp_path / "trace.csv", TIMES, noisy, header=f"time_s,{column}")
    page, table, output = (tmp_path / name for name in ("a.html", "a.csv", "a.json"))
    options = ["--model", SOLID.name, "--hold", str(held), "--reading", f"{reading}={column}"]
    options += ["--report", str(page)] if reading == "compliance" else ["--no-compare"]
    outputs = "--csv", table, "--output", output, "--config", few
    status, printed, _ = identify(trace, *options, *outputs)
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
