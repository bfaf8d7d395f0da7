"""The cheapest set of experiments with which enough cells of a population are known.

Information of experiments with one cell adds up. A parameter's variance is the largest of
1 / (u' M u) over vectors u whose component of this parameter is one, M being the information. So
the variance is at most v if u' M u is at least 1/v for all u, and each u gives an inequality that
is linear in how often each experiment is made. An integer linear program [1]_ with some of these
has a solution that costs no more than the cheapest set; with the u of each cell that it calls known
and is not, it is solved again until there is none. What it finds then is the cheapest set.

The cheapest set for a share of some cells is enough for a smaller share of other cells: it was
chosen for what these happen to be. So sets are chosen for some cells and judged by others.

References
----------
.. [1] M. A. Duran and I. E. Grossmann, An outer-approximation algorithm for a class of
   mixed-integer nonlinear programs, Mathematical Programming 36 (1986), 307-339.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from biogrip.arrays import Array, BoolArray, IntArray
from biogrip.design.criteria import inverted

# Share by which a variance may exceed the largest: more than the linear program's tolerance.
_TOLERANCE = 1e-5
# Coefficients below this are nothing to the linear program.
_NOTHING = 1e-9
# Share by which variances are to be smaller, again and again, where sets for all cells are too
# little for the others; and how often.
_SMALLER, _OFTEN = 0.1, 8


@dataclass(frozen=True, eq=False)
class ExperimentSet:
    """Experiments with each cell."""

    counts: IntArray
    """How often each experiment is made, (n_experiments,)."""
    cost: float
    """What they cost."""
    known: BoolArray
    """True for cells of which they tell enough, (n_cells,)."""

    @property
    def share(self) -> float:
        """Share of these cells."""
        return float(self.known.mean())


@dataclass(eq=False)
class SetProblem:
    """Experiments to choose from, and what they tell of cells."""

    information: Array
    """Information on the log-parameters, (n_experiments, n_cells, n_parameters, n_parameters)."""
    costs: Array
    """What each experiment costs, (n_experiments,)."""
    targets: tuple[int, ...]
    """Indices of the parameters that are asked for."""
    largest: float
    """Largest standard deviation of their logarithms, with which a cell counts as known."""
    most: int
    """Most experiments with a cell."""
    before: Array | float = 0.0
    """Information that is there already, (n_cells or 1, n_parameters, n_parameters)."""
    _cells: list[IntArray] = field(default_factory=list, init=False)
    _rows: list[Array] = field(default_factory=list, init=False)

    def covariances(self, counts: IntArray) -> Array:
        """Return covariances of log-parameters, (n_cells, n_parameters, n_parameters)."""
        return inverted(np.tensordot(counts, self.information, 1) + self.before)

    def repeat(self, experiment: int, times: int = 1) -> IntArray:
        """Return how often each is made if one is made some times, (n_experiments,)."""
        return times * np.eye(len(self.costs), dtype=np.intp)[experiment]

    def made(self, counts: IntArray) -> ExperimentSet:
        """Return the set in which each experiment is made so often."""
        known = self.are_known(self.covariances(counts))
        return ExperimentSet(counts, float(counts @ self.costs), known)

    def are_known(self, covariances: Array) -> BoolArray:
        """Return True for cells with small enough covariances, (n_cells,)."""
        variances = np.diagonal(covariances, axis1=1, axis2=2)[:, self.targets]
        return np.all(variances <= self.largest**2 * (1 + _TOLERANCE), axis=1)

    def cheapest(self, cells: int) -> ExperimentSet | None:
        """Return the cheapest set that tells enough of so many cells, if there is one."""
        # Imported lazily: no other command needs it.
        from scipy.optimize import Bounds, LinearConstraint, milp

        many, population = self.information.shape[:2]
        cost = np.concatenate((self.costs, np.zeros(population)))
        upper = np.concatenate((np.full(many, float(self.most)), np.ones(population)))
        limits = [
            LinearConstraint((np.arange(len(cost)) < many).astype(float)[None], ub=self.most),
            LinearConstraint((np.arange(len(cost)) >= many).astype(float)[None], lb=cells),
        ]
        none = self.made(np.zeros(many, dtype=np.intp))
        if none.known.sum() >= cells:
            return none
        if not self._rows:
            self._cut(none.counts)
        while True:
            found = milp(
                cost,
                integrality=np.ones(len(cost)),
                bounds=Bounds(np.zeros(len(cost)), upper),
                constraints=[*limits, LinearConstraint(self._matrix(), lb=0.0)],
                options={"mip_rel_gap": 0.0},
            )
            if found.x is None:
                return None
            counts = np.rint(found.x[:many]).astype(np.intp)
            made = self.made(counts)
            if made.known.sum() >= cells:
                return made
            self._cut(counts)

    def _cut(self, counts: IntArray) -> None:
        """Add the inequalities that cells which are not known with a set do not fulfil."""
        covariances = self.covariances(counts)
        for target in self.targets:
            variances = covariances[:, target, target]
            cells = np.flatnonzero(variances > self.largest**2 * (1 + _TOLERANCE))
            u = covariances[cells, target] / variances[cells, None]
            gained = np.einsum("cp,ecpq,cq->ce", u, self.information[:, cells], u)
            missing = self.largest**-2 - np.einsum(
                "cp,cpq,cq->c", u, np.broadcast_to(self.before, covariances.shape)[cells], u
            )
            # One experiment that tells enough is as good as if it told more.
            shares = np.minimum(gained / missing[:, None], 1.0)
            self._cells.append(cells)
            self._rows.append(np.where(shares < _NOTHING, 0.0, shares))

    def _matrix(self) -> Array:
        """Return the inequalities: what is told, less one where the cell is to be known."""
        cells, rows = np.concatenate(self._cells), np.concatenate(self._rows)
        return np.hstack((rows, -np.eye(self.information.shape[1])[cells]))


def front(problem: SetProblem, judged: SetProblem, shares: Iterable[float]) -> list[ExperimentSet]:
    """Return cheap sets for some shares of cells, as other cells judge them.

    Parameters
    ----------
    problem
        Cells that sets are chosen for.
    judged
        The same experiments with other cells.
    shares
        Shares of cells that are to be known.

    Returns
    -------
    list of ExperimentSet
        For each share the cheapest for as many of the first cells, for one more, and so on, until
        as many of the others are known; none for larger shares than one that was not reached.
    """
    found: list[ExperimentSet] = []
    for share in sorted(shares):
        found += [judged.made(one.counts) for one in _chosen(problem, judged, share)]
        if not found or found[-1].share < share:
            break
    return found


def _chosen(problem: SetProblem, judged: SetProblem, share: float) -> Iterator[ExperimentSet]:
    cells = problem.information.shape[1]
    for _ in range(_OFTEN):
        needed = enough(share, cells)
        one = None
        while needed <= cells and (one := problem.cheapest(needed)):
            yield one
            if judged.made(one.counts).share >= share:
                return
            needed = int(one.known.sum()) + 1
        if one is None:
            return
        problem = replace(problem, largest=problem.largest * (1 - _SMALLER) ** 0.5)


def repeated(problem: SetProblem) -> list[ExperimentSet]:
    """Return the cheapest sets for more and more cells that are one experiment again and again."""
    every = [
        problem.made(problem.repeat(index, count))
        for index in range(len(problem.costs))
        for count in range(1, problem.most + 1)
    ]
    return nothing_beats(every)


def nothing_beats(sets: list[ExperimentSet]) -> list[ExperimentSet]:
    """Return the sets that tell enough of more cells than each that costs no more."""
    found: list[ExperimentSet] = []
    for one in sorted(sets, key=lambda each: (each.cost, -each.share)):
        if one.share > (found[-1].share if found else 0.0):
            found.append(one)
    return found


def enough(share: float, population: int) -> int:
    """Return the least number of cells that is at least a share of them."""
    return int(np.ceil(share * population - 1e-9))
