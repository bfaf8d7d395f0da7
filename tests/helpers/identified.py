"""`biogrip identify` in this process: loading it takes as long as what it does to a bad trace."""

import json
from collections.abc import Sequence
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np

from biogrip.arrays import Array
from biogrip.cli import main
from biogrip.library import Sample, TraceResult, identify_trace, set_up, simulate
from tests.helpers.default import STUDY

FEW = """
least_squares: {candidates: 100, starts: 4}
model_selection: {models: [damper, maxwell]}
"""
"""A config with few starts, and few models to compare, where that is not looked at."""


def identify(*arguments: str | Path) -> tuple[int, str, str]:
    """Status of the command, what it says, and what it complains of."""
    with redirect_stdout(StringIO()) as said, redirect_stderr(StringIO()) as complained:
        status = main(["identify", *map(str, arguments)])
    return status, said.getvalue(), complained.getvalue()


def identified(
    folder: Path, trace: Path, *options: str | Path, config: str = FEW
) -> dict[str, Any]:
    """Content of the JSON file."""
    (folder / "config.yaml").write_text(config)
    # The result of one trace is not replaced by that of another.
    (folder / "found.json").unlink(missing_ok=True)
    given = ("--config", folder / "config.yaml", "--output", folder / "found.json")
    status, _, complained = identify(trace, *given, *options)
    assert status == 0, complained
    return json.loads((folder / "found.json").read_text())


def told(time_s: Array, values: Array, models: Sequence[str] = (), **given: Any) -> TraceResult:
    """What a trace tells in a notebook, by few starts, beside no other models but those named."""
    few = {"least_squares": {"candidates": 100, "starts": 4}}
    own = {"model_selection": {"models": [*models]}}
    given["config"] = {**few, **own, **given.get("config", {})}
    return identify_trace(time_s, values, **given)


def by_quantity(found: dict[str, Any]) -> dict[str, dict[str, Any]]:
    return {item["quantity"]: item for item in found["quantities"]}


def write_trace(path: Path, *columns: Array, header: str = "time_s,rotation_rad") -> Path:
    np.savetxt(path, np.column_stack(columns), "%.17g", ",", header=header, comments="")
    return path


def write_drop(path: Path, seed: int) -> None:
    """Write a trace of a liquid drop in noise, of 120 readings."""
    times, rng = np.linspace(0, 400, 120), np.random.default_rng(seed)
    experiment = set_up(STUDY.gripper, STUDY.phases, Sample("liquid_drop"))
    clean = simulate(experiment, {"k": 20.0 + seed, "k_p": 5.0, "c": 300.0}, times)
    write_trace(path, times, clean + 1e-6 * rng.standard_normal(len(times)))
