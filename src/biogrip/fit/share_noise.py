"""Noise that is a share of what is read, of a course in time or of a frequency sweep.

A share is of the smooth course that is nearest (`fit_responses`): weights that followed the noise
of each reading would favour readings that are too low by chance.

A rheometer measures an amplitude and a phase: with the share a of the one and the error p of the
other, in rad, the variance of the loss modulus G'' is (a G'')^2 + (p G')^2, that of the storage
modulus G' (a G')^2 + (p G'')^2, and their covariance (a^2 - p^2) G' G''. Other sweeps have an error
of each modulus that is a share of itself. Either has two components of one size each, which are
read off how they scatter about the linear sample that is nearest; shares of each modulus are taken
if they are clearly likelier.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

import biogrip.levels as levels
from biogrip.arrays import Array, BoolArray
from biogrip.digits import plain
from biogrip.fit.any_sample import RATES_A_DECADE, count_lags, fit_responses, spread_lags
from biogrip.fit.experiment import Experiment
from biogrip.fit.trace_noise import absorbed
from biogrip.physics.modes import lag_course
from biogrip.physics.noise import moduli_of, places_of
from biogrip.physics.protocol import SWEEP, is_storage

# Lags a decade that smooth a course, and that of what does not relax.
_A_DECADE, _LASTING = 4, 1e6
# The same beyond the frequencies of a sweep.
_WIDER = 100.0
# Squares of second differences over their median that are of outliers.
_OUTLYING = 36.0
# What is smooth, and the weights, are found in turn.
_ROUNDS, _SWEPT_ROUNDS = 4, 5
# Share of the readings whose scatter bounds the noise from below, and fewest of them.
_SMALL, _FEWEST = 0.1, 5
# Their scatter over that of the share, beyond which there is other noise: chi-squared with five
# degrees of freedom exceeds it once in a thousand times.
_EXCESS = 2.03
# Least noise over the largest reading, and least size: rounding errors of single precision.
_ROUNDING = 1e-7
# Fewest degrees of freedom with which each component has its own size.
_FEWEST_FREE = 12
# Sizes from which on a reading does not count for the smooth moduli.
_FAR_OUT = 6.0
# Least size over the other, and least loss over the whole modulus: what is less is rounding.
_LEAST_SIZES = 1e-2, 1e-6
# Scatter of neighbours over the root mean square below which that is misfit of any linear sample.
_SHARED = 0.6
# Degrees of freedom of Student's distribution, which spares outliers.
_STUDENT, _SCALINGS = 3.0, 20


def proportional_deviations(problem: Experiment, time_s: Array, readings: Array) -> Array:
    """Compute standard deviations of readings in proportion to the smooth rotation, (n_samples,).

    The problem has that share, and the standard deviation of further noise. If it is not known, no
    deviation is less than that of the median of the smallest readings, nor than they scatter: of a
    rotation of zero, no instrument is certain. Times ascend, (n_samples,).
    """
    share, noise_sd = problem.noise_share or 0.0, problem.noise_sd
    nuisance = problem.nuisance(time_s)
    lags = [*spread_lags(problem.torque, time_s, _A_DECADE), _LASTING]
    family = lag_course(problem.torque, lags, time_s)
    functions = np.vstack((family, nuisance, -nuisance))
    deviations = np.full(len(time_s), share * np.max(np.abs(readings)))
    for _ in range(_ROUNDS):
        amplitudes, _ = fit_responses(readings / deviations, functions / deviations)
        smooth, rest = amplitudes[: len(family)] @ family, readings - amplitudes @ functions
        deviations = share * np.abs(smooth)
        if noise_sd is not None:
            deviations = np.hypot(deviations, noise_sd)
        else:
            deviations = np.maximum(deviations, _least(np.abs(smooth), rest, share))
    return np.maximum(deviations, _ROUNDING * float(np.max(np.abs(readings))))


def _least(sizes: Array, rest: Array, share: float) -> float:
    """Return the least standard deviation, from the smallest readings."""
    few = max(_FEWEST, int(_SMALL * len(sizes)))
    smallest = np.argsort(sizes, kind="stable")[:few]
    scatter, size = (np.sqrt(np.mean(own[smallest] ** 2)) for own in (rest, sizes))
    if scatter <= _EXCESS * share * size:
        return share * float(np.median(sizes[smallest]))
    return float(scatter)


@dataclass(frozen=True, eq=False)
class SweptNoise:
    """Noise of a sweep's readings."""

    sd: Array
    """Standard deviations of the readings, (n_samples,)."""
    correlation: Array | None
    """Of both moduli at each frequency, ascending, (n_frequencies,); None if they have none."""
    words: str
    """Sizes in words."""


def estimate_swept_noise(
    places: Array, readings: Array, sizes: Sequence[float] | None = None, more: float = 0.0
) -> SweptNoise:
    """Estimate the noise of a sweep from its scatter; `more` is added to it, squared.

    Sizes, if they are known, are the share of each modulus or, if there are two, that of the
    amplitude and the error of the phase in rad. Places and readings, (n_samples,), are of both
    moduli or of one.
    """
    if sizes is not None:
        return _noise_about(_Smooth(places, readings, len(sizes) > 1, sizes), more)
    both = len({*is_storage(places).tolist()}) > 1
    tried = [_Smooth(places, readings, polar, None) for polar in (True, False)[not both :]]
    few = [smooth for smooth in tried if smooth.free < max(_FEWEST_FREE, len(readings) / 2)]
    odds = {
        smooth: smooth.deviance - levels.LIKELIER * smooth.polar for smooth in few[-1:] or tried
    }
    return _noise_about(min(odds, key=lambda smooth: odds[smooth]), more)


class _Smooth:
    """The linear sample nearest to moduli whose errors have components of one size each."""

    def __init__(
        self, places: Array, readings: Array, polar: bool, sizes: Sequence[float] | None
    ) -> None:
        self.places, self.polar = places, polar
        family = moduli_of(lag_course(SWEEP, _spread_swept_lags(places), places), places)
        read = moduli_of(readings, places)
        whole = np.broadcast_to(np.linalg.norm(read, axis=0), read.shape)
        parts = np.einsum("ij,jn->ijn", np.eye(len(read)), 1 / whole)
        weights = np.ones_like(read)
        for _ in range(_SWEPT_ROUNDS):
            rows = np.einsum("ijn,...jn->...in", parts, np.append(family, read[None], axis=0))
            rows = (weights * rows).reshape(len(rows), -1)
            amplitudes, _ = fit_responses(rows[-1], rows[:-1])
            taken = np.sum(absorbed(rows[:-1][amplitudes > 0]) ** 2, axis=0).reshape(read.shape)
            self.moduli = np.tensordot(amplitudes, family, 1)
            self.free = len(readings) - 2 * count_lags(amplitudes > 0)
            self.parts = parts = _components(self.moduli, polar)
            self.apart = np.einsum("ijn,jn->in", parts, read - self.moduli)
            self.sizes = self._sizes(read, taken, weights > 0, sizes)[:, None]
            weights = (np.abs(self.apart) < _FAR_OUT * self.sizes) / self.sizes

    def _sizes(
        self, read: Array, taken: Array, used: BoolArray, known: Sequence[float] | None
    ) -> Array:
        """Return sizes of the components, of which a fit has taken some degrees of freedom."""
        squares, scatter = used * self.apart**2, np.array([*map(_scatter_of, self.apart)])
        if known is not None:
            return np.resize(known, len(read))
        if self.free >= max(_FEWEST_FREE, read.size / 2):
            sizes = np.sqrt(np.sum(squares, axis=1) / np.sum(used - taken, axis=1))
            # What neighbours do not share is no noise.
            sizes = np.where(scatter < _SHARED * sizes, scatter, sizes)
        elif self.free > 0:
            sizes = np.full(len(read), np.sqrt(np.sum(self.apart**2) / self.free))
        else:
            # A smooth one takes all of a few, which scatter about lines on logarithmic axes.
            logs = np.log(np.maximum(read, np.finfo(float).tiny))
            sizes = np.full(len(read), np.sqrt(np.mean([_scatter_of(row) ** 2 for row in logs])))
        return np.maximum(sizes, max(_LEAST_SIZES[0] * float(sizes.max()), _ROUNDING))

    @property
    def deviance(self) -> float:
        """Deviance of second differences by Student's distribution."""
        total = -float(np.sum(np.log(np.abs(np.linalg.det(self.parts.T)))))
        for row in np.diff(self.apart, 2):
            square, least = float(np.median(row**2)), np.finfo(float).tiny
            for _ in range(_SCALINGS):
                weights = (_STUDENT + 1) / (_STUDENT + row**2 / max(square, least))
                square = max(float(np.mean(weights * row**2)), least)
            tails = np.mean(np.log1p(row**2 / (_STUDENT * square)))
            total += self.apart.shape[1] * float(
                0.5 * np.log(square) + 0.5 * (_STUDENT + 1) * tails
            )
        return total


def _components(moduli: Array, polar: bool) -> Array:
    """Return what makes components of errors of moduli, (n_parts, n_moduli, n_frequencies)."""
    least = _LEAST_SIZES[1] * np.linalg.norm(moduli, axis=0)
    moduli = np.maximum(moduli, np.maximum(least, np.finfo(float).tiny))
    if not polar:
        return np.einsum("ij,jn->ijn", np.eye(len(moduli)), 1 / moduli)
    storage, loss = moduli / np.sum(moduli**2, axis=0)
    return np.array([[storage, loss], [-loss, storage]])


def _noise_about(smooth: _Smooth, more: float) -> SweptNoise:
    """Return the covariance of moduli whose errors have these components."""
    back = np.linalg.inv(smooth.parts.T).transpose(0, 2, 1) * smooth.sizes[:, 0]
    covariance = back @ back.transpose(0, 2, 1) + more**2 * np.eye(len(smooth.moduli))
    sd = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2)).T
    correlation = covariance[:, 0, -1] / (sd[0] * sd[-1]) if smooth.polar else None
    return SweptNoise(places_of(sd, smooth.places), correlation, _sizes_in_words(smooth))


def _sizes_in_words(smooth: _Smooth) -> str:
    percents = [f"{plain(100 * size, 2)} %" for size in smooth.sizes[:, 0]]
    if smooth.polar:
        return (
            f"{percents[0]} of the amplitude and {plain(np.degrees(smooth.sizes[1, 0]), 2)} degrees"
        )
    stored = is_storage(smooth.places)
    names = ["storage"] * bool(stored.any()) + ["loss"] * bool((~stored).any())
    pairs = zip(percents, names, strict=True)
    return " and ".join(f"{percent} of the {name} modulus" for percent, name in pairs)


def _spread_swept_lags(places: Array) -> list[float]:
    """Return lags in s that span any linear sample at places of a sweep, see `Sweep`."""
    shortest_s, longest_s = SWEEP.spread_s(places)
    count = int(RATES_A_DECADE * np.log10(_WIDER**2 * longest_s / shortest_s))
    lags_s = np.geomspace(shortest_s / _WIDER, longest_s * _WIDER, count).tolist()
    return [*lags_s, _LASTING * longest_s]


def _scatter_of(values: Array) -> float:
    """Return the standard deviation of values by differences of neighbours, without outliers."""
    squares = np.diff(values, min(len(values) - 1, 2)) ** 2
    usual = squares[squares <= _OUTLYING * np.median(squares)]
    return max(float(np.sqrt(np.mean(usual) / 6)), _ROUNDING)
