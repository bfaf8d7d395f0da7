"""Notes on a fit, their weights, and the tests of its residuals that give reasons for them.

The heaviest note decides the status of a fit: ok, doubtful or rejected (`compute_status`).
Residuals are tested for white noise, each test at the level `FALSE_ALARM`: correlation of
neighbours, else the cumulative periodogram; means over stretches; number of outliers. Noise that
grows with the rotation is told first, and the other tests are of what it leaves. A noise model
may itself be misfit (`find_slow_misfit`): if it is correlated for too long. A misfit may be noise
(`has_fast_noise`, `has_uneven_noise`): if it is correlated for a short time, or if the noise
differs from one part of the trace to another.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from biogrip.arrays import Array
from biogrip.digits import counted
from biogrip.fit.noise_model_fit import FAR, NoiseModelLikelihood, outliers_of
from biogrip.physics.instruments import Instrument
from biogrip.physics.residuals import Residuals
from biogrip.physics.whitening import MOST_SAMPLES, NoiseModel, estimate_noise

HARMLESS, DOUBT, REJECTION = "harmless", "doubt", "rejection"
"""Weights of a note, in ascending order."""

OK, DOUBTFUL, REJECTED = "ok", "doubtful", "rejected"
"""Status of a fit by the heaviest of its notes."""

_STATUS = {HARMLESS: OK, DOUBT: DOUBTFUL, REJECTION: REJECTED}
_WEIGHTS = tuple(_STATUS)


@dataclass(frozen=True)
class Note:
    """A sentence about a fit, with its weight."""

    weight: str
    """`HARMLESS`: the results hold. `DOUBT`: they may not. `REJECTION`: they do not."""
    text: str
    """The sentence."""


def compute_status(notes: Sequence[Note]) -> str:
    """Return the status of a fit by the heaviest of its notes."""
    weights = {note.weight for note in notes}
    return _STATUS[max(weights, key=_WEIGHTS.index, default=HARMLESS)]


def order_notes(notes: Sequence[Note]) -> list[Note]:
    """Order notes by descending weight, and else as given."""
    return sorted(notes, key=lambda note: -_WEIGHTS.index(note.weight))


def find_reasons(notes: Sequence[Note]) -> list[str]:
    """Return the texts of the notes that decide a status which is not ok."""
    status = compute_status(notes)
    return [note.text for note in notes if _STATUS[note.weight] == status != OK]


FALSE_ALARM = 0.003
"""Significance level of each test: share of traces with white noise that fail it."""

# Largest correlation of neighbouring residuals, in standard deviations of that of white noise.
_CORRELATED = 5.0
# Stretches over which residuals are averaged, and readings in the shortest.
_STRETCHES, _SHORTEST = 20, 5


def doubts_about_noise(
    residual: Array, growth: Array, instrument: Instrument, rounding_rad: float = 0.0
) -> Iterator[str]:
    """Yield a sentence for each test of white noise that the residuals of a fit fail.

    Parameters
    ----------
    residual, growth : (n_samples,)
        Residuals of the fit, and growth of the noise with the rotation, see `compute_growth`.
    instrument
        The instrument, for its words.
    rounding_rad
        Step of the readings.
    """
    from scipy.special import ndtr, pdtrc

    read, wrong = instrument.read.name, instrument.suspects()
    many = f"{read}s" if instrument.has_jaws else "readings"
    if np.ptp(growth):
        low, high = np.quantile(growth, (0.05, 0.95))
        yield (
            f"The noise grows with the {read}: it is {high / low:.2g} times as large for the "
            f"largest tenth of the {many} as for the smallest, and neither the weights of the "
            "readings nor the intervals allow for that."
        )
        residual = residual / growth
    correlation = float(np.dot(residual[1:], residual[:-1]) / np.dot(residual, residual))
    chance = uneven(residual)
    if abs(correlation) > _CORRELATED / np.sqrt(len(residual)):
        yield (
            f"Neighbouring residuals are correlated ({correlation:.2f}; white noise would give "
            f"0 ± {1 / np.sqrt(len(residual)):.2f}): the intervals are too narrow, or {wrong} "
            "is not the right one."
        )
    elif chance < FALSE_ALARM:
        yield (
            "The residual has more of some frequencies than of others, as white noise has only "
            f"{one_in(chance)} traces: the intervals are wrong, or {wrong} is."
        )
    chance = wandering(residual)
    if chance < FALSE_ALARM:
        yield (
            "The residual wanders: its means over stretches of the trace scatter as much as those "
            f"of white noise do only {one_in(chance)} traces. It contains something slow that the "
            "model lacks, perhaps a drift of the instrument: the intervals are too narrow."
        )
    far = int(np.count_nonzero(outliers_of(residual, rounding_rad)))
    # Poisson's distribution of their number in Gaussian noise.
    chance = float(pdtrc(far - 1, 2 * len(residual) * ndtr(-FAR))) if far else 1.0
    if chance < FALSE_ALARM:
        yield (
            f"Beyond {FAR:g} standard deviations from the samples around: "
            f"{counted(far, 'outlier')}, as of Gaussian noise only {one_in(chance)} traces. "
            "Outliers distort the fit."
        )


def one_in(chance: float) -> str:
    """Return a probability in words, e.g. ``"once in 2e+03"``."""
    return f"once in {1 / max(chance, 1e-300):.1g}"


def wandering(residual: Array) -> float:
    """Return the p-value of a chi-squared test of means over stretches of white noise.

    The statistic is the sum of n_i m_i^2 / sigma^2 over stretches of n_i readings and mean
    m_i, with a degree of freedom each; a fit only lowers it. The test detects parts of the
    spectrum below some ten periods a trace, however small they are beside single readings' noise.
    """
    from scipy.special import chdtrc

    stretches = min(_STRETCHES, len(residual) // _SHORTEST)
    if stretches < 2:
        return 1.0
    parts = np.array_split(residual, stretches)
    scatter = sum(len(part) * float(np.mean(part)) ** 2 for part in parts)
    return float(chdtrc(stretches, scatter / float(np.mean(np.square(residual)))))


def uneven(residual: Array) -> float:
    """Return the p-value of the cumulative periodogram test of white noise [1]_.

    The statistic is the largest distance between the cumulative periodogram and a straight
    line, with Kolmogorov's distribution. The test detects noise with a correlation time of some
    readings and too small a share to correlate neighbours.

    References
    ----------
    .. [1] J. Durbin, Tests for serial correlation in regression analysis based on the periodogram
       of least-squares residuals, Biometrika 56 (1969), 1-15.
    """
    from scipy.fft import prev_fast_len
    from scipy.special import kolmogorov

    # A transform takes many times the memory if its length has no small factors.
    residual = residual[: prev_fast_len(len(residual))]
    power = np.abs(np.fft.rfft(residual)[1 : (len(residual) + 1) // 2]) ** 2
    if len(power) < 2:
        return 1.0
    reached = np.cumsum(power)[:-1] / np.sum(power)
    shares = np.arange(1, len(power)) / len(power)
    return float(kolmogorov(np.sqrt(len(power)) * np.max(np.abs(reached - shares))))


# Autocorrelated noise with most of the variance, and slower than this share of the trace, is
# misfit. It may be misfit if it has a noticeable share and lasts for longer.
_MOST, _SLOW, _NOTICEABLE, _LONG = 0.5, 0.02, 1 / 3, 0.2
# Of so many stretches of a trace with stationary noise, which is correlated for less than half a
# stretch, none has so large a share of the sum of squares.
_SLOW_STRETCHES, _IN_ONE = 20, 0.3
# Of stretches with fewer readings the scatter is hardly known. Scales of white noise in twenty of
# them differ by more once in hundreds of traces.
_IN_A_STRETCH, _FEWEST_STRETCHES, _UNEVEN = 50, 3, 3.0
# Mean square over that of the scatter: of white noise 1.05 to 1.4, as the scatter is uncertain.
_AS_THE_SCATTER = 1.44


def find_slow_misfit(
    noise_model: NoiseModel, duration_s: float, instrument: Instrument
) -> Note | None:
    """Return a note if the autocorrelated part of a noise model is, or may be, misfit."""
    share, time_s = noise_model.ar1, noise_model.time_s
    misfit = share > _MOST and time_s > _SLOW * duration_s
    if not misfit and not (share > _NOTICEABLE and time_s > _LONG * duration_s):
        return None
    suspects = instrument.suspects(unit=True).capitalize()
    meaning = (
        f"that is misfit, not noise. {suspects} is not the right one."
        if misfit
        else f"that may be misfit, of a {instrument.suspects('')} that is not the right one."
    )
    return Note(
        REJECTION if misfit else DOUBT,
        f"What the fit leaves is correlated over {time_s:.2g} s of a trace of {duration_s:.3g} s, "
        f"{100 * share:.0f} % of its variance: {meaning}",
    )


def has_fast_noise(residuals: Residuals, log_parameters: Array) -> bool:
    """Return True if what a fit leaves is stationary noise that is correlated for a short time.

    That is not estimated of more than `MOST_SAMPLES` readings, nor of residuals that are white.
    """
    time_s = residuals.trace.time_s
    if residuals.coloured or len(time_s) > MOST_SAMPLES:
        return False
    residual, sensitivity = residuals(log_parameters)
    stretches = np.array_split(np.square(residual), min(_SLOW_STRETCHES, len(residual)))
    if max(float(np.sum(each)) for each in stretches) > _IN_ONE * float(residual @ residual):
        return False
    noise_model = NoiseModelLikelihood(time_s, residual, sensitivity).best()
    fast = noise_model.time_s <= _SLOW * residuals.duration_s
    return fast and noise_model.ar1 > _NOTICEABLE


def has_uneven_noise(residual: Array, rounding_rad: float) -> bool:
    """Return True if what a fit leaves, (n_samples,), is as large as a scatter that differs.

    So it is where an instrument averages for longer and longer, or settles at first. A misfit of
    the model is smooth, and larger than the scatter of neighbours wherever it is.
    """
    count = min(_SLOW_STRETCHES, len(residual) // _IN_A_STRETCH)
    if count < _FEWEST_STRETCHES:
        return False
    stretches = np.array_split(residual, count)
    scales = [estimate_noise(each, rounding_rad) for each in stretches]
    if max(scales) < _UNEVEN * min(scales):
        return False
    own = np.concatenate([each / scale for each, scale in zip(stretches, scales, strict=True)])
    return bool(np.mean(own**2) < _AS_THE_SCATTER)
