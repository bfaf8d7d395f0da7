"""Population of the cells of one dish, by a hierarchical model of their profiles.

The logarithm y_i of a quantity in cell i is drawn from a normal population with mean mu and spread
tau, and its trace has the likelihood L_i (`CellLikelihood`), normal or not, with an end or without:

    y_i ~ N(mu, tau^2),    L(mu, tau) = prod_i integral L_i(y) N(y; mu, tau) dy

A cell that is bounded on one side only counts for that bound. Limits are those of the posterior,
with the integral over tau. The prior of mu is flat; that of tau is 1/sqrt(s^2 + tau^2), where s is
the median error of the cells: uniform where errors hide the spread, 1/tau where they are small. So
the limits of cells without errors are those of Student's t and of chi^2 with n - 1 degrees of
freedom. With errors as large as the spread, limits of few cells hold the truth more often than
they promise: no likelihood of five cells excludes a spread of the size of their errors.

The estimate of tau maximises the likelihood after integration over mu (restricted maximum
likelihood), which the posterior of arsinh(tau/s) is.

References
----------
.. [1] S. W. Raudenbush and A. S. Bryk, Empirical Bayes meta-analysis, Journal of Educational
   Statistics 10 (1985), 75-98: the hierarchical model.
.. [2] A. Gelman, Prior distributions for variance parameters in hierarchical models, Bayesian
   Analysis 1 (2006), 515-533: the uniform prior, and what it does to few cells.
.. [3] C. Roever, Bayesian random-effects meta-analysis using the bayesmeta R package, Journal of
   Statistical Software 93 (2020), 6: integration over mu and tau, shortest intervals, other priors.
.. [4] D. A. Harville, Maximum likelihood approaches to variance component estimation and to related
   problems, Journal of the American Statistical Association 72 (1977), 320-338: why restricted.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from biogrip.arrays import Array
from biogrip.groups.cell_likelihood import CellLikelihood

FEWEST_CELLS = 3
"""Fewest cells that determine a quantity for a population: with two, the 95 % interval of the
median would reach six times their distance to either side."""

# Nodes of arsinh(tau/s), and of mu about its mean in standard deviations. The trapezoidal rule with
# such steps errs by less than 1e-3 of a probability.
_SPREADS, _SCAN = 25, 400
_CENTRES = np.arange(-8.0, 8.01, 0.5)
# Decrease of the log-posterior beyond which spreads are left out, and e-folds over the scatter.
_FAR, _WIDEST = 15.0, 8.0
# Largest share of the posterior at an end of the nodes, and moves of the nodes to meet it.
_AT_ENDS, _MOST_MOVES = 1e-5, 8
# Nodes below this share of the largest are left out for single cells. Points of their population,
# in spreads beyond its centre, and points of the posterior of the spread between nodes.
_RARE, _REACHED, _FINE = 1e-5, np.linspace(-6.0, 6.0, 49), 2000
# Least likelihood, whose logarithm is finite.
_TINY = 1e-300


@dataclass(frozen=True)
class Estimates:
    """Estimates of one quantity in the cells of one dish that determine it, as logarithms."""

    cells: tuple[str, ...]
    """Names of the cells."""
    log_values: Array
    """Logarithms of the quantity, (n_cells,)."""
    deviations: Array
    """Standard deviations of the logarithms, above zero, (n_cells,)."""


@dataclass(frozen=True)
class Interval:
    """A median and limits, as logarithms."""

    centre: float
    """Median."""
    low: float
    """Lower confidence limit."""
    high: float
    """Upper one."""


@dataclass(frozen=True)
class Population:
    """Population of the cells of a dish; all values are logarithms of the quantity."""

    confidence: float
    """Confidence level of all intervals, e.g. 0.95."""
    freedom: int
    """Degrees of freedom of its deviations."""
    centre: Interval
    """Mean of the logarithms, that is the logarithm of the median."""
    spread: Interval
    """Standard deviation between cells, without estimation errors: restricted maximum likelihood,
    and shortest interval."""
    cells: tuple[Interval, ...]
    """Each cell as its own trace and the others' tell of it together (shrunk)."""

    @property
    def deviations(self) -> tuple[float, float]:
        """Standard deviation of the centre downwards and upwards, from Student's t."""
        reach = self._reach
        return (
            (self.centre.centre - self.centre.low) / reach,
            (self.centre.high - self.centre.centre) / reach,
        )

    @property
    def deviation(self) -> float:
        """Mean of both."""
        return (self.centre.high - self.centre.low) / (2 * self._reach)

    @property
    def _reach(self) -> float:
        from scipy.special import stdtrit

        return float(stdtrit(self.freedom, (1 + self.confidence) / 2))


def estimate_population(
    estimates: Estimates, cells: Sequence[CellLikelihood], confidence: float, *, freedom: int
) -> Population:
    """Estimate the population of the cells of a dish.

    Parameters
    ----------
    estimates
        Estimates of at least two cells: they say where to look, and the prior of the spread.
    cells
        Likelihoods of all cells, with those that do not determine the quantity.
    confidence
        Confidence level of the intervals, e.g. 0.95.
    freedom
        Degrees of freedom of the deviations: cells that bound the quantity, less one.
    """
    nodes = _Nodes.around(estimates)
    for _ in range(_MOST_MOVES):
        posterior = _Posterior.at(nodes, cells)
        moved = posterior.moved_nodes()
        if moved is None:
            break
        nodes = moved
    tails = np.array([(1 - confidence) / 2, 0.5, (1 + confidence) / 2])
    return Population(
        confidence,
        freedom,
        posterior.centre(tails),
        posterior.spread(confidence),
        tuple(posterior.cell(cell, tails) for cell in cells),
    )


@dataclass(frozen=True)
class _Nodes:
    """Nodes of the spread, and for each of them of the centre."""

    error: float
    """Scale s of the prior of the spread."""
    scaled: Array
    """arsinh(tau/s), equidistant, (n_spreads,)."""
    middle: Array
    """Mean of the centre for each spread, (n_spreads,)."""
    width: Array
    """Its standard deviation."""

    @classmethod
    def around(cls, estimates: Estimates) -> "_Nodes":
        """Return nodes about the posterior of the determined cells, taken as normal."""
        y, s = estimates.log_values, estimates.deviations
        error = float(np.median(s))
        widest = np.arcsinh((np.std(y) + error) / error) + _WIDEST
        scan = np.linspace(0.0, widest, _SCAN)
        weights, middle, width = _weighted(error * np.sinh(scan), y, s)
        apart = np.sum(weights * (y - middle[:, None]) ** 2, axis=1)
        log_density = 0.5 * np.sum(np.log(weights), axis=1) + np.log(width) - 0.5 * apart
        near = scan[log_density > log_density.max() - _FAR]
        scaled = np.linspace(near[0], near[-1], _SPREADS)
        return cls(error, scaled, *_weighted(error * np.sinh(scaled), y, s)[1:])

    @property
    def spreads(self) -> Array:
        """Spreads, (n_spreads,); none is zero, but the first may be far below any error."""
        return self.error * np.sinh(np.maximum(self.scaled, 1e-9))

    @property
    def centres(self) -> Array:
        """Centres, (n_spreads, n_centres)."""
        centres: Array = self.middle[:, None] + self.width[:, None] * _CENTRES
        return centres


@dataclass(frozen=True)
class _Posterior:
    """Posterior of centre and spread at nodes."""

    nodes: _Nodes
    density: Array
    """Density of arsinh(tau/s) and of the centre in standard deviations, (n_spreads, n_centres),
    relative to the largest."""

    @classmethod
    def at(cls, nodes: _Nodes, cells: Sequence[CellLikelihood]) -> "_Posterior":
        """Return the product of the cells' likelihoods and of the priors."""
        centres, spreads = nodes.centres, nodes.spreads
        log_density = np.repeat(np.log(nodes.width), len(_CENTRES))
        for cell in cells:
            own = cell.masses(centres.ravel(), np.repeat(spreads, len(_CENTRES))).sum(axis=0)
            log_density += np.log(np.maximum(own, _TINY))
        density = np.exp(log_density - log_density.max())
        return cls(nodes, density.reshape(centres.shape))

    @property
    def shares(self) -> Array:
        """Probability of each node, (n_spreads, n_centres)."""
        # At the first node the spread may be zero, where the density does not end in a tail.
        shares = self.density.copy()
        shares[0] /= 2
        return shares / shares.sum()

    def moved_nodes(self) -> _Nodes | None:
        """Return nodes that follow the posterior; None where these have it between their ends.

        Cells that only bound the quantity, or are skewed, move it from where the others have it.
        """
        nodes, shares = self.nodes, self.shares
        above = shares[-1].sum() > _AT_ENDS
        if not above and shares[:, [0, -1]].sum() < _AT_ENDS:
            return None
        own = self.density.sum(axis=1)
        own = np.maximum(own, _TINY)
        mean = self.density @ _CENTRES / own
        deviation = np.sqrt(np.maximum(self.density @ _CENTRES**2 / own - mean**2, 0.0))
        step = nodes.scaled[1] - nodes.scaled[0]
        scaled = np.linspace(
            nodes.scaled[0], nodes.scaled[-1] + (above * _SPREADS / 4) * step, _SPREADS
        )
        # Nodes of which the ends are the likeliest are moved by their whole width.
        middle = nodes.middle + nodes.width * mean
        width = nodes.width * np.clip(deviation, 0.5, 2.0)
        return _Nodes(
            nodes.error,
            scaled,
            np.interp(scaled, nodes.scaled, middle),
            np.interp(np.sinh(scaled), np.sinh(nodes.scaled), width)
            * np.maximum(1.0, np.sinh(scaled) / np.sinh(nodes.scaled[-1])),
        )

    def centre(self, tails: Array) -> Interval:
        """Return the median and limits of the centre, at the probabilities low, median and high."""
        from scipy.interpolate import CubicSpline
        from scipy.optimize import brentq

        nodes = self.nodes
        below = CubicSpline(_CENTRES, self.density.T).antiderivative()
        whole = np.maximum(below(_CENTRES[-1]), _TINY)
        own = self.shares.sum(axis=1)

        def excess(centre: float, tail: float) -> float:
            z = np.clip((centre - nodes.middle) / nodes.width, _CENTRES[0], _CENTRES[-1])
            return float(own @ (np.diagonal(below(z)) / whole)) - tail

        ends = float(nodes.centres.min()), float(nodes.centres.max())
        low, centre, high = (
            float(brentq(excess, *ends, (tail,), xtol=1e-9 * (ends[1] - ends[0]))) for tail in tails
        )
        return Interval(centre, low, high)

    def spread(self, confidence: float) -> Interval:
        """Return the likeliest spread, and the shortest interval."""
        from scipy.interpolate import CubicSpline

        scaled = self.nodes.scaled
        own = np.log(np.maximum(self.density.sum(axis=1), _TINY))
        # The likelihood depends on the square of the spread.
        first = (1, 0.0) if scaled[0] == 0 else "not-a-knot"
        curve = CubicSpline(scaled, own, bc_type=(first, "not-a-knot"))
        turns = curve.derivative().roots(extrapolate=False)
        turns = np.append(turns[np.isfinite(turns)], scaled[[0, -1]])
        fine = np.linspace(scaled[0], scaled[-1], _FINE)
        shares = np.exp(curve(fine))
        density = shares / np.cosh(fine)
        likeliest = np.argsort(-density, kind="stable")
        probability = np.cumsum(shares[likeliest]) / shares.sum()
        within = likeliest[: 1 + int(np.searchsorted(probability, confidence))]
        ends = (float(turns[np.argmax(curve(turns))]), fine[within.min()], fine[within.max()])
        best, low, high = (self.nodes.error * float(np.sinh(end)) for end in ends)
        return Interval(best, low, high)

    def cell(self, cell: CellLikelihood, tails: Array) -> Interval:
        """Return median and limits of a cell, of its own trace and the others' together."""
        shares = self.shares.ravel()
        kept = shares > _RARE * shares.max()
        centres = self.nodes.centres.ravel()[kept]
        spreads = np.repeat(self.nodes.spreads, len(_CENTRES))[kept]
        middle, typical = np.average(centres, weights=shares[kept]), np.median(spreads)
        finer = cell.with_knots(middle + typical * _REACHED)
        masses = finer.masses(centres, spreads)
        below = np.cumsum((masses / masses.sum(axis=0)) @ shares[kept])[:-1]
        low, centre, high = (float(end) for end in np.interp(tails, below / below[-1], finer.knots))
        return Interval(centre, low, high)


def _weighted(spreads: Array, y: Array, s: Array) -> tuple[Array, Array, Array]:
    """Return weights of cells, (n_spreads, n_cells), and mean and deviation of the centre."""
    weights = 1 / (spreads[:, None] ** 2 + s**2)
    whole = weights.sum(axis=1)
    return weights, weights @ y / whole, whole**-0.5
