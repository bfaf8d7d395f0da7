"""Rows of several conditions in one table: temperatures, strains or samples, one below the other.

Rows at the same time or frequency are repeats, which may be averaged, if they differ by no more
than the noise: by an F test of their scatter about their means against that of the means about the
line between both neighbours. Else a column that tells them apart says of what they are.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import combinations

import numpy as np

import biogrip.levels as levels
from biogrip.arrays import Array
from biogrip.digits import plain
from biogrip.traces.tables import number_or_inf

FEWEST_ROWS = 3
"""Fewest rows of a condition."""


def are_repeats(places: Array, readings: Array) -> bool:
    """Return True if rows of equal places differ by no more than noise.

    Places, times or the logarithms of frequencies, are (n_rows,), readings (n_rows, n_columns).
    Where nothing tells the noise, they are repeats.
    """
    sizes = np.log(readings) if np.all(readings > 0) else readings
    middle, group, counts = np.unique(places, return_inverse=True, return_counts=True)
    more, free = len(places) - len(middle), (len(middle) - 2) // 2
    if free < 1 or not more:
        return True
    means = np.array([np.bincount(group, column) / counts for column in sizes.T])
    within = np.sum((sizes.T - means[:, group]) ** 2, axis=1) / more
    later = (middle[1:-1] - middle[:-2]) / (middle[2:] - middle[:-2])
    bent = means[:, 1:-1] - (1 - later) * means[:, :-2] - later * means[:, 2:]
    of_noise = 1 / counts[1:-1] + (1 - later) ** 2 / counts[:-2] + later**2 / counts[2:]
    about_lines = np.mean(bent**2 / of_noise, axis=1)
    # Imported here: it takes longer than many a job, and few files have rows of several conditions.
    from scipy.special import fdtrc

    chances = fdtrc(more, free, within / np.maximum(about_lines, np.finfo(float).tiny))
    return bool(np.all(chances > levels.CONDITIONS / len(chances)))


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


def is_like(cell: str, wanted: float | str) -> bool:
    """Return True if a cell has the number that is wanted, or a measured one scattered about it.

    Whole numbers, as of samples, do not scatter.
    """
    if isinstance(wanted, str):
        return cell == wanted
    number = _number_in(cell)
    near = abs(number - wanted) <= levels.MEASURED_ALIKE * abs(wanted)
    return cell == str(wanted) or number == wanted or (near and not number.is_integer())


def _measured(cells: Sequence[str]) -> list[str]:
    """Return cells; of numbers so close that they scatter about one, their mean."""
    numbers = np.array([*map(_number_in, cells)])
    if not np.all(np.isfinite(numbers)) or np.all(numbers == np.rint(numbers)):
        return [*cells]
    values, place = np.unique(numbers, return_inverse=True)
    group = np.append(0, np.cumsum(np.diff(values) > levels.MEASURED_ALIKE * np.abs(values[1:])))[
        place
    ]
    means = np.bincount(group, numbers) / np.bincount(group)
    return [plain(mean) for mean in means[group]]


def _number_in(cell: str) -> float:
    return float(number_or_inf(cell.replace(",", ".")))
