"""What colour the noise of a trace has, by restricted maximum likelihood.

What a fit leaves has less noise than the trace, most of all at low frequencies, where
parameters, offset and drift take it for their own. Restricted likelihood is that of
what none of them can reach, so the colour comes out without that bias [1]_ [2]_.

References
----------
.. [1] H. D. Patterson and R. Thompson, Recovery of inter-block information when block sizes are
   unequal, Biometrika 58 (1971), 545-554.
.. [2] D. A. Harville, Maximum likelihood approaches to variance component estimation and to
   related problems, Journal of the American Statistical Association 72 (1977), 320-338.
"""

import numpy as np

from biogrip.arrays import Array
from biogrip.response.whitening import Colour, Whitening

# Logarithms of the odds of a part against the white one: from nothing to all.
_LEAST, _MOST = -9.0, 7.0
# Likelihoods of colours have several maxima. Odds, and places between the shortest and the longest
# time, that are tried; the best is followed.
_ODDS, _PLACES = (-4.0, -1.0, 2.0), (0.1, 0.35, 0.6, 0.85)
_STEP, _SETTLED = 1e-4, 1e-10


def colour_of(
    time_s: Array, residual: Array, directions: Array, near: Colour | None = None
) -> Colour:
    """Estimate the colour of the noise that a fit leaves.

    Parameters
    ----------
    time_s : (n_samples,)
        Ascending sampling times.
    residual : (n_samples,)
        What is left of a trace.
    directions : (n_directions, n_samples)
        Where residuals may have been taken in: derivatives by the parameters, and nuisance.
    near
        Colour to start from, if one is known.

    Returns
    -------
    Colour
        That of the highest restricted likelihood.
    """
    from scipy.optimize import minimize

    reached = _independent(directions)
    none = np.zeros((0, len(time_s)))
    shortest, longest = float(np.diff(time_s).min()), float(time_s[-1] - time_s[0])
    times = np.log([shortest / 2, longest])
    bounds = [(_LEAST, _MOST), (times[0], times[1]), (_LEAST, _MOST)]

    def deviance(x: Array) -> float:
        whitening = Whitening(time_s, _colour(x), none)
        white = whitening(np.vstack((reached, residual)))
        basis, triangle = np.linalg.qr(white[:-1].T)
        left = white[-1] - basis @ (basis.T @ white[-1])
        of_reached = 2 * float(np.sum(np.log(np.abs(np.diagonal(triangle)))))
        free = len(time_s) - len(reached)
        return free * float(np.log(left @ left)) + whitening.log_determinant + of_reached

    starts = [
        np.array([relaxing, times[0] + place * (times[1] - times[0]), flicker])
        for relaxing in _ODDS
        for place in _PLACES
        for flicker in (_LEAST, *_ODDS[:2])
    ]
    if near is not None:
        starts = [np.clip(_logarithms(near), *np.transpose(bounds))]
    found = minimize(
        deviance,
        min(starts, key=deviance),
        method="L-BFGS-B",
        bounds=bounds,
        options={"eps": _STEP, "ftol": _SETTLED},
    )
    return _colour(found.x)


def _logarithms(colour: Colour) -> Array:
    odds = np.array([colour.relaxing, colour.flicker]) / colour.white
    return np.array([np.log(odds[0]), np.log(colour.time_s), np.log(odds[1])])


def _colour(x: Array) -> Colour:
    """Turn log odds, and the logarithm of a time, into shares."""
    relaxing, flicker = np.exp(x[0]), np.exp(x[2])
    whole = 1 + relaxing + flicker
    return Colour(float(relaxing / whole), float(np.exp(x[1])), float(flicker / whole))


def _independent(directions: Array) -> Array:
    """Orthonormal rows with the span of some, of those that are more than rounding."""
    sizes = np.linalg.norm(directions, axis=1)
    rows = directions[sizes > 0] / sizes[sizes > 0, None]
    _, shares, basis = np.linalg.svd(rows, full_matrices=False)
    kept: Array = basis[shares > 1e-8]
    return kept
