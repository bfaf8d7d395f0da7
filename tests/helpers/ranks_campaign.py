"""How often the ratio by ranks, and that of medians, hold the truth where dishes spread unequally.

``python -m tests.helpers.ranks_campaign [pairs]`` takes some minutes for 800 pairs a row, and
writes the table that the documentation shows. The test suite has a few.
"""

import sys
from collections.abc import Callable, Iterator

import numpy as np
import pandas as pd

from biogrip.arrays import Array
from biogrip.groups.comparison import difference
from biogrip.groups.median_ratio import shift
from tests.helpers.cells import normal_population
from tests.helpers.places import ROOT

TABLE = ROOT / "results" / "published" / "groups" / "tables" / "ranks.csv"
CONFIDENCE, ERROR = 0.95, 0.05
DISHES = (
    *(((10, 0.3), (10, 0.3)), ((6, 0.3), (6, 0.3)), ((10, 0.6), (10, 0.1))),
    *(((6, 0.6), (12, 0.1)), ((8, 0.6), (12, 0.1)), ((4, 0.6), (12, 0.1))),
)
"""Numbers of cells, and standard deviations of their logarithms, in both dishes."""


def _normal(rng: np.random.Generator, count: int) -> Array:
    return rng.standard_normal(count)


def _bimodal(rng: np.random.Generator, count: int) -> Array:
    """Two kinds of cells in equal shares, of mean 0 and variance 1 together."""
    return 0.9 * rng.choice([-1.0, 1.0], count) + np.sqrt(0.19) * rng.standard_normal(count)


CELLS: dict[str, Callable[[np.random.Generator, int], Array]] = {
    "log-normal": _normal,
    "of two kinds": _bimodal,
}


def rows(pairs: int) -> Iterator[dict[str, object]]:
    """Yield for each kind of cells and pair of dishes how often intervals hold a ratio of 1."""
    for kind, draw in CELLS.items():
        for number, dishes in enumerate(DISHES):
            rng = np.random.default_rng([number, 41])
            held = np.array([_held(draw, dishes, rng) for _ in range(pairs)])
            yield {
                "kind": kind,
                **{f"cells_{place}": cells for place, (cells, _) in enumerate(dishes, 1)},
                **{f"spread_{place}": spread for place, (_, spread) in enumerate(dishes, 1)},
                "pairs": pairs,
                "coverage_percent": 100 * np.mean(held[:, 0]),
                "rank_coverage_percent": 100 * np.mean(held[:, 1]),
            }


def _held(
    draw: Callable[[np.random.Generator, int], Array],
    dishes: tuple[tuple[int, float], ...],
    rng: np.random.Generator,
) -> tuple[float, float]:
    """Return 1 where the interval of medians, and that of ranks, holds the ratio; NaN without."""
    values = [spread * draw(rng, n) + ERROR * rng.standard_normal(n) for n, spread in dishes]
    one, other = (normal_population(own, np.full(len(own), ERROR), CONFIDENCE) for own in values)
    apart, ranks = difference(one, other), shift(values[0], values[1], CONFIDENCE)
    by_ranks = np.nan if ranks.low is None else float(ranks.low <= 0 <= (ranks.high or 0.0))
    return float(apart.low <= 1 <= apart.high), by_ranks


def main(pairs: int) -> None:
    """Write the table, and print it."""
    found = []
    for row in rows(pairs):
        found.append(row)
        print(*row.values(), flush=True)
    pd.DataFrame(found).to_csv(TABLE, index=False, float_format="%.4g")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 800)
