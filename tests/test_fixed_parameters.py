"""`--fix` and `fixed`: parameters at known values, in what is identified and in what is said."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import curve_fit

from biogrip.arrays import Array
from biogrip.cli import main
from biogrip.library import Sample, set_up, simulate
from tests.helpers.default import STUDY

FEW = "least_squares: {candidates: 100, starts: 4}\nmodel_selection: {models: [maxwell]}\n"
SAMPLE = Sample("generalized_maxwell")
TRUTH = {"k": 20.0, "k_p": 5.0, "c": 400.0, "c_p": 50.0}
EXPERIMENT = set_up(STUDY.gripper, STUDY.phases, SAMPLE)


@pytest.fixture(scope="module")
def trace() -> tuple[Array, Array]:
    """A cell's at 1 Hz, with 2 % noise."""
    times = np.arange(401.0)
    response = simulate(EXPERIMENT, TRUTH, times)
    noise = np.random.default_rng(0).standard_normal(len(times))
    return times, response + 0.02 * response.max() * noise


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, trace: tuple[Array, Array]) -> Path:
    folder = tmp_path_factory.mktemp("fixed")
    rows = (f"{t:.6g},{v:.12e}" for t, v in zip(*trace, strict=True))
    (folder / "trace.csv").write_text("\n".join(["time_s,rotation_rad", *rows]) + "\n")
    (folder / "few.yaml").write_text(FEW)
    return folder


def identified(folder: Path, *options: str, config: str = "few.yaml") -> dict[str, Any]:
    output = folder / "found.json"
    given = ["--config", str(folder / config), "--output", str(output)]
    assert main(["identify", str(folder / "trace.csv"), *given, *options]) == 0
    found: dict[str, Any] = json.loads(output.read_text())
    return found


def quantities(found: dict[str, Any]) -> dict[str, dict[str, Any]]:
    return {item["quantity"]: item for item in found["quantities"]}


@pytest.mark.parametrize("fixed", [{"c_p": 0.0}, {"k_p": 4.9, "c_p": 50.0}])
def test_the_others_are_scipys(
    folder: Path, trace: tuple[Array, Array], fixed: dict[str, float]
) -> None:
    free = [name for name in SAMPLE.model.names if name not in fixed]

    def response(times: Array, *logs: float) -> Array:
        values = fixed | dict(zip(free, np.exp(logs).tolist(), strict=True))
        return 1e6 * simulate(EXPERIMENT, values, times)

    start = [np.log(TRUTH[name]) for name in free]
    best, covariance = curve_fit(response, trace[0], 1e6 * trace[1], start, xtol=1e-12, ftol=1e-12)
    found = identified(folder, *(f"--fix={name}={value}" for name, value in fixed.items()))
    own = quantities(found)
    assert set(own) == set(free)
    assert found["assumed"]["fixed"] == fixed
    for name, log, deviation in zip(free, best, np.sqrt(np.diag(covariance)), strict=True):
        # SciPy stops within a thousandth of the deviation; five digits are written.
        assert own[name]["value"] == pytest.approx(np.exp(log), rel=1e-3 * deviation + 5e-5)
        if deviation < 0.02:
            width = np.log(own[name]["high"] / own[name]["low"])
            assert width == pytest.approx(2 * 1.966 * deviation, rel=0.02)


def test_an_element_at_zero_is_absent(folder: Path) -> None:
    without = quantities(identified(folder, "--fix", "c_p=0"))
    other = quantities(identified(folder, "--model", "liquid_drop"))
    assert set(without) == set(other)
    for name, item in other.items():
        for key in ("value", "low", "high"):
            assert without[name][key] == pytest.approx(item[key], rel=1e-5)


def test_it_is_said_everywhere(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    page, table = folder / "page.html", folder / "table.csv"
    found = identified(folder, "--fix", "c_p=0", "--report", str(page), "--csv", str(table))
    said = capsys.readouterr().out
    assert found["fixed"] == ["c_p = 0 N s/m"]
    assert "Fixed: c_p = 0 N s/m." in said
    assert "no other sample models are tried" in said
    assert found["models"] == []
    assert "Fixed: c_p = 0 N s/m." in page.read_text()
    header, row = (line.split(",") for line in table.read_text().splitlines())
    assert row[header.index("fixed")] == "c_p = 0 N s/m"
    assert not [name for name in header if name.startswith("c_p")]


def test_a_config_fixes_and_an_option_adds(folder: Path) -> None:
    (folder / "fixing.yaml").write_text(f"{FEW}fixed: {{k: 2.0, c_p: 1.0}}\n")
    found = identified(folder, "--fix", "c_p=0", config="fixing.yaml")
    assert found["assumed"]["fixed"] == {"k": 2.0, "c_p": 0.0}
