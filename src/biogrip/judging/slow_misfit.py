"""Misfit that looks like noise: correlated for too long, or in one stretch of the trace only."""

import numpy as np

from biogrip.arrays import Array
from biogrip.fit.noise_model_fit import NoiseModelLikelihood
from biogrip.instrument.instrument import Instrument
from biogrip.judging.fit_status import DOUBT, REJECTION, Note
from biogrip.response.noise_estimate import estimate_noise
from biogrip.response.residuals import Residuals
from biogrip.response.whitening import MOST_SAMPLES, NoiseModel

# Autocorrelated noise with most of the variance, and slower than this share of the trace, is
# misfit. It may be misfit if it has a noticeable share and lasts for longer.
_MOST, _SLOW, _NOTICEABLE, _LONG = 0.5, 0.02, 1 / 3, 0.2
# Of so many stretches of a trace with stationary noise, which is correlated for less than half a
# stretch, none has so large a share of the sum of squares.
_STRETCHES, _IN_ONE = 20, 0.3
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

    False also where that is not estimated: of very many readings, and of residuals that are white
    already.
    """
    time_s = residuals.sampling_s
    if residuals.coloured or len(time_s) > MOST_SAMPLES:
        return False
    residual, sensitivity = residuals(log_parameters)
    stretches = np.array_split(np.square(residual), min(_STRETCHES, len(residual)))
    if max(float(np.sum(each)) for each in stretches) > _IN_ONE * float(residual @ residual):
        return False
    noise_model = NoiseModelLikelihood(time_s, residual, sensitivity).best()
    fast = noise_model.time_s <= _SLOW * residuals.duration_s
    return fast and noise_model.ar1 > _NOTICEABLE


def has_uneven_noise(residual: Array, rounding_rad: float) -> bool:
    """Return True if what a fit leaves is as large as the scatter around it, where that differs.

    So it is where an instrument averages for longer and longer, or settles at first. A misfit of
    the model is smooth, and larger than the scatter of neighbours wherever it is.

    Parameters
    ----------
    residual : (n_samples,)
        What the fit leaves.
    rounding_rad
        Step of the readings.
    """
    count = min(_STRETCHES, len(residual) // _IN_A_STRETCH)
    if count < _FEWEST_STRETCHES:
        return False
    stretches = np.array_split(residual, count)
    scales = [estimate_noise(each, rounding_rad) for each in stretches]
    if max(scales) < _UNEVEN * min(scales):
        return False
    own = np.concatenate([each / scale for each, scale in zip(stretches, scales, strict=True)])
    return bool(np.mean(own**2) < _AS_THE_SCATTER)
