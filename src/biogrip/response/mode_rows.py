"""Table of the responses of modes to a protocol, condensed to rows, against the rate.

For a given protocol and given times, the rows of a mode are a smooth function of its
rate r alone (`biogrip.response.decay_table`). Divided by T r, T the last time, they are
as large for slow modes as for fast ones; under a deformation, which modes forget the faster
the faster they are, they are so multiplied by 1 - T r. They are polynomials of low degree in
short pieces of

    u = log(1 - T r)

give them to all digits. So a response with its derivatives is one small matrix
product: weights and powers of the places within pieces, times the pieces'
coefficients.
"""

import numpy as np
from numpy.polynomial import chebyshev

from biogrip.arrays import Array
from biogrip.experiment.protocol import TorqueHistory
from biogrip.response.decay_table import DEGREE, NODES, WIDTH, series
from biogrip.response.mode_growth import compute_growth
from biogrip.response.modes import Modes

# As in `decay_table`, wide pieces of high degree need the fewest rates, short ones of low degree
# are the fastest to look up: the latter's error is 3e-15 of what is tabulated.
_SHORTER, _DEGREE = 16, 5
_WIDTH = WIDTH / _SHORTER
_ORDERS = np.arange(_DEGREE + 1)
# exp(-40) is lost in rounding; under a ramp, a term remains that falls with the rate only.
_DECAYED, _DECAYED_UNDER_RAMPS = 40.0, 1e12

# On a short piece from -1/2 to 1/2.
_SHORT_NODES = 0.5 * chebyshev.chebpts1(_DEGREE + 1)
_DIVIDED = (np.arange(_SHORTER)[:, None] + 0.5 + _SHORT_NODES).ravel() / _SHORTER
_TO_SHORT = np.linalg.solve(series(NODES, DEGREE).T, series(_DIVIDED, DEGREE).T).T
_TO_POWERS = np.linalg.inv(np.vander(_SHORT_NODES, increasing=True))


class ModeRows:
    """Computes condensed rows of the responses of many samples, with their derivatives.

    A matrix, (n_times, n_rows), turns values at ascending times, multiplied from their right, into
    rows; `shortest_s` is the shortest of these times after a change of torque.
    """

    def __init__(
        self, torque: TorqueHistory, time_s: Array, to_rows: Array, shortest_s: float
    ) -> None:
        self._end_s, self._deforms = float(time_s[-1]), torque.deforms
        self._drives, self._rows = 1 if torque.symmetric else 2, to_rows.shape[1]
        decayed = _DECAYED if torque.only_steps else _DECAYED_UNDER_RAMPS
        wide = int(np.ceil(np.log1p(decayed * self._end_s / shortest_s) / WIDTH))
        self._last = wide * _SHORTER
        # (n_pieces, n_drives, degree + 1, n_rows).
        self._table = np.empty((self._last, self._drives, len(_ORDERS), self._rows))
        for piece in range(wide):
            u = WIDTH * (piece + NODES)
            growth, _ = compute_growth(-np.expm1(u)[None] / self._end_s, torque, time_s)
            values = (growth[0] / self._scale(np.expm1(u))[:, None]) @ to_rows
            short = (_TO_SHORT @ values).reshape(self._drives, _SHORTER, len(_ORDERS), self._rows)
            here = slice(piece * _SHORTER, (piece + 1) * _SHORTER)
            self._table[here] = _TO_POWERS @ short.swapaxes(0, 1)

    def __call__(self, modes: Modes) -> Array:
        """Return rows of responses with derivatives, (n, 1 + n_parameters, n_rows) in rad."""
        count, parameters, n_modes = modes.rate_slopes.shape
        scaled = -self._end_s * modes.rates
        u = np.log1p(scaled) / _WIDTH
        decayed = u >= self._last
        u = np.minimum(u, np.nextafter(self._last, 0))
        piece = u.astype(np.intp)
        powers, power_slopes = _powers(u - piece - 0.5)
        # The divisor, and the place, with their derivatives by the log-parameters.
        known = np.where(decayed, np.expm1(_WIDTH * self._last), scaled)
        known_slopes = np.where(decayed, 0.0, -self._end_s)[:, None] * modes.rate_slopes
        place_slopes = known_slopes / (_WIDTH * (1 + scaled))[:, None]
        scale, scale_slopes = self._scale(known), known_slopes
        if self._deforms:
            # What a fast mode has not forgotten falls with its rate.
            scale = self._scale(scaled)
            scale_slopes = (self._end_s * scale * scale)[:, None] * modes.rate_slopes
        # Now (n, n_modes, n_drives), and (n, n_parameters, n_modes, n_drives).
        weights = modes.weights.swapaxes(-1, -2)
        weight_slopes = modes.weight_slopes.swapaxes(-1, -2)
        amplitudes = weights * scale[..., None]
        amplitude_slopes = weight_slopes * scale[:, None, :, None]
        amplitude_slopes += weights[:, None] * scale_slopes[..., None]
        moved = amplitudes[:, None] * place_slopes[..., None]
        mixed = np.empty((count, 1 + parameters, n_modes, self._drives, len(_ORDERS)))
        np.multiply(amplitudes[..., None], powers, out=mixed[:, 0])
        np.multiply(amplitude_slopes[..., None], powers[:, None], out=mixed[:, 1:])
        mixed[:, 1:] += moved[..., None] * power_slopes[:, None]
        # One product per sample: the order of its sums does not depend on the number of samples.
        pieces = self._table[piece].reshape(count, -1, self._rows)
        return mixed.reshape(count, 1 + parameters, -1) @ pieces

    def _scale(self, scaled: Array) -> Array:
        """Return the divisor of a mode's rows by -T r."""
        return 1 / (1 + scaled) if self._deforms else scaled


def _powers(place: Array) -> tuple[Array, Array]:
    """Return powers, and their derivatives, of shape (..., 1, degree + 1)."""
    powers = np.ones((*place.shape, 1, len(_ORDERS)))
    for order in _ORDERS[1:]:
        powers[..., 0, order] = powers[..., 0, order - 1] * place
    slopes = np.zeros_like(powers)
    slopes[..., 1:] = _ORDERS[1:] * powers[..., :-1]
    return powers, slopes
