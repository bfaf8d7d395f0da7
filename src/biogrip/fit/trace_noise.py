"""Noise of a trace: its model, estimated from what a fit leaves, and rows in which it is white.

This is all that a trace goes through on account of its noise, by two functions. `whitened_rows`
turns readings and responses to rows, in noise of a given model, or of none. Of residuals
`NoiseModelLikelihood` estimates that model. Both take times and functions, and know no experiment.

The autocorrelation is that of white noise plus exponentials of the time between two readings
(Ornstein-Uhlenbeck processes): one of any relaxation time, and a geometric series of them for 1/f
noise. A random walk begins with the first reading; the covariance of two of its readings is the
time of the earlier one. White noise may have a part that grows with the reading. The Cholesky
factor L of its matrix C is computed, and solved with, in linear time [7]_. Residuals r become L^-1
r, which are white and on average as large as r. Least squares of these are generalised [8]_.

Outliers are readings with far more noise than those around (`outliers_of`). Noise may grow with the
rotation (`compute_growth`). A test ranks the sizes of residuals against those of the rotation, so
that outliers count no more than other readings [1]_. The standard deviation is then that of two
independent parts, one the same everywhere and one proportional to the rotation, with the shares of
highest likelihood under Student's t, which bounds the influence of outliers [2]_.

Autocorrelation is estimated by restricted maximum likelihood (`NoiseModelLikelihood`), of the part
of the trace that parameters, offset and drift cannot absorb: what they absorb would bias it [3]_. A
prior keeps the share of 1/f noise and of a random walk, without its mean, from vanishing, as it
often would by chance alone [4]_.

References
----------
.. [1] C. Spearman, American Journal of Psychology 15 (1904), 72-101: rank correlation.
.. [2] K. L. Lange et al., Journal of the American Statistical Association 84 (1989), 881-896.
.. [3] H. D. Patterson and R. Thompson, Biometrika 58 (1971), 545-554: restricted likelihood.
.. [4] Y. Chung et al., Psychometrika 78 (2013), 685-709: a gamma prior on a standard deviation.
.. [5] F. R. Hampel, Journal of the American Statistical Association 69 (1974), 383-393.
.. [6] F. E. Satterthwaite, Biometrics Bulletin 2 (1946), 110-114.
.. [7] D. Foreman-Mackey et al., The Astronomical Journal 154 (2017), 220: celerite.
.. [8] A. C. Aitken, Proceedings of the Royal Society of Edinburgh 55 (1936), 42-48.
"""

from dataclasses import dataclass

import numpy as np

import biogrip.levels as levels
from biogrip.arrays import Array, BoolArray
from biogrip.physics.condensed import Condensed, SweptRows
from biogrip.physics.noise import (
    ROOT_12,
    flicker_rates,
    moduli_of,
    places_of,
    with_uncertain,
    without,
)
from biogrip.physics.protocol import Course
from biogrip.physics.residuals import Residuals

GAUSSIAN = 0.6744897501960817
"""Median absolute deviation of a normal distribution, in standard deviations."""

# Width of the running median that follows slow noise.
_AROUND = 11


def outliers_of(residual: Array, rounding: float = 0.0) -> BoolArray:
    """Find outliers among residuals by a Hampel filter [5]_, (n_samples,).

    They are further than `OUTLYING` from the median of the eleven residuals around, in standard
    deviations estimated from the median of all such distances. Where noise is not the same,
    residuals are over its standard deviation. A reading on the next step of rounding is no outlier.
    """
    apart = measure_distances(residual)
    # One residual in eleven is that median itself.
    others = apart[apart > 0]
    if not len(others):
        return np.zeros(len(residual), dtype=bool)
    scale = max(float(np.median(others)) / GAUSSIAN, rounding / ROOT_12)
    return apart > levels.OUTLYING * scale


def measure_distances(residual: Array) -> Array:
    """Measure how far residuals are from the median of the eleven around, (n_samples,)."""
    from scipy.ndimage import median_filter

    return np.abs(residual - median_filter(residual, _AROUND, mode="mirror"))


# Degrees of freedom of Student's t; logarithms of least and largest odds of the growing part.
_TAILS, _GROWTH_LEAST, _GROWTH_MOST = 4.0, -9.0, 20.0


def compute_growth(residual: Array, readings: Array, rounding: float = 0.0) -> Array:
    """Compute how the noise grows with the rotation of a fit, (n_samples,), from its residuals.

    Returns its standard deviation over its root mean square; ones if it does not grow. Distances
    below 1.5 steps of rounded readings are not told apart: how readings on a plateau scatter
    depends on where it lies between two steps.
    """
    apart = np.maximum(measure_distances(residual), 1.5 * rounding)
    size = np.abs(readings)
    constant = np.ptp(apart) == 0 or np.ptp(size) == 0
    if constant or significance_of_growth(apart, size) >= levels.FALSE_ALARM:
        return np.ones(len(residual))
    from scipy.optimize import minimize_scalar

    found = minimize_scalar(
        lambda odds: _deviance(apart, _growth(odds, size)), bounds=(_GROWTH_LEAST, _GROWTH_MOST)
    )
    return _growth(float(found.x), size)


def growth_left(residuals: Residuals, log_parameters: Array) -> Array:
    """Compute how the noise grows with a sample's response, from what it leaves of a trace."""
    left, response = residuals.left(log_parameters), residuals.response(log_parameters)
    return compute_growth(left, response, residuals.trace.rounding)


def compare_extremes(growth: Array) -> float:
    """Return how much larger noise is for the largest twentieth of readings than the smallest."""
    low, high = np.quantile(growth, (0.05, 0.95))
    return float(high / low)


def significance_of_growth(apart: Array, size: Array) -> float:
    """Return how likely distances rank so well with sizes by chance: Spearman's test, one-sided.

    As `scipy.stats.spearmanr`, but to import that takes a tenth of the time of a first trace.
    """
    from scipy.special import betainc

    correlation = np.corrcoef(_ranks(apart), _ranks(size))[0, 1]
    # Student's t of the correlation, as an incomplete beta function.
    tail = betainc(len(size) / 2 - 1, 0.5, max(0.0, 1 - correlation**2)) / 2
    return float(tail if correlation > 0 else 1 - tail)


def _ranks(values: Array) -> Array:
    """Return ranks, equal values with the mean of theirs."""
    _, place, count = np.unique(values, return_inverse=True, return_counts=True)
    return (np.cumsum(count) - (count - 1) / 2)[place]


def _growth(log_odds: float, size: Array) -> Array:
    share = 1 / (1 + np.exp(-log_odds))
    return np.sqrt(1 - share + share * size**2 / np.mean(size**2))


def _deviance(apart: Array, growth: Array) -> float:
    """Return minus Student's log-likelihood, with the scale that the median tells."""
    standard = apart / growth
    scale = np.median(standard[standard > 0]) / GAUSSIAN
    kernel = 0.5 * (_TAILS + 1) * np.log1p((standard / scale) ** 2 / _TAILS)
    return float(np.sum(np.log(growth * scale) + kernel))


@dataclass(frozen=True)
class NoiseModel:
    """Autocorrelation model of noise, by the shares of its components in the variance."""

    ar1: float
    """Share of an Ornstein-Uhlenbeck process, AR(1) at uniform sampling."""
    time_s: float
    """Its relaxation time."""
    flicker: float
    """Share of noise with spectrum 1/f."""
    proportional: float = 0.0
    """Share of white noise whose standard deviation is proportional to the reading, on average
    over the readings. The rest is white noise that is the same everywhere."""
    walk: float = 0.0
    """Share of a random walk that begins with the first reading, on average over the readings."""

    @property
    def white(self) -> float:
        """Share of white noise that is the same everywhere."""
        return 1 - self.ar1 - self.flicker - self.proportional - self.walk


WEIGHTED = NoiseModel(ar1=0.0, time_s=1.0, flicker=0.0, proportional=1.0)
"""Independent noise whose standard deviations are given."""


class Whitening:
    """Transforms autocorrelated into white noise of the same variance, and projects nuisance out.

    Sampling times, (n_samples,), ascend. Nuisance are functions that the instrument may have added
    with any amplitude, uncertain ones those with a random amplitude (`with_uncertain`),
    (n_functions, n_samples); growing is the standard deviation of the proportional part up to a
    factor, (n_samples,), required if there is one.
    """

    def __init__(
        self,
        time_s: Array,
        noise_model: NoiseModel,
        nuisance: Array,
        uncertain: Array | None = None,
        growing: Array | None = None,
    ) -> None:
        # Imported here, for loading celerite takes a tenth of a second.
        from celerite2 import driver

        flicker = flicker_rates(time_s)
        rates = np.concatenate(([1 / noise_model.time_s], flicker, [0.0]))
        of_flicker = np.full(len(flicker), noise_model.flicker / len(flicker))
        shares = np.concatenate(([noise_model.ar1], of_flicker, [noise_model.walk]))
        self._solve = driver.solve_lower
        walked = (time_s - time_s[0]) / np.mean(time_s - time_s[0])
        self._time_s, self._rates = np.ascontiguousarray(time_s, float), rates
        self._left = np.tile(shares, (len(time_s), 1))
        right = np.ones_like(self._left)
        right[:, -1] = walked
        # White noise keeps the matrix regular, however small its share.
        diagonal = 1.0 + noise_model.walk * (walked - 1)
        if growing is not None:
            diagonal += noise_model.proportional * (growing**2 / np.mean(growing**2) - 1)
        pivots, self._right = driver.factor(
            self._time_s, rates, diagonal, self._left, right, np.empty_like(diagonal), right.copy()
        )
        self._deviations = np.sqrt(pivots)
        self.log_determinant = float(np.sum(np.log(pivots)))
        """Logarithm of the determinant of the covariance matrix, over the mean variance."""
        if len(nuisance) or uncertain is not None:
            basis = np.linalg.qr(self._whitened(nuisance).T)[0].T
            known = nuisance[:0] if uncertain is None else self._whitened(uncertain)
            nuisance = with_uncertain(basis, known)
        self.nuisance = nuisance
        """Whitened functions that are projected out, (n_functions, n_samples)."""

    def __call__(self, rows: Array) -> Array:
        """Whiten functions of time, shape (..., n_samples), and project the nuisance out."""
        return without(self.nuisance, self._whitened(rows))

    def _whitened(self, rows: Array) -> Array:
        columns = np.ascontiguousarray(rows.reshape(-1, rows.shape[-1]).T)
        solved = self._solve(
            self._time_s, self._rates, self._left, self._right, columns, np.empty_like(columns)
        )
        return (solved / self._deviations[:, None]).T.reshape(rows.shape)


class PairWhitening:
    """Turns noise of both moduli of a sweep, correlated at each frequency, into white noise.

    It is C^(-1/2) of the covariance C of each pair, which keeps the moduli apart as far as it can.
    Places and standard deviations are (n_samples,), the correlation is (n_frequencies,).
    """

    def __init__(self, places: Array, sd: Array, correlation: Array) -> None:
        self._places, (first, second) = places, moduli_of(sd, places)
        shared = correlation * first * second
        root = first * second * np.sqrt(1 - correlation**2)
        size = np.sqrt(np.mean(sd**2)) / (root * np.sqrt(first**2 + second**2 + 2 * root))
        # (C + sqrt(det C)) / sqrt(tr C + 2 sqrt(det C)) is the root of C, and this its inverse.
        self._parts = size * np.array([[second**2 + root, -shared], [-shared, first**2 + root]])
        self.nuisance = np.zeros((0, len(sd)))
        """None."""

    def __call__(self, rows: Array) -> Array:
        """Whiten rows of a sweep, (..., n_samples); the variance stays the same on average."""
        moduli = moduli_of(rows, self._places)
        return places_of(np.einsum("ijn,...jn->...in", self._parts, moduli), self._places)


def whitened_rows(
    course: Course,
    time_s: Array,
    nuisance: Array,
    noise: NoiseModel | None = None,
    uncertain: Array | None = None,
    growing: Array | None = None,
    correlation: Array | None = None,
) -> Condensed:
    """Condense the readings of a trace to rows in white noise, without nuisance.

    Parameters
    ----------
    course
        The protocol.
    time_s : (n_samples,)
        Ascending times.
    nuisance, uncertain : (n_functions, n_samples)
        Functions of any amplitude, and of a random one, over the noise (`with_uncertain`).
    noise
        Its model; without one it is white.
    growing : (n_samples,)
        Standard deviation of the proportional part of the noise up to a factor.
    correlation : (n_frequencies,)
        Of the noise of both moduli of a sweep, whose standard deviations are `growing`.
    """
    rows = SweptRows if course.sweeps else Condensed
    uncertain = nuisance[:0] if uncertain is None else uncertain
    given = course, course.snapped(time_s)
    if correlation is not None and growing is not None:
        return rows(*given, nuisance[:0], PairWhitening(time_s, growing, correlation))
    if noise is None:
        return rows(*given, with_uncertain(nuisance, uncertain))
    return rows(*given, nuisance[:0], Whitening(time_s, noise, nuisance, uncertain, growing))


# Bounds of the logarithm of a component's share over that of white noise: from none to all.
_LEAST, _MOST = -9.0, 7.0
# The likelihood has several maxima. Grid of log odds, and of places between the shortest and the
# longest time; starts are the best points with more ar1, more 1/f noise, or more of a walk.
_ODDS, _PLACES = (_LEAST, -4.0, -1.0, 2.0, 6.0), (0.15, 0.35, 0.6, 0.85)
# Of white noise, the logarithm of odds of a part that grows with the rotation; starts, bounds.
_GROWING, _ALL_GROWS = (0.0, 5.0, 10.0), (_LEAST, 20.0)
_STEP, _CONVERGED = 1e-4, 1e-9
# Step of finite differences.
_APART = 0.1
# Prior standard deviation of the logarithms of odds and time, in e-folds.
_KNOWN = 3.0
# Logarithm of a random walk's variance over that without its mean.
_BESIDE_ITS_MEAN = np.log(3.0)
# Less freedom than this hardly lowers the share of limits that hold.
_LEAST_FREEDOM = 3.0


class NoiseModelLikelihood:
    """Restricted likelihood of noise models, given the residuals of a fit, (n_samples,).

    Directions, (n_directions, n_samples), are what the fit absorbs: derivatives by the parameters,
    and nuisance functions. A part of the white noise may grow with a rotation, (n_samples,).
    """

    def __init__(
        self, time_s: Array, residual: Array, directions: Array, growing: Array | None = None
    ) -> None:
        self._time_s, self._residual, self._growing = time_s, residual, growing
        self._reached = absorbed(directions)
        shortest, longest = float(np.diff(time_s).min()), float(time_s[-1] - time_s[0])
        times = float(np.log(shortest / 2)), float(np.log(longest))
        self._bounds = [(_LEAST, _MOST), times, (_LEAST, _MOST), (_LEAST, _MOST)]
        self._bounds += [_ALL_GROWS] if growing is not None else []

    def best(self, near: NoiseModel | None = None) -> NoiseModel:
        """Return the noise model of highest likelihood, starting from `near` if it is given."""
        from scipy.optimize import minimize

        starts = [_logarithms(near)] if near is not None else self._best_of_each()
        found = [
            minimize(
                self._deviance,
                np.clip(start, *np.transpose(self._bounds)),
                method="L-BFGS-B",
                bounds=self._bounds,
                options={"eps": _STEP, "ftol": _CONVERGED},
            )
            for start in starts
        ]
        return _noise_model(min(found, key=lambda each: float(each.fun)).x)

    def freedom(self, noise_model: NoiseModel, sensitivity: Array, nuisance: Array) -> float:
        """Compute the degrees of freedom of the least known variance of a parameter.

        They are those of a chi-squared variable whose relative spread is that of the variance,
        given the uncertainty of the noise model of highest likelihood (Satterthwaite [6]_).
        Derivatives by the log-parameters, (n_parameters, n_samples), are over the noise's standard
        deviation.
        """

        def variances(x: Array) -> Array:
            white = self._whitening(x, nuisance)(sensitivity)
            # Every parameter has a prior standard deviation of 1, as in `Likelihood.deviation`.
            inverse = np.linalg.inv(white @ white.T + np.eye(len(white)))
            return np.log(np.diagonal(inverse)) + float(np.log(self._parts(x)[0] / self._free))

        x = _logarithms(noise_model)
        steps = _APART * np.eye(len(x))
        slopes = np.array([variances(x + step) - variances(x - step) for step in steps])
        slopes /= 2 * _APART
        spread = np.einsum("iq,iq->q", slopes, np.linalg.solve(self._information(x), slopes))
        return max(float(2 / max(spread.max(), 1e-12)), _LEAST_FREEDOM)

    def errors(self, noise_model: NoiseModel) -> tuple[float, float]:
        """Compute standard deviations of logarithms: of the correlation time, and of walk odds."""
        information = self._information(_logarithms(noise_model))
        _, of_time, _, of_walk, *_ = np.sqrt(np.diagonal(np.linalg.inv(information))).tolist()
        return of_time, of_walk

    def _information(self, x: Array) -> Array:
        """Return half the Hessian of the deviance, plus the precision of the prior."""
        steps = _APART * np.eye(len(x))
        middle = self._deviance(x)
        ahead, behind = ([self._deviance(x + sign * s) for s in steps] for sign in (1, -1))
        curvature = np.diag(np.add(ahead, behind) - 2 * middle)
        for i, one in enumerate(steps):
            for j, other in enumerate(steps[:i]):
                both = self._deviance(x + one + other) + self._deviance(x - one - other)
                mixed = (both + 2 * middle - ahead[i] - ahead[j] - behind[i] - behind[j]) / 2
                curvature[i, j] = curvature[j, i] = mixed
        sizes, axes = np.linalg.eigh(curvature / (2 * _APART**2))
        return (axes * np.maximum(sizes, 0)) @ axes.T + np.eye(len(x)) / _KNOWN**2

    def _deviance(self, x: Array) -> float:
        free, (left, of_reached, determinant) = self._free, self._parts(x)
        prior = float(np.logaddexp(x[2], x[3] - _BESIDE_ITS_MEAN))
        return free * float(np.log(left)) + determinant + of_reached - prior

    @property
    def _free(self) -> int:
        return len(self._time_s) - len(self._reached)

    def _parts(self, x: Array) -> tuple[float, float, float]:
        """Return a sum of squares, and log determinants of absorbed directions and of all noise."""
        whitening = self._whitening(x, np.zeros((0, len(self._time_s))))
        white = whitening(np.vstack((self._reached, self._residual)))
        basis, triangle = np.linalg.qr(white[:-1].T)
        left = white[-1] - basis @ (basis.T @ white[-1])
        of_reached = 2 * float(np.sum(np.log(np.abs(np.diagonal(triangle)))))
        return float(left @ left), of_reached, whitening.log_determinant

    def _whitening(self, x: Array, nuisance: Array) -> Whitening:
        return Whitening(self._time_s, _noise_model(x), nuisance, growing=self._growing)

    def _best_of_each(self) -> list[Array]:
        """Return the best points of a grid with more ar1, more 1/f noise, and a random walk."""
        shortest, longest = self._bounds[1]
        tried = [
            np.array([ar1, shortest + place * (longest - shortest), *slow, *growing])
            for ar1 in _ODDS
            for place in (_PLACES if ar1 > _LEAST else _PLACES[:1])
            for slow in [
                *((odds, _LEAST) for odds in _ODDS),
                *((_LEAST, odds) for odds in _ODDS[1:]),
            ]
            for growing in ([()] if self._growing is None else [(odds,) for odds in _GROWING])
        ]
        largest = [int(np.argmax((x[2], x[0], x[3]))) for x in tried]
        sides = [[x for x, own in zip(tried, largest, strict=True) if own == it] for it in range(3)]
        return [min(side, key=self._deviance) for side in sides]


def _logarithms(noise_model: NoiseModel) -> Array:
    independent = noise_model.white + noise_model.proportional
    odds = np.log(np.array([noise_model.ar1, noise_model.flicker, noise_model.walk]) / independent)
    logarithms = [odds[0], np.log(noise_model.time_s), odds[1], odds[2]]
    if noise_model.proportional:
        logarithms.append(np.log(noise_model.proportional / noise_model.white))
    return np.array(logarithms)


def _noise_model(x: Array) -> NoiseModel:
    """Return the noise model of log odds and the logarithm of a time."""
    odds = np.exp(x[[0, 2, 3]])
    ar1, flicker, walk = (odds / (1 + odds.sum())).tolist()
    growing = 1 / (1 + np.exp(-x[4])) / (1 + odds.sum()) if len(x) > 4 else 0.0
    return NoiseModel(ar1, float(np.exp(x[1])), flicker, float(growing), walk)


def absorbed(directions: Array) -> Array:
    """Return orthonormal rows with the span of what a fit absorbs, without rounding errors."""
    sizes = np.linalg.norm(directions, axis=1)
    rows = directions[sizes > 0] / sizes[sizes > 0, None]
    _, shares, basis = np.linalg.svd(rows, full_matrices=False)
    return basis[shares > 1e-8]
