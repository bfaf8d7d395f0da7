"""Information under noise with memory, against dense covariance matrices."""

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.design.experiment import compute_information
from biogrip.design.noise import WHITE, DesignNoise
from biogrip.experiment.noise_parts import AR1, Flicker

# Bursts of a fast camera and slow readings between: instants that no grid has.
TIMES = np.concatenate((0.3 + 1e-5 * np.arange(1, 40), np.linspace(0.4, 30, 50), [399.9, 400.0]))
ROWS = np.stack(
    [np.exp(-TIMES / tau) + 0.1 * np.exp(-(TIMES - 0.3) / 1e-4) for tau in (0.5, 20.0, 1e3)]
)


def dense(noise: DesignNoise) -> Array:
    """Covariance of readings over the variance, from what the parts are defined as."""
    apart = np.abs(TIMES[:, None] - TIMES)
    found = noise.white_share * np.eye(len(TIMES))
    if noise.ar1:
        found += noise.ar1.share * np.exp(-apart / noise.ar1.time_s)
    if noise.flicker:
        # Equal variances of relaxation times from the shortest distance to three times the whole.
        longest, shortest = 3 * np.ptp(TIMES), np.min(np.diff(TIMES))
        count = 2 + int(np.log(longest / shortest) / 1.5)
        times = longest * (shortest / longest) ** (np.arange(count) / (count - 1))
        parts = [np.exp(-apart / time) for time in times]
        found += noise.flicker.share * np.mean(parts, axis=0)
    return found


def least_squares(noise: DesignNoise) -> Array:
    """Information of generalised least squares, offset and drift being unknown, too."""
    along = [np.ones_like(TIMES)] * noise.fits_offset + [TIMES / 400] * noise.fits_drift
    rows = np.vstack((ROWS, *along))
    whole = rows @ np.linalg.solve(dense(noise), rows.T)
    if not along:
        return whole
    own, other = whole[: len(ROWS)], whole[len(ROWS) :]
    left: Array = own[:, : len(ROWS)] - own[:, len(ROWS) :] @ np.linalg.solve(
        other[:, len(ROWS) :], other[:, : len(ROWS)]
    )
    return left


@pytest.mark.parametrize(
    "noise",
    [
        WHITE,
        DesignNoise(offset=True),
        DesignNoise(drift=True),
        DesignNoise(ar1=AR1(0.5, 0.01), offset=False, drift=False),
        DesignNoise(ar1=AR1(0.9, 1.0), drift=False),
        DesignNoise(ar1=AR1(0.5, 50.0)),
        DesignNoise(flicker=Flicker(0.3)),
        DesignNoise(ar1=AR1(0.2, 1e-4), flicker=Flicker(0.7), offset=False),
    ],
    ids=str,
)
def test_information_is_that_of_the_dense_matrix(noise: DesignNoise) -> None:
    found = compute_information(noise.whiten(TIMES, ROWS[None]))[0]
    expected = least_squares(noise)
    size = np.sqrt(np.outer(*2 * [np.diag(expected)]))
    # Rounding: the matrices are conditioned to 1e4, what is fitted along to 1e3.
    np.testing.assert_allclose(found / size, expected / size, atol=1e-8)


def test_close_readings_tell_less_of_a_level_and_more_of_a_jump() -> None:
    """A hundred readings within a hundredth of the memory, and as many of white noise."""
    times = np.linspace(1e-5, 1e-3, 100)
    slow = DesignNoise(ar1=AR1(0.5, 0.1), offset=False, drift=False)
    level, jump = np.ones((1, 1, 100)), np.zeros((1, 1, 100))
    jump[..., :50], jump[..., 50:] = -0.5, 0.5
    white = [float(compute_information(each)[0, 0, 0]) for each in (level, jump)]
    found = [
        float(compute_information(slow.whiten(times, each))[0, 0, 0]) for each in (level, jump)
    ]
    # Of a level no more than the slow half leaves, 1/0.5 and little more.
    assert white[0] == pytest.approx(100)
    assert 1.9 < found[0] < 2.1
    # Of a jump nearly what the white half leaves.
    assert 1.5 * white[1] < found[1] < 2 * white[1]


def test_what_is_fitted_along_is_as_where_traces_are_judged() -> None:
    assert not WHITE.fits_offset
    assert not WHITE.fits_drift
    coloured = DesignNoise(flicker=Flicker(0.1), drift=False)
    assert coloured.fits_offset
    assert not coloured.fits_drift
