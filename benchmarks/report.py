"""Benchmarks as tables: run together, written as JSON, and from that as Markdown."""

import json
import platform
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import psutil

from benchmarks.timing import clocked
from biogrip.files import write_text

Row = dict[str, Any]


@dataclass(frozen=True)
class Section:
    """One benchmark, a table of the report."""

    name: str
    """Its key in the JSON file."""
    title: str
    text: str
    """What was done and how to read the rows."""
    columns: Mapping[str, Callable[[Row], str]]
    """By heading, how a row's cell is printed."""
    measure: Callable[[], list[Row]]
    """Runs it, and returns plain numbers and words."""


@dataclass(frozen=True)
class Report:
    """Benchmarks that run together."""

    stem: Path
    """Its files, but for `.json` and `.md`."""
    introduction: str
    """Title, and what holds for all sections."""
    sections: Sequence[Section]
    peers: Sequence[str]
    """The libraries whose versions are said."""

    def run(self) -> None:
        """Run all sections and write both files."""
        found: dict[str, Any] = {"machine": describe_machine(self.peers)}
        for section in self.sections:
            seconds, found[section.name] = clocked(section.measure)
            print(f"{section.title}: {seconds:.0f} s", flush=True)
        write_text(self.stem.with_suffix(".json"), json.dumps(found, indent=1) + "\n")
        self.write_page()

    def write_page(self) -> None:
        """Write the Markdown file from the JSON file."""
        found = json.loads(self.stem.with_suffix(".json").read_text(encoding="utf-8"))
        parts = [self.introduction, _markdown([found["machine"]])]
        for section in self.sections:
            rows = found[section.name]
            cells = [{head: cell(row) for head, cell in section.columns.items()} for row in rows]
            parts += [f"## {section.title}", section.text, _markdown(cells)]
        write_text(self.stem.with_suffix(".md"), "\n\n".join(parts) + "\n")


def _markdown(rows: Sequence[Mapping[str, str]]) -> str:
    return str(pd.DataFrame(rows).to_markdown(index=False, disable_numparse=True))


def describe_machine(peers: Sequence[str]) -> dict[str, str]:
    """Describe processor, memory and the libraries that decide the speed."""
    build: dict[str, Any] = np.show_config(mode="dicts")  # type: ignore[assignment]
    blas = build["Build Dependencies"]["blas"]
    return {
        "processor": _processor(),
        "cores": str(psutil.cpu_count(logical=False) or psutil.cpu_count()),
        "memory": f"{psutil.virtual_memory().total / 2**30:.0f} GiB",
        "system": f"{platform.system()} {platform.machine()}",
        "Python": platform.python_version(),
        "numpy": np.__version__,
        "BLAS": f"{blas['name']} {blas['version']}, one thread",
        **{name: version(name) for name in ("scipy", *peers)},
    }


def _processor() -> str:
    described = Path("/proc/cpuinfo")
    if described.exists():
        found = re.search(r"^model name\s*:\s*(.*)$", described.read_text(), re.MULTILINE)
        if found:
            return found[1]
    return platform.processor()


def number(value: float, digits: int = 3) -> str:
    """Print a number with so many digits, and never in powers of ten between 0.001 and 10^6."""
    if value == 0 or not 1e-3 <= abs(value) < 1e6:
        return f"{value:.{digits}g}"
    decimals = max(0, digits - 1 - int(f"{value:e}".split("e")[1]))
    return f"{value:,.{decimals}f}"


def times_ours(row: Row) -> str:
    """Print a row's ratio with the range over the rounds."""
    low, high = (number(row[f"times_ours_{end}"], 2) for end in ("lowest", "highest"))
    return "1" if row["times_ours"] == 1 else f"{number(row['times_ours'])} ({low} to {high})"
