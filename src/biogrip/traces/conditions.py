"""Rows of several conditions in one table: temperatures, strains or samples, one below the other.

Rows at the same time or frequency are repeats, which may be averaged, if they differ by no more
than the noise: by an F test of their scatter about their means against that of the means about the
line between both neighbours; and, as a coarse sweep is bent between these, by Student's test of the
differences between first and last row of each frequency, of which noise has no mean. Else a column
that tells them apart says of what they are.
"""

from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from itertools import combinations

import numpy as np

import biogrip.levels as levels
from biogrip.arrays import Array
from biogrip.digits import plain
from biogrip.traces.tables import number_or_inf

FEWEST_ROWS = 3
"""Fewest rows of a condition."""


def how_they_differ(places: Array, readings: Array, *, sweeps: bool) -> str:
    """Return by how much rows of equal places differ, if that is more than noise; else nothing.

    Places, times or the logarithms of frequencies, are (n_rows,), readings (n_rows, n_columns), in
    the order of the file. Where nothing tells the noise, they are repeats. Rows of one time may
    differ between first and last, as where a rounded clock writes the course of a second.
    """
    largest = max(float(np.max(np.abs(readings))), np.finfo(float).tiny)
    sizes = np.log(readings) if np.all(readings > 0) else readings / largest
    middle, first, group, counts = np.unique(
        places, return_index=True, return_inverse=True, return_counts=True
    )
    last = len(places) - 1 - np.unique(places[::-1], return_index=True)[1]
    more, free = len(places) - len(middle), (len(middle) - 2) // 2
    steps = (sizes[last] - sizes[first])[counts > 1]
    # Of each test degrees of freedom, and the squares of what differs and of noise, by column.
    tests = list[tuple[int, int, Array, Array]]()
    if free > 0 and more:
        means = np.array([np.bincount(group, column) / counts for column in sizes.T])
        within = np.sum((sizes.T - means[:, group]) ** 2, axis=1) / more
        later = (middle[1:-1] - middle[:-2]) / (middle[2:] - middle[:-2])
        bent = means[:, 1:-1] - (1 - later) * means[:, :-2] - later * means[:, 2:]
        of_noise = 1 / counts[1:-1] + (1 - later) ** 2 / counts[:-2] + later**2 / counts[2:]
        tests.append((more, free, within, np.mean(bent**2 / of_noise, axis=1)))
    if sweeps and len(steps) > 1:
        square = len(steps) * np.mean(steps, axis=0) ** 2 / 2
        tests.append((1, len(steps) - 1, square, np.var(steps, axis=0, ddof=1) / 2))
    # Imported here: it takes longer than many a job, and few files have rows of several conditions.
    from scipy.special import fdtrc

    for one, other, square, noise in tests:
        ratio = square / np.maximum(noise, np.finfo(float).tiny)
        if fdtrc(one, other, ratio.max()) <= levels.CONDITIONS / (len(tests) * len(ratio)):
            squares = np.mean(steps**2, axis=0)[ratio.argmax()], noise[ratio.argmax()]
            apart, scatter = (plain(100 * float(size), 2) for size in np.sqrt(squares))
            return f"differ by {apart} % from the first to the last row, by noise of {scatter} %"
    return ""


def tells_apart(places: Array, others: Mapping[str, Sequence[str]]) -> dict[str, list[str]]:
    """Return a column, or two, in which rows of equal places differ, with their values by name.

    Others are cells of columns that are not read, (n_rows,), by name. Nothing is returned where no
    column has few values, each of them with some rows of different places.
    """
    most = len(places) // FEWEST_ROWS
    for labels in (list[str], _measured):
        columns = {name: labels(cells) for name, cells in others.items()}
        few = {name: cells for name, cells in columns.items() if 1 < len({*cells}) <= most}
        for names in (*combinations(few, 1), *combinations(few, 2)):
            conditions = Counter(zip(*(few[name] for name in names), strict=True))
            rows = {*zip(*(few[name] for name in names), places.tolist(), strict=True)}
            if len(rows) == len(places) and min(conditions.values()) >= FEWEST_ROWS:
                return {name: [*dict.fromkeys(few[name])] for name in names}
    return {}


def alike(cells: Sequence[str], wanted: float | str) -> set[str]:
    """Return the cells that have what is wanted, or measured numbers scattered about it.

    Whole numbers, as of samples, do not scatter, nor do numbers that come again and again.
    """
    if isinstance(wanted, str):
        return {*cells} & {wanted}
    again, groups = len({*cells}) <= len(cells) // FEWEST_ROWS, defaultdict[str, set[str]](set)
    for cell, mean in zip(cells, cells if again else _measured(cells), strict=True):
        groups[mean].add(cell)
    found, least = set[str](), levels.MEASURED_ALIKE * abs(wanted)
    for group in groups.values():
        numbers = [*map(_number_in, group)]
        near = any(abs(it - wanted) <= least and not it.is_integer() for it in numbers)
        if near or str(wanted) in group or min(numbers) <= wanted <= max(numbers):
            found |= group
    return found


def _measured(cells: Sequence[str]) -> list[str]:
    """Return cells; of numbers that scatter about a few, far less than these differ, those few."""
    numbers = np.array([*map(_number_in, cells)])
    if not np.all(np.isfinite(numbers)) or np.all(numbers == np.rint(numbers)):
        return [*cells]
    values, place = np.unique(numbers, return_inverse=True)
    sizes = np.maximum(np.abs(values[1:]), np.abs(values[:-1]))
    gaps = np.diff(values) / sizes
    for cut in np.sort(gaps)[::-1][: len(cells) // FEWEST_ROWS]:
        apart = gaps >= cut
        group = np.append(0, np.cumsum(apart))
        spread = np.bincount(group[1:], np.where(apart, 0, gaps)).max()
        counts = np.bincount(group[place])
        if cut > levels.APART * spread and counts.min() >= FEWEST_ROWS:
            means = np.bincount(group[place], numbers) / counts
            return [plain(mean) for mean in means[group[place]]]
    return [*cells]


def _number_in(cell: str) -> float:
    return float(number_or_inf(cell.replace(",", ".")))
