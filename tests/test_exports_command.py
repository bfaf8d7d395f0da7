"""`biogrip identify` on exports of rheometers: what is said of the file, and how it is repeated."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from biogrip.terminal import QUIET
from tests.helpers.identified import by_quantity, identify

READ = ("--time", "Time", "--reading", "modulus=Relaxation Modulus", "--model", "liquid_drop")
BEGINS_S = 7.0
TIMES = 0.25 * np.arange(1, 61)
MODULI = 5 + 20 * np.exp(-TIMES / 3) + 0.1 * np.random.default_rng(1).standard_normal(60)


def exported(path: Path) -> Path:
    """A conditioning of 7 s, and a relaxation modulus of 5 + 20 exp(-t / 3) Pa, in two blocks."""
    blocks = [0.5 * np.arange(1, 15), np.full(14, 0.01)], [BEGINS_S + TIMES, 1e-3 * MODULI]
    lines = ["Test:\tgel"]
    for number, block in enumerate(blocks, 1):
        lines += [f"Interval:\t{number}", "Point No.\tTime\tRelaxation Modulus", "\t\t"]
        rows = (f"{i}\t{t:.3f}\t{g:.7f}" for i, (t, g) in enumerate(zip(*block, strict=True)))
        lines += ["\t[s]\t[kPa]", *(row.replace(".", ",") for row in rows), "", ""]
    path.write_bytes("\r\n".join(lines).encode("utf-16"))
    return path


def config(path: Path, **more: Any) -> str:
    few = {"least_squares": {"candidates": 100, "starts": 4}, "model_selection": {"models": []}}
    path.write_text(yaml.safe_dump({**few, **more}))
    return str(path)


def found(trace: Path) -> dict[str, Any]:
    data: dict[str, Any] = json.loads(trace.with_suffix(".identified.json").read_text())
    return data


def test_the_block_that_is_asked_for_is_identified(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is recognised is said; the same keys in a config give the same, and so does QUIET."""
    trace = exported(tmp_path / "gel.csv")
    command: list[str | Path] = [trace, *READ, "--config", config(tmp_path / "few.yaml")]
    status, _, said = identify(*command)
    assert status == 1
    assert "found 2 blocks with the columns 'Time', 'Relaxation Modulus'" in said
    assert "\n  2: line 23, Interval: 2; Point No., Time, Relaxation Modulus; 60 rows, 7,25" in said
    status, _, said = identify(*command, "--set", "measurement.block=2", "--start", str(BEGINS_S))
    assert status == 0
    assert "gel.csv is read as\n  encoding     UTF-16\n  separator    tabs\n" in said
    assert "\n  modulus      Relaxation Modulus, in kPa\n" in said
    by_options = found(trace)
    assert by_options["read_as"]["block"] == 2
    for name, truth in (("k", 20), ("k_p", 5)):
        own = by_quantity(by_options)[name]
        assert own["low"] < truth < own["high"]
    monkeypatch.setenv(QUIET, "1")
    measurement = {"time": "Time", "modulus": "Relaxation Modulus", "start_s": BEGINS_S, "block": 2}
    keys = config(tmp_path / "keys.yaml", instrument="relaxation", measurement=measurement)
    status, _, said = identify(trace, "--model", "liquid_drop", "--config", keys)
    assert (status, said) == (0, "")
    assert found(trace)["quantities"] == by_options["quantities"]
    assert found(trace)["assumed"]["measurement"] == by_options["assumed"]["measurement"]
