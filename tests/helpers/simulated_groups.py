"""Tables of two groups whose truth is known, for the levels and powers that docs/groups.md has.

Numbers are drawn here by NumPy alone; nothing of the method is used but `compare`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.special import ndtri

from biogrip.judging.cells import Cell, compare
from tests.helpers.places import ROOT

TABLES = 1000
Known = dict[str, tuple[float, float]]


@dataclass(frozen=True)
class Design:
    """How cells of two groups were measured, and what is true of them."""

    units: tuple[int, int] = (3, 3)
    """Dishes of either group; of days, those that only one of them was measured on come last."""
    scatter: tuple[float, float] = (0.2, 0.2)
    """Of dishes, as standard deviations of logarithms; of days, beyond what both groups share."""
    days: float | None = None
    """Scatter of days that both groups share, or None if each group has dishes of its own."""
    cells: int = 8
    cell_scatter: float = 0.25
    ratio: float = 1.0
    bounded: tuple[float, float] = (0.0, 0.0)
    """Shares of cells that are only bounded above: the softest, but for noise."""
    bound: str = "floor"
    """What the bound is: the floor below which no cell is determined; the cell's own value and
    twice its error, as the upper limit of a soft cell is low; or noise, alike for all cells, of
    which twice its sd has to be exceeded, and is added."""

    def table(self, rng: np.random.Generator) -> list[Cell]:
        """Return cells of a new table."""
        shared = (self.days or 0.0) * rng.standard_normal(max(self.units))
        return [
            cell
            for group, name in enumerate("ab")
            for unit in range(self.units[group])
            for cell in self._unit(
                rng,
                group,
                f"{unit}" if self.days is not None else f"{name}{unit}",
                shared[unit] + self.scatter[group] * rng.standard_normal(),
            )
        ]

    def _unit(self, rng: np.random.Generator, group: int, name: str, mean: float) -> Sequence[Cell]:
        truth = mean + self.cell_scatter * rng.standard_normal(self.cells)
        truth += group * np.log(self.ratio)
        noise = rng.standard_normal(self.cells)
        return [
            Cell(f"{name}{number}", "ab"[group], name, known=known, others=others)
            for number, (log, of_noise) in enumerate(zip(truth, noise, strict=True))
            for known, others in [self._told(log, of_noise, group)]
        ]

    def _told(
        self, log: float, noise: float, group: int
    ) -> tuple[Known, dict[str, tuple[str, float | None]]]:
        share = self.bounded[group]
        spread = np.hypot(self.scatter[group], self.cell_scatter)
        floor = spread * ndtri(share) if share else -np.inf
        if self.bound == "noise" and share:
            sd = np.exp(floor) / 2
            value = np.exp(log) + sd * noise
            if value < 2 * sd:
                return {}, {"k": ("bounded above", float(max(value, 0.0) + 2 * sd))}
            return {"k": (float(np.log(value)), 0.05)}, {}
        read = log + 0.1 * noise
        if log < floor:
            bound = floor if self.bound == "floor" else read + 0.196
            return {}, {"k": ("bounded above", float(np.exp(bound)))}
        return {"k": (float(read), 0.1)}, {}

    def shares(self, tables: int = TABLES, seed: int = 5) -> tuple[float, float, float]:
        """Return shares of tables, in percent, with p < 0.05 and p < 0.01, and with any p."""
        rng = np.random.default_rng(seed)
        rows = [compare(self.table(rng), ["a", "b"], 0.95, units=True) for _ in range(tables)]
        p = np.array([row["k", "b"].get("p", np.nan) for row in rows])
        told = p[np.isfinite(p)]
        with np.errstate(invalid="ignore"):
            below = [
                100 * float(np.mean(told < level)) if len(told) else np.nan
                for level in (0.05, 0.01)
            ]
        return below[0], below[1], 100 * len(told) / tables


def in_words(design: Design) -> str:
    """Return shares of tables as docs/groups.md has them."""
    small, tiny, told = design.shares()
    return f"{small:.1f} %, {tiny:.1f} %" + f", of {told:.0f} % of tables" * (told < 100)


_DISHES = {
    f"{a} and {b} dishes of {100 * x:.0f} and {100 * y:.0f} %": Design(units=(a, b), scatter=(x, y))
    for a, b in ((3, 3), (3, 6), (4, 10), (5, 5), (5, 10), (10, 10))
    for x, y in ((0.1, 0.1), (0.2, 0.2), (0.4, 0.1), (0.1, 0.4))
}
_DAYS = {
    f"{a} and {b} days, {min(a, b)} the same": Design(units=(a, b), scatter=(0.1, 0.1), days=0.35)
    for a, b in ((2, 2), (3, 3), (5, 5), (10, 10), (4, 3))
}
_BOUNDED = {
    f"4 and 4 dishes, {100 * a:.0f} and {100 * b:.0f} % bounded {words}": Design(
        units=(4, 4), scatter=(0.1, 0.1), cell_scatter=0.5, bounded=(a, b), bound=bound
    )
    for a, b in ((0.0, 0.1), (0.0, 0.28), (0.0, 0.46), (0.28, 0.28))
    for bound, words in (("own", "by their value"), ("noise", "by noise"))
    if (a, bound) != (0.28, "noise")
}
_POWER = {
    f"{n} and {n} {what}, ratio {ratio}": Design(
        units=(n, n), scatter=(scatter, scatter), days=days, ratio=ratio
    )
    for n in (3, 5, 10)
    for what, ratio, scatter, days in (("dishes", 1.5, 0.2, None), ("days", 1.4, 0.1, 0.35))
}
DOCUMENTED = _DISHES | _DAYS | _BOUNDED | _POWER
"""Designs by what docs/groups.md calls them."""


def write_shares(document: Path) -> None:
    """Write the table of docs/groups.md anew."""
    before, begin, rest = document.read_text(encoding="utf-8").partition("| --- | --- |\n| 3 and 3")
    rows = (f"| {name} | {in_words(design)} |" for name, design in DOCUMENTED.items())
    after = rest[rest.index("\n\n<!-- shares: end") :]
    text = before + begin.partition("\n")[0] + "\n" + "\n".join(rows) + after
    document.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    write_shares(ROOT / "docs" / "groups.md")
