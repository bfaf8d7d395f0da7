"""What planning a study of a sheet takes, by the number of its rows."""

import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from benchmarks.scale import run_study
from benchmarks.section import Row, Section, number
from biogrip.products.catalogue import products
from biogrip.products.plan import Plan
from biogrip.running.rules import all_written, make_rules
from biogrip.study.defaults import default_config
from biogrip.study.load import load_study, read_configs

ROWS = 1000, 100_000
_READINGS = 60

_TEXT = f"""\
A dry run of Snakemake for a sheet whose every row is a cell of one trace, with {_READINGS} readings
in a file of its own, in two dishes: nothing is fitted. Files are those that the study would write,
without logs."""


def sheet_section() -> Section:
    """Plan studies of sheets."""
    columns: dict[str, Callable[[Row], str]] = {
        "rows": lambda row: f"{row['rows']:,}",
        "jobs": lambda row: f"{row['jobs']:,}",
        "files": lambda row: f"{row['files']:,}",
        "wall time (s)": lambda row: number(row["wall_s"]),
        "processor time (s)": lambda row: number(row["processor_s"]),
        "largest (MB)": lambda row: f"{row['largest_MB']:.0f}",
    }
    rows = [_planned(count) for count in ROWS]
    return Section("sheet", "Many rows of a sheet", _TEXT, columns, rows)


def _planned(count: int) -> Row:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        sheet = write_sheet(folder, count)
        given = {"traces": str(sheet)}
        wall_s, seen = run_study(folder, given, "--dry-run")
        config = read_configs([default_config()]) | given
        study = load_study(config, [default_config()], command_line=given)
        rules = make_rules(products().values(), Plan(study, folder / "results"))
        return {
            "rows": count,
            "jobs": sum(len(rule.jobs) for rule in rules),
            "files": len(all_written(rules)),
            "wall_s": wall_s,
            "processor_s": sum(each.processor_s for each in seen.values()),
            "largest_MB": max(each.largest_MB for each in seen.values()),
        }


def write_sheet(folder: Path, count: int) -> Path:
    """Write a sheet and its traces into a folder, and return the sheet."""
    noise = np.random.default_rng(1)
    time_s = np.linspace(0.0, 400.0, _READINGS)
    rising = 1e-4 * (1 - np.exp(-time_s / 50.0))
    lines = ["file,cell,dish"]
    for cell in range(count):
        noisy = rising + 1e-6 * noise.standard_normal(_READINGS)
        rows = zip(time_s.tolist(), noisy.tolist(), strict=True)
        text = "".join(f"{time:.6g},{angle:.8g}\n" for time, angle in rows)
        (folder / f"{cell}.csv").write_text(f"time_s,rotation_rad\n{text}")
        lines.append(f"{cell}.csv,cell {cell},{'AB'[cell % 2]}")
    sheet = folder / "cells.csv"
    sheet.write_text("\n".join(lines) + "\n")
    return sheet
