"""Runs all benchmarks and writes what they found as Markdown, JSON and figures."""

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks import identification, misfit
from benchmarks.growth import growth_section
from benchmarks.identification import identification_section
from benchmarks.limit import limit_section
from benchmarks.local_fits import local_fits_section
from benchmarks.machine import machine
from benchmarks.metaheuristics import metaheuristics_section
from benchmarks.misfit import misfit_section
from benchmarks.nonlinear import nonlinear_section
from benchmarks.profiles import profiles_section
from benchmarks.scale import scale_section
from benchmarks.section import Section, markdown, number, renewed, written
from benchmarks.sheet import sheet_section
from benchmarks.study import study_section
from benchmarks.timing import clocked
from biogrip.files import atomic_write, write_text
from biogrip.products.figures.style import styled

RESULTS = Path(__file__).parent / "results"

SECTIONS: Mapping[str, Callable[[], Section]] = {
    "misfit": misfit_section,
    "identification": identification_section,
    "nonlinear": nonlinear_section,
    "local_fits": local_fits_section,
    "profiles": profiles_section,
    "metaheuristics": metaheuristics_section,
    "growth": growth_section,
    "limit": limit_section,
    "study": study_section,
    "scale": scale_section,
    "sheet": sheet_section,
}
"""By name, in the order of the report."""

# Section, peer and how many times faster than it this project means to be.
AIMS = (
    ("misfit", misfit.NUMPY, 25),
    ("identification", identification.DEAP, 3),
    ("identification", identification.PYGAD, 15),
    ("identification", identification.PYMOO, 15),
    ("identification", identification.DEAP_LEAN, 3),
    ("identification", identification.PYGAD_LEAN, 15),
    ("identification", identification.PYMOO_LEAN, 15),
)

_INTRODUCTION = """\
# Benchmarks

Written by `make bench`. All competitors run in one process on one thread and take turns, so that a
slow moment strikes them all. Times are medians; ratios are taken turn by turn, and given as their
median with the lowest and the highest."""


def run(names: Sequence[str] = ()) -> None:
    """Run benchmarks and write `benchmarks/results`.

    Parameters
    ----------
    names
        Of sections; what the report has of the others stays. By default all are run.
    """
    unknown = [name for name in names if name not in SECTIONS]
    if unknown:
        raise SystemExit(f"found {unknown[0]}, allowed are {', '.join(SECTIONS)}.")
    sections = []
    for name in names or SECTIONS:
        seconds, section = clocked(SECTIONS[name])
        print(f"{section.title}: {seconds:.0f} s", flush=True)
        sections.append(section)
        _draw(section)
    described = machine()
    page, numbers = RESULTS / "benchmarks.md", RESULTS / "benchmarks.json"
    found: dict[str, Any] = {section.name: list(section.rows) for section in sections}
    if names:
        text = renewed(page.read_text(encoding="utf-8"), described, sections)
        there = json.loads(numbers.read_text(encoding="utf-8"))
        alone = there.get("machine_of", {}) | dict.fromkeys(found, described)
        found = there | found | {"machine_of": alone}
    else:
        text = report(described, sections)
        found = {"machine": described, **found}
    write_text(page, text)
    write_text(numbers, json.dumps(found, indent=1) + "\n")
    print(f"\n{text}")


def report(described: Mapping[str, str], sections: Sequence[Section]) -> str:
    """Return everything as Markdown."""
    parts = [
        _INTRODUCTION,
        markdown([described]),
        "## Aims",
        markdown(_aims({section.name: section for section in sections})),
        *map(written, sections),
    ]
    return "\n\n".join(parts) + "\n"


def _aims(sections: Mapping[str, Section]) -> list[dict[str, str]]:
    found = []
    for name, peer, aim in AIMS:
        section = sections[name]
        row = next(row for row in section.rows if peer in row.values())
        alone, batch = row["times_ours"], row.get("times_side_by_side")
        in_batch = "side by side" if batch is not None and batch >= aim else "no"
        found.append(
            {
                "benchmark": section.title,
                "faster than": peer,
                "at least": f"{aim} times",
                "measured": f"{number(alone)} times",
                "traces side by side": "" if batch is None else f"{number(batch)} times",
                "reached": "yes" if alone >= aim else in_batch,
            }
        )
    return found


def _draw(section: Section) -> None:
    if section.figure is None:
        return
    with styled(), atomic_write(RESULTS / f"{section.name}.png") as scratch:
        section.figure().savefig(scratch, format="png", metadata={"Software": None})
