"""How far an identification is from what the machine can do at all."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from benchmarks.section import Row, Section, number
from benchmarks.setup import Problem, problem
from benchmarks.timing import alternate, clocked
from biogrip.arrays import Array
from biogrip.response.misfit_series import SeriesMisfit

_ROUNDS = 15
_SEEDS, _NONLINEAR_SEEDS = 15, 3
_LARGE = 1500

_TEXT = f"""\
One identification as the paper says, and the misfit of one generation's children in it, on one
thread. The misfit's long sums are one matrix product, (modes x B) by (B x columns), with the trace
folded to B rows, and one weighted sum over the columns: 2 modes B columns + 2 modes columns
additions and multiplications. The exponentials in them, modes (B + N/B), are counted apart, as each
is dozens of operations. The limit is the time of both at the machine's own rates: of numpy's
product of two {_LARGE} x {_LARGE} matrices, and of numpy's exp of as many numbers between -1 and 0.
The misfit exceeds it by smaller matrices, traffic of memory, roots and weights of the modes, and
what calls of numpy cost."""


@dataclass(frozen=True)
class Operations:
    """What the long sums of a misfit cost.

    Parameters
    ----------
    modes, block, columns
        Shape of the matrix product: (modes, block) times (block, columns).
    exponentials
        Powers of the modes, one exponential each.
    """

    modes: int
    block: int
    columns: int
    exponentials: int

    @property
    def flops(self) -> int:
        """Additions and multiplications of the product and of the weighted sum."""
        return 2 * self.modes * self.columns * (self.block + 1)


def operations(misfit: SeriesMisfit, individuals: int, modes_each: int) -> Operations:
    """Count the operations of a misfit's long sums."""
    block, columns = misfit._folded.shape
    modes = individuals * modes_each
    return Operations(modes, block, columns, modes * (block + len(misfit._across)))


class _Watched(SeriesMisfit):
    """Keeps the time spent in the long sums, and in all of the misfit."""

    sums_s = 0.0
    misfit_s = 0.0

    def __call__(self, parameters: Array) -> Array:
        spent_s, found = clocked(partial(super().__call__, parameters))
        self.misfit_s += spent_s
        return found

    def _projections(self, rates: Array) -> Array:
        spent_s, sums = clocked(partial(super()._projections, rates))
        self.sums_s += spent_s
        return sums


def limit_section() -> Section:
    """Measure shares, rates and what the rates would allow."""
    p = problem()
    children = p.genetic.population - p.genetic.survivors
    samples = p.population(children)
    misfit = SeriesMisfit(p.gripper, p.model, p.steps, p.interval_s, p.trace_rad)
    count = operations(misfit, children, modes_each=2)
    rng = np.random.default_rng(0)
    left, folded = rng.random((count.modes, count.block)), rng.random((count.block, count.columns))
    large = rng.random((_LARGE, _LARGE))
    exponents = -rng.random(count.exponentials)
    timed = alternate(
        {
            "misfit": lambda: misfit(samples),
            "product": lambda: left @ folded,
            "large product": lambda: large @ large,
            "exp": lambda: np.exp(exponents),
        },
        _ROUNDS,
    )
    misfit_ms, exp_ms = timed.median_ms("misfit"), timed.median_ms("exp")
    shape_rate = 2e-6 * count.modes * count.block * count.columns / timed.median_ms("product")
    large_rate = 2e-6 * _LARGE**3 / timed.median_ms("large product")
    limit_ms = 1e-6 * count.flops / large_rate + exp_ms
    shape = f"({count.modes} x {count.block}) by ({count.block} x {count.columns})"
    rows = [
        *_shares(p),
        _row(f"misfit of {children} individuals", misfit_ms, "ms"),
        _row("its sums: operations", 1e-6 * count.flops, "million"),
        _row("its sums: exponentials", 1e-6 * count.exponentials, "million"),
        _row(f"matrix product {shape}", shape_rate, "GFLOP/s"),
        _row(f"matrix product {_LARGE} x {_LARGE}", large_rate, "GFLOP/s"),
        _row("exp", 1e-6 * count.exponentials / exp_ms, "per ns"),
        _row("limit: operations and exponentials at these rates", limit_ms, "ms"),
        _row("misfit over its limit", misfit_ms / limit_ms, "times"),
        _row("rate of the whole misfit", 1e-6 * count.flops / misfit_ms, "GFLOP/s"),
    ]
    columns: dict[str, Callable[[Row], str]] = {
        "quantity": lambda row: row["quantity"],
        "value": lambda row: f"{number(row['value'])} {row['unit']}",
    }
    return Section("limit", "Distance to the limit", _TEXT, columns, rows)


def _shares(p: Problem) -> list[Row]:
    """How long an identification takes, and what of it is the misfit and its sums."""
    whole_s, nonlinear_s, spent_s = 0.0, 0.0, 0.0
    watched = _Watched(p.gripper, p.model, p.steps, p.interval_s, p.trace_rad)
    nonlinear = p.misfit(nonlinear=True)

    def nonlinear_watched(parameters: Array) -> Array:
        nonlocal spent_s
        seconds, found = clocked(partial(nonlinear, parameters))
        spent_s += seconds
        return found

    for seed in range(_SEEDS):
        rng = np.random.default_rng(seed)
        whole_s += clocked(partial(genetic, watched, p.genome, p.genetic, rng))[0]
    for seed in range(_NONLINEAR_SEEDS):
        rng = np.random.default_rng(seed)
        nonlinear_s += clocked(partial(genetic, nonlinear_watched, p.genome, p.genetic, rng))[0]
    return [
        _row("identification", 1e3 * whole_s / _SEEDS, "ms"),
        _row("of which in the misfit", 100 * watched.misfit_s / whole_s, "%"),
        _row("of which in the misfit's sums", 100 * watched.sums_s / whole_s, "%"),
        _row("identification on the nonlinear model", 1e3 * nonlinear_s / _NONLINEAR_SEEDS, "ms"),
        _row("of which in the nonlinear misfit", 100 * spent_s / nonlinear_s, "%"),
    ]


def _row(quantity: str, value: float, unit: str) -> Row:
    return {"quantity": quantity, "value": value, "unit": unit}
