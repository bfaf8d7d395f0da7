"""What an instrument may read of any linear sample, by which a trace is judged without a model.

A linear passive sample relaxes by a sum of non-negative exponentials [1]_, and yields to a load by
what these have lost; so do a gripper's arms with such a sample between them. What is read is a
non-negative combination of loads that lag behind (`lag_course`), fitted by non-negative least
squares [2]_.

References
----------
.. [1] S. Bernstein, Sur les fonctions absolument monotones, Acta Mathematica 52 (1929), 1-66.
.. [2] C. L. Lawson and R. J. Hanson, Solving Least Squares Problems, Prentice-Hall, 1974, ch. 23.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from biogrip.arrays import Array, BoolArray
from biogrip.fit.trace_noise import absorbed
from biogrip.physics.protocol import Course
from biogrip.physics.residuals import Residuals
from biogrip.physics.response import Modes

# Lags: shortest over the time between the closest readings, longest over the protocol.
_SHORTEST, _LONGEST = 0.01, 10.0
# Rates a decade, and the fastest but one times the first time.
RATES_A_DECADE, _FASTEST = 8, 20.0
# The slowest times the last time: a line in time to so much.
_SLOWEST = 1e-8
# Places at which an interval of rates is divided; how often at most, and decrease of chi^2 that
# ends it.
_DIVIDED, _MOST_DIVISIONS, _SETTLED = np.array([[0.2], [0.4], [0.6], [0.8]]), 6, 0.01
# Difference of logarithms of rates that are close.
_CLOSE = 0.06
# Shares of the clearest response below which one is rounding errors, and hardly shows; size of a
# row that is zero.
_UNSEEN, _FAINT, _NOTHING = 1e-9, 1e-3, 1e-100


@dataclass(frozen=True, eq=False)
class Lags:
    """Lags that a load may have, and what a trace would show of each."""

    residuals: Residuals
    """The trace, the protocol and the noise; their model is not used."""
    covered_s: tuple[float, float]
    """From when to when after a change of what is controlled there are readings."""
    rates: Array
    """In 1/s, ascending, (n_rates,)."""
    rows: Array
    """Condensed rows, of norm one or, where a lag does not show, zero, (n_rates, n_rows)."""
    sizes: Array
    """Norms of rows of unit amplitude over the noise scale, (n_rates,)."""
    faint: BoolArray
    """True for lags that hardly show, (n_rates,)."""

    def _beside(self, chosen: BoolArray) -> tuple[Array, BoolArray]:
        """Return places of the rates, and the intervals next to lags that are chosen.

        The last interval is none: of lags so fast no reading tells which it is, rounding would.
        """
        beside = chosen[1:] | chosen[:-1]
        beside[-1] = False
        return np.log1p(self.covered_s[1] * self.rates), beside

    def are_close(self, chosen: BoolArray) -> bool:
        """Return True if lags next to chosen ones, (n_rates,), are close, but the fastest two."""
        places, beside = self._beside(chosen)
        return bool(np.max(np.diff(places), where=beside, initial=0.0) < _CLOSE)

    def divided(self, chosen: BoolArray) -> "Lags":
        """Return the grid with closer lags on either side of those that are chosen, (n_rates,)."""
        places, beside = self._beside(chosen)
        more = places[:-1][beside] + _DIVIDED * np.diff(places)[beside]
        near = self.rates[np.append(beside, False) | np.append(False, beside)]
        rates = np.concatenate((near, np.expm1(more.ravel()) / self.covered_s[1]))
        return show_lags(self.residuals, self.covered_s, rates)


def show_lags(residuals: Residuals, covered_s: tuple[float, float], more: Array) -> Lags:
    """Compute what a trace would show of a grid of lags, and of more rates in 1/s, (n_more,)."""
    rates = np.unique(np.append(spread_rates(*covered_s), more))
    if deforms := residuals.course.deforms:
        # What does not relax has no part in what is lost.
        rates[0] = 0.0
    places = covered_s[1] * rates
    sign, none = np.full((len(rates), 1), 1.0 if deforms else -1.0), np.zeros((len(rates), 0, 1))
    rows = residuals.trace.condensed.of_modes(Modes(-rates[:, None], sign, none, none))[:, 0]
    rows /= residuals.noise_scale
    sizes = np.maximum(np.linalg.norm(rows, axis=1), _NOTHING)
    # A slow lag yields in proportion to its rate, and a fast one resists in inverse proportion.
    fast = covered_s[0] * rates if residuals.parts else places
    clear = sizes * (1 + (fast if deforms else 1 / places))
    clear /= clear.max()
    rows[clear < _UNSEEN] = 0.0
    return Lags(residuals, covered_s, rates, rows / sizes[:, None], sizes, clear < _FAINT)


@dataclass(frozen=True, eq=False)
class AnySampleFit:
    """The linear sample that fits a trace best."""

    lags: Lags
    """Lags that it may have."""
    measured: Array
    """Rows of the trace over the noise scale, (n_rows,)."""
    amplitudes: Array
    """Amplitudes of rows of the lags, none below zero, (n_rates,)."""

    @property
    def taken(self) -> int:
        """Degrees of freedom that it takes: a time and an amplitude each, an end's time none."""
        own = self.amplitudes > 0
        return 2 * count_lags(own) - int(own[0]) - int(own[-1])

    @cached_property
    def left(self) -> Array:
        """What they leave of the trace's rows, (n_rows,)."""
        return self.measured - self.amplitudes @ self.lags.rows

    @property
    def free(self) -> int:
        """Degrees of freedom of what it leaves."""
        return max(self.lags.residuals.free - self.taken, 1)

    @property
    def sd(self) -> float:
        """Standard deviation of the noise that this would be."""
        scale = self.lags.residuals.noise_scale
        return float(np.linalg.norm(self.left)) * scale / float(np.sqrt(self.free))

    @property
    def misfit(self) -> float:
        """RMS misfit."""
        return self.sd * float(np.sqrt(self.free / self.lags.residuals.samples))

    def left_of_readings(self) -> tuple[Array, Array]:
        """Return what it leaves of the readings, (n_samples,), and a basis of what it absorbs."""
        trace, own = self.lags.residuals.trace, self.amplitudes > 0
        shown = trace.condensed.cleared(self._shown(self.lags.residuals))
        residual: Array = trace.cleared - self.amplitudes[own] @ shown
        return residual, absorbed(np.vstack((shown, trace.condensed.taken)))

    def response(self, residuals: Residuals) -> Array:
        """Return what it shows, (n_samples,), under the protocol and at the times of residuals."""
        return self.amplitudes[self.amplitudes > 0] @ self._shown(residuals)

    def _shown(self, residuals: Residuals) -> Array:
        """Return the same of unit amplitudes of the lags that it has, (n, n_samples)."""
        own = self.amplitudes > 0
        return residuals.of_lags(self.lags.rates[own]) * (1 / self.lags.sizes[own, None])


def count_lags(chosen: BoolArray) -> int:
    """Count lags that are chosen, (n_rates,); neighbours are one between them."""
    return int(np.sum(chosen[1:] & ~chosen[:-1]) + chosen[0])


def fit_any_sample(residuals: Residuals) -> AnySampleFit:
    """Fit any linear sample to a trace; the model of its residuals is not used.

    The grid of rates is divided next to those that are needed until that changes the fit no more.
    """
    # Imported here: loading it takes longer than a short job.
    from scipy.optimize import nnls

    covered_s = residuals.covered_s
    measured = residuals.trace.rows / residuals.noise_scale
    lags, least = show_lags(residuals, covered_s, np.zeros(0)), np.inf
    for _ in range(_MOST_DIVISIONS):
        amplitudes, norm = nnls(lags.rows.T, measured, maxiter=100 * len(lags.rates))
        fit = AnySampleFit(lags, measured, amplitudes)
        if least - norm**2 < _SETTLED:
            break
        lags, least = lags.divided(amplitudes > 0), norm**2
    return fit


def spread_rates(first_s: float, last_s: float) -> Array:
    """Return rates of lags in 1/s, ascending, for readings from a first time to a last one.

    On the scale log(1 + r `last_s`) they are even, so many a decade. The slowest lag is a line in
    time, the fastest a bare spring or damper. There is one on either side of 1/`first_s`.
    """
    spacing = np.log(10) / RATES_A_DECADE
    places = np.arange(0.0, np.log1p(_FASTEST * last_s / first_s) / spacing) * spacing
    inner, middle = np.expm1(places[places > 0]) / last_s, 1 / first_s
    ends = _SLOWEST / last_s, _FASTEST / first_s, 1e6 / first_s
    return np.unique(np.concatenate((ends, inner, [middle, middle * (1 + 1e-9)])))


def spread_lags(course: Course, time_s: Array, a_decade: int) -> list[float]:
    """Return lags over a protocol, see `lag_course`, so many a decade, for ascending times."""
    shortest = _SHORTEST * float(np.diff(time_s).min()) / course.end_s
    count = 2 + int(a_decade * np.log10(_LONGEST / shortest))
    return np.geomspace(shortest, _LONGEST, count).tolist()


def fit_responses(trace: Array, responses: Array) -> tuple[Array, float]:
    """Fit amplitudes >= 0 of responses, (n, n_rows), to a trace; return the square sum, too."""
    from scipy.optimize import nnls

    # As many rows as functions have the same inner products.
    rows = np.asarray(np.linalg.qr(np.vstack((responses, trace)).T, mode="r"))
    sizes = np.linalg.norm(responses, axis=1)
    sizes[sizes == 0] = 1.0
    amplitudes, norm = nnls(rows[:, :-1] / sizes, rows[:, -1])
    return amplitudes / sizes, float(norm**2)
