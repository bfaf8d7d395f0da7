"""How cost grows with population, samples, seeds and branches."""

import subprocess
import sys
from collections.abc import Callable, Mapping
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullLocator

from benchmarks.misfit import vectorised
from benchmarks.section import Row, Section, number
from benchmarks.setup import POPULATION, Problem, evolve, problem
from benchmarks.timing import alternate, clocked
from biogrip.arrays import Array
from biogrip.products.figures.style import BLUE, GREY, ORANGE, PAGE_IN, SKY, figure, panel

_ROUNDS = 5
_POPULATIONS = (16, 64, 250, 1000, 4000, 16000)
_RATES_HZ = (0.25, 1.0, 4.0, 16.0, 64.0, 250.0)
_SEEDS = (1, 2, 5, 10, 25, 50)
_BRANCHES = (1, 2, 3, 4, 6, 8)
# Forming more than so many numbers takes the memory of a small machine.
_MOST_FORMED = 8_000_000

# Slopes are fitted to so many points at the upper end.
_FITTED = 3

_OURS, _FORMED = "biogrip", "vectorised numpy"
_TABLE, _START = "biogrip, making the table", "a process starts"
_COLOURS = {_OURS: BLUE, _FORMED: ORANGE, _TABLE: SKY, _START: GREY}

_TEXT = f"""\
Misfit of a population over its size, over the samples in the trace and over the Maxwell branches
of the model, otherwise of {POPULATION} individuals, 4001 samples and one branch; and whole
identifications, one seed after the other, over the seeds. Exponents are fitted to the upper three
points. Samples enter our misfit only when its table is made, once a trace. One cost does not grow
at all: a Python process that loads what an identification needs."""


def growth_section() -> Section:
    """Measure, fit slopes and draw."""
    rows = [*_populations(), *_samples(), *_seeds(), *_branches()]
    columns: dict[str, Callable[[Row], str]] = {
        "over": lambda row: row["over"],
        "of": lambda row: row["way"],
        "from": lambda row: f"{row['sizes'][0]:,}: {number(row['times_ms'][0])} ms",
        "to": lambda row: f"{row['sizes'][-1]:,}: {number(row['times_ms'][-1])} ms",
        "exponent": lambda row: number(row["exponent"], 2),
    }
    return Section("growth", "How cost grows", _TEXT, columns, rows, partial(_draw, rows))


def _populations() -> list[Row]:
    p = problem()
    ways: dict[str, Callable[[Array], Array]] = {
        _OURS: p.misfit(),
        _FORMED: partial(vectorised, p),
    }
    largest = _MOST_FORMED // len(p.time_s)
    return [
        _row(
            "individuals",
            name,
            {
                count: partial(way, p.population(count))
                for count in _POPULATIONS
                if name == _OURS or count <= largest
            },
        )
        for name, way in ways.items()
    ]


def _samples() -> list[Row]:
    problems = [problem(rate_Hz=rate_Hz) for rate_Hz in _RATES_HZ]
    ways: dict[str, Callable[[Problem], Callable[[], object]]] = {
        _OURS: lambda p: partial(p.misfit(), p.population()),
        _TABLE: lambda p: p.misfit,
        _FORMED: lambda p: partial(vectorised, p, p.population()),
    }
    return [
        _row(
            "samples",
            name,
            {
                len(p.time_s): way(p)
                for p in problems
                if name != _FORMED or POPULATION * len(p.time_s) <= _MOST_FORMED
            },
        )
        for name, way in ways.items()
    ]


def _seeds() -> list[Row]:
    problems = [problem(seed) for seed in range(max(_SEEDS))]

    def identify(count: int) -> None:
        for seed, p in enumerate(problems[:count]):
            evolve(p.misfit(), p.genome, p.genetic, np.random.default_rng(seed))

    row = _row("seeds", _OURS, {count: partial(identify, count) for count in _SEEDS}, rounds=1)
    command = [sys.executable, "-c", "import biogrip.products.stages.identification"]
    started = [clocked(partial(subprocess.run, command, check=True))[0] for _ in range(_ROUNDS)]
    start_ms = 1e3 * float(np.median(started))
    sizes = [_SEEDS[0], _SEEDS[-1]]
    start = {"over": "seeds", "way": _START, "sizes": sizes}
    return [row, {**start, "times_ms": [start_ms, start_ms], "exponent": 0.0}]


def _branches() -> list[Row]:
    problems = {count: problem(branches=count) for count in _BRANCHES}
    calls = {count: partial(p.misfit(), p.population()) for count, p in problems.items()}
    return [_row("branches", _OURS, calls)]


def _row(
    over: str, way: str, calls: Mapping[int, Callable[[], object]], rounds: int = _ROUNDS
) -> Row:
    names = {str(size): call for size, call in calls.items()}
    timed = alternate(names, rounds)
    times_ms = [timed.median_ms(name) for name in names]
    exponent, _ = np.polyfit(np.log(list(calls))[-_FITTED:], np.log(times_ms)[-_FITTED:], 1)
    return {
        "over": over,
        "way": way,
        "sizes": list(calls),
        "times_ms": times_ms,
        "exponent": float(exponent),
    }


def _draw(rows: list[Row]) -> Figure:
    drawn = figure(PAGE_IN, 4.2)
    panels = {
        "individuals": "Misfit over individuals",
        "samples": "Misfit over samples",
        "branches": "Misfit over Maxwell branches",
        "seeds": "Identifications over seeds",
    }
    grid = drawn.subplots(2, 2)
    for axes, letter, (over, title) in zip(grid.flat, "abcd", panels.items(), strict=True):
        for row in rows:
            if row["over"] == over:
                _curve(axes, row)
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,g}"))
        axes.set_xlabel(over)
        axes.set_ylabel("time (ms)")
        low, high = axes.get_ylim()
        axes.set_ylim(low, high * (high / low) ** 0.5)
        axes.legend(loc="upper left")
        panel(axes, letter, title)
    for axes, sizes in ((grid[1, 0], _BRANCHES), (grid[1, 1], _SEEDS)):
        axes.set_xticks(sizes, [str(size) for size in sizes])
        axes.xaxis.set_minor_locator(NullLocator())
    return drawn


def _curve(axes: Axes, row: Row) -> None:
    sizes, times_ms, exponent = row["sizes"], np.array(row["times_ms"]), row["exponent"]
    colour, label = _COLOURS[row["way"]], row["way"]
    if label == _START:
        axes.axhline(times_ms[0], color=colour, linestyle="--", linewidth=0.8, label=label)
        return
    axes.plot(sizes, times_ms, "o-", color=colour, markersize=3, linewidth=0.6)
    reach = np.array(sizes[-_FITTED:], dtype=float)
    centre = np.exp(np.mean(np.log(reach))), np.exp(np.mean(np.log(times_ms[-_FITTED:])))
    fitted = centre[1] * (reach / centre[0]) ** exponent
    axes.plot(reach, fitted, color=colour, linewidth=1.6, label=f"{label}, slope {exponent:.2f}")
