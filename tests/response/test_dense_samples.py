"""Nodes that stand for dense samples: the same sums of products, by summing over all samples."""

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.experiment.protocol import torque_history
from biogrip.response.dense_samples import DenseSamples
from biogrip.response.mode_growth import compute_growth
from tests.helpers.responses import PROTOCOLS

_RNG = np.random.default_rng(4)
TIMES = {
    "uniform": np.linspace(0.0, 400.0, 15_001),
    "random": np.sort(_RNG.uniform(0.0, 400.0, 15_000)),
    "ever rarer": np.geomspace(1e-4, 400.0, 9_000),
    "in bursts": np.sort((np.arange(40.0) * 10 + _RNG.uniform(0, 0.3, (400, 1)) ** 2).ravel()),
    "from late on": np.linspace(150.0, 400.0, 8_000),
}


@pytest.mark.parametrize("times", TIMES)
@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_products_are_those_of_all_samples(protocol: str, times: str) -> None:
    """Relative to the norms, whatever the rates; many times fewer rows."""
    torque, time_s = torque_history(PROTOCOLS[protocol]), TIMES[times]
    dense = DenseSamples(torque, time_s)
    rates = -np.geomspace(1e-6, 1e3, 25)
    samples, values = (
        np.concatenate(compute_growth(rates[None], torque, t)[0][0]) for t in (time_s, dense.time_s)
    )
    size = np.linalg.norm(samples, axis=1, keepdims=True)
    samples, values = samples / size, values / size
    rows = dense.rows_of_values(values)
    noise = _RNG.standard_normal(len(time_s))
    seen, rest = dense.rows_of_samples(noise)
    np.testing.assert_allclose(rows @ rows.T, samples @ samples.T, rtol=0, atol=2e-12)
    np.testing.assert_allclose(rows @ seen, samples @ noise, rtol=0, atol=1e-10)
    assert np.hypot(np.linalg.norm(seen), rest) == pytest.approx(np.linalg.norm(noise), rel=1e-12)
    back = dense.values_of_rows(rows)
    np.testing.assert_allclose(back, values, rtol=0, atol=1e-11 * np.abs(values).max())
    assert len(dense.time_s) < 0.5 * len(time_s)
    assert np.all(np.diff(dense.time_s) > 0)


def test_few_samples_are_their_own_nodes() -> None:
    time_s = np.linspace(0.0, 400.0, 200)
    dense = DenseSamples(torque_history(PROTOCOLS["steps"]), time_s)
    values: Array = _RNG.standard_normal((3, 200))
    np.testing.assert_array_equal(dense.time_s, time_s)
    np.testing.assert_array_equal(dense.rows_of_values(values), values)
    assert dense.rows_of_samples(values[0])[1] == 0.0
