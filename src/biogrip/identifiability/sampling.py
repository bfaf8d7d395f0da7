"""Markov chain Monte Carlo sampling of a posterior by an ensemble of walkers.

First the walkers explore, by differential evolution moves and by moves in one coordinate. A
mixture is fitted to the points that they visited. Its proposals, which lead from any basin to
any other, then take turns with the other moves until means and tails have converged.

References
----------
.. [1] D. Foreman-Mackey et al., emcee: the MCMC hammer, Publications of the Astronomical
   Society of the Pacific 125 (2013), 306-312: the sampler.
.. [2] C. J. F. ter Braak, A Markov chain Monte Carlo version of the genetic algorithm
   differential evolution, Statistics and Computing 16 (2006), 239-249: its moves, and steps of
   a whole difference between basins.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import emcee
import numpy as np
from emcee.moves import DEMove, MHMove

from biogrip.arrays import Array
from biogrip.errors import BiogripError
from biogrip.identifiability.convergence import Convergence, diagnose_convergence
from biogrip.identifiability.mixture import Mixture, fit_mixture
from biogrip.identifiability.posterior import Posterior
from biogrip.identifiability.posterior_settings import PosteriorSettings
from biogrip.identifiability.valley_coordinates import ValleyCoordinates, valley_coordinates
from biogrip.identify.answer import Progress
from biogrip.identify.local_fits import FAIR, LocalFits

# Points drawn from the prior, the best of them, which are fitted, and points about each optimum.
_DRAWN, _FITTED, _ABOUT = 2000, 32, 200
# Least and largest scale of the distance of points about an optimum, in e-folds.
_NEAREST, _FURTHEST = 1e-3, 10.0
# Steps between tests of convergence; mixtures are fitted to every other step.
_STRETCH, _KEPT = 250, 2
# Powers of the likelihood, one per stretch, with which walkers explore: a flatter likelihood lets
# them cross between basins. Mixtures are fitted to a few points of the last but one as well, so
# that proposals are nowhere much rarer than samples.
_POWERS, _WIDER = (0.05, 0.25, 1.0), 8
# Numbers of stretches after which the mixture is fitted anew.
_LEARNING = (2, 4)
_COOLER = 0.8
# Log-parameters are multiples of this, far below their uncertainty. Repeated differences would
# otherwise amplify the last bits, in which processors differ, until decisions differ.
_GRID = 2.0**-20


@dataclass(frozen=True)
class Samples:
    """Posterior samples: the points that walkers visited after their exploration."""

    log_parameters: Array
    """(n_steps, n_walkers, n_parameters)."""
    accepted: float
    """Share of accepted proposals."""
    convergence: Convergence
    """Convergence diagnostics of the samples."""


def sampled(
    posterior: Posterior, settings: PosteriorSettings, rng: np.random.Generator, progress: Progress
) -> Samples:
    """Sample a posterior until it has converged, or for as many steps as are allowed.

    Parameters
    ----------
    posterior
        Posterior that is sampled.
    settings
        Numbers of walkers and steps.
    rng
        The only source of randomness.
    progress
        Called after every stretch with the number of evaluations.

    Raises
    ------
    BiogripError
        If the model has no response in most of the search range.
    """
    axes = valley_coordinates(posterior.problem.residuals.model)
    walkers = _starts(posterior, settings.walkers, rng)
    # The sampler draws from NumPy's older generator, whose streams never change.
    seed = np.random.RandomState(np.random.MT19937(int(rng.integers(2**63)))).get_state()
    ensemble = _Ensemble(posterior, emcee.State(walkers, random_state=seed), progress)
    moves = _moves(posterior, axes)
    for power in _POWERS:
        wider = ensemble.recent
        ensemble.walk(_STRETCH, moves, power)
        moves = _moves(posterior, axes, fit_mixture(axes.of(ensemble.recent), rng))
    left = settings.most_steps - len(_POWERS) * _STRETCH
    # Samples from before the last fit of the mixture are not kept.
    for length in (*_LEARNING, left):
        learnt = np.concatenate([ensemble.recent, wider[: len(ensemble.recent) // _WIDER]])
        moves = _moves(posterior, axes, fit_mixture(axes.of(learnt), rng))
        stretches: list[Stretch] = []
        while len(stretches) < length:
            stretches.append(ensemble.walk(_STRETCH, moves))
            left -= _STRETCH
            found = _samples(stretches, axes)
            if found.convergence.reached or left < _STRETCH:
                return found
        ensemble.recent = found.log_parameters[::_KEPT].reshape(-1, walkers.shape[1])
    return found


def _samples(stretches: Sequence["Stretch"], axes: ValleyCoordinates) -> Samples:
    chains, accepted = zip(*stretches, strict=True)
    exchangeable = np.concatenate(chains)
    return Samples(exchangeable, float(np.mean(accepted)), diagnose_convergence(exchangeable, axes))


def _starts(posterior: Posterior, count: int, rng: np.random.Generator) -> Array:
    """Draw the walkers' starts by density from points of the prior and about all optima."""
    prior, problem = posterior.prior, posterior.problem
    drawn = prior.draw(_DRAWN, rng)
    order = np.argsort(-posterior.log_density(drawn).astype(np.float32), kind="stable")
    best = drawn[order[:_FITTED]]
    optima = LocalFits([problem]).fitted(best, np.zeros(len(best), dtype=np.int64), FAIR).x
    centres = np.repeat(optima, _ABOUT, axis=0)
    scales = np.exp(rng.uniform(np.log(_NEAREST), np.log(_FURTHEST), (len(centres), 1)))
    about = centres + scales * rng.standard_normal(centres.shape)
    pool = _gridded(np.concatenate([drawn, optima, np.clip(about, prior.low, prior.high)]))
    density = posterior.log_density(pool)
    pool, density = pool[np.isfinite(density)], density[np.isfinite(density)]
    if len(pool) < count:
        raise BiogripError(
            "posterior: the model has no answer in most of the search range; allowed is a "
            "narrower one."
        )
    share = _tempered(density - density.max(), count)
    chosen: Array = pool[rng.choice(len(pool), size=count, replace=False, p=share)]
    return chosen


def _tempered(log_weights: Array, count: int) -> Array:
    """Return weights, flattened until they are shared by enough points."""
    power = 1.0
    while True:
        weights = np.exp(power * log_weights)
        weights /= weights.sum()
        if 1 / np.sum(weights**2) > 0.5 * count and np.count_nonzero(weights) >= count:
            return weights
        power *= _COOLER


Moves = Sequence[tuple[emcee.moves.Move, float]]
# Points of the walkers, and the share of accepted proposals.
Stretch = tuple[Array, float]


class _Ensemble:
    """The walkers and their current points."""

    def __init__(self, posterior: Posterior, state: emcee.State, progress: Progress) -> None:
        self._posterior = posterior
        self._state = state
        self._progress = progress
        self._evaluations = 0
        self.recent = state.coords

    def walk(self, steps: int, moves: Moves, power: float = 1.0) -> Stretch:
        """Take steps, with the likelihood raised to a power."""
        count, size = self._state.coords.shape
        density = partial(self._posterior.log_density, power=power)
        sampler = _Sampler(count, size, density, moves=moves, vectorize=True)
        start = emcee.State(self._state.coords, random_state=self._state.random_state)
        self._state = sampler.run_mcmc(start, steps, skip_initial_state_check=True)
        chain = sampler.get_chain()
        self.recent = chain[steps // 2 :: _KEPT].reshape(-1, size)
        self._evaluations += count * steps
        best = self._state.coords[[np.argmax(self._state.log_prob)]]
        misfit_rad = self._posterior.problem.residuals.condensed_misfit(np.exp(best))
        self._progress(self._evaluations, float(misfit_rad[0]))
        return chain, float(np.mean(sampler.acceptance_fraction))


class _Sampler(emcee.EnsembleSampler):  # type: ignore[misc]
    """emcee's sampler for a density function that returns one array, without blobs and NaN."""

    def compute_log_prob(self, coords: Array) -> tuple[Array, None]:
        """Return the logarithms of the density at points, (n,)."""
        return self.log_prob_fn(coords), None


class _AlongValley(DEMove):  # type: ignore[misc]
    """Differential evolution moves in coordinates whose Jacobian determinant is one."""

    def __init__(self, axes: ValleyCoordinates, gamma0: float | None = None) -> None:
        super().__init__(gamma0=gamma0)
        self._axes = axes

    def get_proposal(
        self, s: Array, c: list[Array], random: np.random.RandomState
    ) -> tuple[Array, Array]:
        """Propose points for walkers `s` by differences of the others, `c`."""
        others = [self._axes.of(np.concatenate(c))]
        proposed, factors = super().get_proposal(self._axes.of(s), others, random)
        return _gridded(self._axes.back(proposed)), factors


def _moves(posterior: Posterior, axes: ValleyCoordinates, mixture: Mixture | None = None) -> Moves:
    """Return the moves: differences, single coordinates, and draws of a mixture if there is one."""
    prior, plain = posterior.prior, ValleyCoordinates(())
    found: list[tuple[emcee.moves.Move, float]] = [
        (_AlongValley(plain), 0.15),
        (_AlongValley(axes), 0.15),
        (_AlongValley(axes, gamma0=1.0), 0.1),
        (MHMove(partial(_one_anew, plain, prior.low, prior.high)), 0.15),
        (MHMove(partial(_one_anew, axes, *axes.range(prior.low, prior.high))), 0.15),
    ]
    if mixture is not None:
        found.append((MHMove(partial(_of_mixture, axes, mixture)), 0.3))
    return found


def _one_anew(
    axes: ValleyCoordinates, low: Array, high: Array, walkers: Array, random: np.random.RandomState
) -> tuple[Array, Array]:
    """Propose for each walker a uniform draw of one coordinate, chosen at random."""
    proposed = axes.of(walkers)
    rows = np.arange(len(walkers))
    moved = random.randint(walkers.shape[1], size=len(walkers))
    proposed[rows, moved] = random.uniform(low[moved], high[moved])
    return _gridded(axes.back(proposed)), np.zeros(len(walkers))


def _of_mixture(
    axes: ValleyCoordinates, mixture: Mixture, walkers: Array, random: np.random.RandomState
) -> tuple[Array, Array]:
    """Propose draws from a mixture, independent of the walkers' points."""
    drawn = _gridded(axes.back(mixture.draw(len(walkers), random)))
    density = mixture.log_density(axes.of(np.concatenate((walkers, drawn))))
    return drawn, density[: len(walkers)] - density[len(walkers) :]


def _gridded(log_parameters: Array) -> Array:
    return np.rint(log_parameters / _GRID) * _GRID
