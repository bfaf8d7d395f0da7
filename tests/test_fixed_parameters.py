"""`--fix` and `fixed`: parameters at known values, in what is identified and in what is said."""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import curve_fit

from biogrip.arrays import Array
from biogrip.library import Sample, set_up, simulate
from tests.helpers.default import STUDY
from tests.helpers.identified import FEW, identify, told, write_trace

SAMPLE = Sample("generalized_maxwell")
TRUTH = {"k": 20.0, "k_p": 5.0, "c": 400.0, "c_p": 50.0}
EXPERIMENT = set_up(STUDY.gripper, STUDY.phases, SAMPLE)
TIMES = np.arange(401.0)
# A cell's at 1 Hz, with 2 % noise.
CLEAN = simulate(EXPERIMENT, TRUTH, TIMES)
TRACE = CLEAN + 0.02 * CLEAN.max() * np.random.default_rng(0).standard_normal(len(TIMES))


def test_the_others_are_scipys() -> None:
    fixed = {"k_p": 4.9, "c_p": 50.0}
    free = [name for name in SAMPLE.model.names if name not in fixed]

    def response(times: Array, *logs: float) -> Array:
        values = fixed | dict(zip(free, np.exp(logs).tolist(), strict=True))
        return 1e6 * simulate(EXPERIMENT, values, times)

    start = [np.log(TRUTH[name]) for name in free]
    best, covariance = curve_fit(response, TIMES, 1e6 * TRACE, start, xtol=1e-12, ftol=1e-12)
    found = told(TIMES, TRACE, fixed=fixed)
    own = found.to_frame()
    assert set(own.index) == {*free, "tau"}
    assert found.data["assumed"]["fixed"] == fixed
    for name, log, deviation in zip(free, best, np.sqrt(np.diag(covariance)), strict=True):
        # SciPy stops within a thousandth of the deviation.
        assert own["value"][name] == pytest.approx(np.exp(log), rel=1e-3 * deviation + 5e-5)
        if deviation < 0.02:
            width = np.log(own["high"][name] / own["low"][name])
            assert width == pytest.approx(2 * 1.966 * deviation, rel=0.02)


def test_a_config_fixes_an_option_adds_and_it_is_said_everywhere(tmp_path: Path) -> None:
    file = write_trace(tmp_path / "trace.csv", TIMES, TRACE)
    page, table, config = (tmp_path / name for name in ("page.html", "a.csv", "a.yaml"))
    config.write_text(f"{FEW}fixed: {{k: 20.0, c_p: 1.0}}\n")
    outputs = ("--report", page, "--csv", table, "--output", tmp_path / "f.json")
    status, said, _ = identify(file, "--config", config, "--fix", "c_p=50", *outputs)
    assert status == 0
    found = json.loads((tmp_path / "f.json").read_text())
    assert found["assumed"]["fixed"] == {"k": 20.0, "c_p": 50.0}
    assert "Fixed: k = 20 N/m, c_p = 50 N s/m." in said
    assert "Other models are not compared, because k and c_p were fixed." in said
    assert found["models"] == []
    assert "Fixed: k = 20 N/m, c_p = 50 N s/m." in page.read_text().replace("\xa0", " ")
    header, row = (line.split(",") for line in table.read_text().splitlines())
    assert row[header.index("fixed")] == "k = 20 N/m; c_p = 50 N s/m"
    assert not [name for name in header if name.startswith("c_p")]
