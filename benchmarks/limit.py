"""How far an identification is from what the machine can do at all."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from benchmarks.batch import BATCH
from benchmarks.section import Row, Section, number
from benchmarks.setup import Problem, evolve, problem
from benchmarks.starts import Started, fitted, started
from benchmarks.timing import alternate, clocked
from biogrip.arrays import Array, IntArray
from biogrip.identify.genetic import evolve_many
from biogrip.response.decay_table import DecayTable
from biogrip.response.misfit_series import SeriesMisfit
from biogrip.response.mode_rows import ModeRows
from biogrip.response.modes import Modes

_ROUNDS = 15
_SEEDS, _NONLINEAR_SEEDS, _FITTED = 15, 3, 5
_LARGE = 1500
_FEW, _MANY = 1000, 4000

_TEXT = f"""\
One identification as the paper says, and the misfit of one generation's children in it, on one
thread. Making the misfit's table sums over the trace at some hundred rates: 2 rates samples
additions and multiplications, nearly all in one matrix product. They are compared with the
machine's own rate, that of numpy's product of two {_LARGE} x {_LARGE} matrices; beside them the
table takes its exponentials and a weighted sum. From then on the misfit runs over no samples. What
is left is a hundred calls of numpy on short arrays: the misfit of one individual is what the calls
themselves cost, and what one individual more costs, from {_FEW} to {_MANY}, is their arithmetic.
The limit of a generation's misfit is that arithmetic alone. Local fits are those of {BATCH} traces
side by side, as above. At every point that a fit tries, two matrix products cannot be avoided:
amplitudes and places of the modes times the table of their rows, for the response and its
derivatives; and these rows times themselves, for the normal equations. The limit of the fits is
these products at the machine's rate."""


class Watched(SeriesMisfit):
    """Keeps the time spent in the sums over the trace, and in all of the misfit."""

    def __init__(self, *args: Any) -> None:
        self.sums_s = self.misfit_s = 0.0
        self.rates = 0
        super().__init__(*args)

    def of_each(self, parameters: Array, traces: IntArray) -> Array:
        """Misfit of populations, (n_populations, n, n_parameters), each against a trace."""
        spent_s, found = clocked(partial(super().of_each, parameters, traces))
        self.misfit_s += spent_s
        return found

    def exact_projections(self, rates: Array) -> Array:
        """Sums over the trace, only asked for to make the table."""
        spent_s, sums = clocked(partial(super().exact_projections, rates))
        self.sums_s += spent_s
        self.rates += len(rates)
        return sums


def watch_writes(p: Problem) -> Watched:
    """Return the misfit of a problem, watched."""
    misfit = Watched(p.gripper, p.model, p.steps, p.interval_s, p.trace_rad)
    misfit.projections  # noqa: B018 - makes the table
    return misfit


def watched_identification(p: Problem, seed: int) -> Watched:
    """Identify by the genetic algorithm; the misfit that watched it."""
    misfit = watch_writes(p)
    evolve_many(misfit.of_each, p.genome, p.genetic, [np.random.default_rng(seed)])
    return misfit


class WatchedRows(ModeRows):
    """Counts operations of products of rows of responses, and keeps the time spent in all of them.

    Parameters
    ----------
    rows
        What is watched.
    """

    def __init__(self, rows: ModeRows) -> None:
        vars(self).update(vars(rows))
        self.start()

    def start(self) -> None:
        """Count from here."""
        self.evaluations, self.operations, self.spent_s = 0, 0, 0.0

    def __call__(self, modes: Modes) -> Array:
        """Rows of responses and of their derivatives."""
        spent_s, found = clocked(partial(super().__call__, modes))
        self.spent_s += spent_s
        count, functions, rows = found.shape
        _, drives, powers, _ = self._table.shape
        inner = modes.rates.shape[1] * drives * powers
        self.evaluations += count
        self.operations += 2 * count * functions * rows * (inner + functions)
        return found


def watched_fits(problems: Sequence[Problem]) -> tuple[WatchedRows, list[Started]]:
    """Return traces to fit, and what watches the rows of all of their responses."""
    condensed = problems[0].condensed()
    rows = WatchedRows(condensed.of_modes)
    # Made once and kept there.
    vars(condensed)["of_modes"] = rows
    return rows, started(problems, condensed)


def limit_section() -> Section:
    """Measure shares, rates and what the rates would allow."""
    p = problem()
    children = p.genetic.population - p.genetic.survivors
    misfit, large = p.misfit(), np.random.default_rng(0).random((_LARGE, _LARGE))
    calls: dict[str, Callable[[], object]] = {
        str(count): partial(misfit, p.population(count)) for count in (1, children, _FEW, _MANY)
    }
    timed = alternate(
        {**calls, "table": partial(_tabulated, p), "large product": lambda: large @ large}, _ROUNDS
    )
    one_ms, children_ms = timed.median_ms("1"), timed.median_ms(str(children))
    another_ms = (timed.median_ms(str(_MANY)) - timed.median_ms(str(_FEW))) / (_MANY - _FEW)
    large_rate = 2e-6 * _LARGE**3 / timed.median_ms("large product")
    operations, table_ms = 2 * watch_writes(p).rates * len(p.time_s), timed.median_ms("table")
    rows = [
        *_shares(p),
        _row("making the table", table_ms, "ms"),
        _row("its sums: operations", 1e-6 * operations, "million"),
        _row("rate of making the table", 1e-6 * operations / table_ms, "GFLOP/s"),
        _row(f"matrix product {_LARGE} x {_LARGE}", large_rate, "GFLOP/s"),
        _row(
            "making the table over its limit", large_rate * table_ms / (1e-6 * operations), "times"
        ),
        _row("misfit of one individual: calls", one_ms, "ms"),
        _row("misfit of one individual more: arithmetic", 1e3 * another_ms, "µs"),
        _row(f"misfit of {children} individuals", children_ms, "ms"),
        _row("limit: arithmetic alone", children * another_ms, "ms"),
        _row("misfit over its limit", children_ms / (children * another_ms), "times"),
        *_fits([problem(seed) for seed in range(BATCH)], large_rate),
    ]
    columns: dict[str, Callable[[Row], str]] = {
        "quantity": lambda row: row["quantity"],
        "value": lambda row: f"{number(row['value'])} {row['unit']}".strip(),
    }
    return Section("limit", "Distance to the limit", _TEXT, columns, rows)


def _shares(p: Problem) -> list[Row]:
    """How long an identification takes, and what of it is the misfit and its table."""
    whole_s, sums_s, misfit_s, nonlinear_s, spent_s = np.zeros(5)
    nonlinear = p.misfit(nonlinear=True)

    def nonlinear_watched(parameters: Array) -> Array:
        nonlocal spent_s
        seconds, found = clocked(partial(nonlinear, parameters))
        spent_s += seconds
        return found

    for seed in range(_SEEDS):
        seconds, misfit = clocked(partial(watched_identification, p, seed))
        whole_s += seconds
        sums_s += misfit.sums_s
        misfit_s += misfit.misfit_s
    for seed in range(_NONLINEAR_SEEDS):
        rng = np.random.default_rng(seed)
        nonlinear_s += clocked(partial(evolve, nonlinear_watched, p.genome, p.genetic, rng))[0]
    return [
        _row("identification", 1e3 * whole_s / _SEEDS, "ms"),
        _row("of which sums over the trace", 100 * sums_s / whole_s, "%"),
        _row("of which in the misfit", 100 * misfit_s / whole_s, "%"),
        _row("identification on the nonlinear model", 1e3 * nonlinear_s / _NONLINEAR_SEEDS, "ms"),
        _row("of which in the nonlinear misfit", 100 * spent_s / nonlinear_s, "%"),
    ]


def _fits(problems: Sequence[Problem], large_rate: float) -> list[Row]:
    """How long local fits take, and what of it the products would at a rate in GFLOP/s."""
    rows, traces = watched_fits(problems)
    timed = alternate({"fits": partial(fitted, traces)}, _FITTED)
    rows.start()
    whole_s, _ = clocked(partial(fitted, traces))
    fits_ms = timed.median_ms("fits") / len(traces)
    operations = rows.operations / len(traces)
    limit_ms = 1e-6 * operations / large_rate
    return [
        _row("local fits of one trace of the batch", fits_ms, "ms"),
        _row("of which in rows of responses", 100 * rows.spent_s / whole_s, "%"),
        _row("their evaluations", rows.evaluations / len(traces), ""),
        _row("their products: operations", 1e-6 * operations, "million"),
        _row("limit: these products alone", limit_ms, "ms"),
        _row("local fits over their limit", fits_ms / limit_ms, "times"),
    ]


def _tabulated(p: Problem) -> DecayTable:
    misfit = p.misfit()
    assert isinstance(misfit, SeriesMisfit)
    return misfit.projections


def _row(quantity: str, value: float, unit: str) -> Row:
    return {"quantity": quantity, "value": float(value), "unit": unit}
