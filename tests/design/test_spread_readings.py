"""Readings spread under noise with memory, against dense matrices and other samplings."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.design.criteria import Criterion, inverted
from biogrip.design.experiment import DesignInputs
from biogrip.design.noise import DesignNoise
from biogrip.design.rating import Torque
from biogrip.design.schedule import Plan, planned
from biogrip.design.spread_readings import (
    CellNoise,
    effective_capacity,
    spread_readings,
    whole_along,
)
from biogrip.design.waveform import hold
from biogrip.experiment.noise_parts import AR1, Flicker
from biogrip.experiment.sampling import Burst, Sampling
from tests.design.test_plan import DROP

SHARES, TIMES_S = np.array([0.5, 0.2]), np.array([0.1, 3.0])
EDGES_S = np.array([0.0, 1e-3, 3e-3, 1e-2, 0.05, 0.3, 2.0, 2.5, 9.0])
MIDDLE_S, LASTING_S = (EDGES_S[1:] + EDGES_S[:-1]) / 2, np.diff(EDGES_S)
ROWS = np.stack([np.ones(8), np.exp(-MIDDLE_S / 0.5), np.exp(-MIDDLE_S / 0.01)])[None]
NOISE = CellNoise(MIDDLE_S, LASTING_S, SHARES, 1 / TIMES_S)


@cache
def dense() -> Array:
    """Covariances of the means over cells, averaged over 400 instants of each."""
    inside = EDGES_S[:-1, None] + LASTING_S[:, None] * (np.arange(400) + 0.5) / 400
    found = np.zeros((8, 8))
    for share, time in zip(SHARES, TIMES_S, strict=True):
        for i in range(8):
            for j in range(8):
                apart = np.abs(inside[i][:, None] - inside[j])
                found[i, j] += share * np.exp(-apart / time).mean()
    return found


def test_information_is_that_of_the_means_over_cells() -> None:
    readings = np.array([1.0, 0.5, 3.0, 0.1, 20.0, 7.0, 2.0, 40.0])
    found, _ = NOISE.respond(ROWS, readings)
    shared = dense()
    covariance = shared + np.diag((1 - np.diag(shared)) / readings)
    expected = ROWS[0] @ np.linalg.solve(covariance, ROWS[0].T)
    # Of 400 instants a cell that is 90 relaxation times long has few: 1e-3.
    np.testing.assert_allclose(found[0], expected, rtol=3e-3)


def test_what_a_reading_more_tells_is_the_derivative() -> None:
    readings = np.array([1.0, 0.5, 3.0, 0.1, 20.0, 7.0, 2.0, 40.0])
    _, roots = NOISE.respond(ROWS, readings)
    for cell, step in enumerate(1e-4 * np.diag(readings)):
        ahead, behind = (NOISE.respond(ROWS, readings + sign * step)[0][0] for sign in (1, -1))
        slope = (ahead - behind) / (2 * step[cell])
        np.testing.assert_allclose(np.outer(*2 * [roots[0, :, cell]]), slope, rtol=1e-5, atol=1e-9)


def test_no_other_filling_of_the_cells_tells_more() -> None:
    criterion = Criterion("largest", "worst", (0, 1, 2))
    capacity = np.array([5.0, 10, 30, 100, 500, 2000, 500, 9000])

    def bound(readings: Array) -> float:
        return criterion.typical_bound(inverted(NOISE.respond(ROWS, readings)[0]))

    best = spread_readings(ROWS, NOISE, capacity, 200, criterion)
    assert best.sum() == pytest.approx(200)
    assert np.all(best <= capacity + 1e-9)
    rng = np.random.default_rng(2)
    for _ in range(300):
        other = np.minimum(capacity, best * np.exp(0.3 * rng.normal(size=8)) + rng.random(8))
        assert bound(best) < 1.006 * bound(other * 200 / other.sum())
    # In one cell, however long, they share its mean.
    assert bound(best) < bound(np.minimum(capacity, 25.0))


def test_rounding_keeps_sums_along_the_cells() -> None:
    readings = np.array([0.4, 0.4, 0.4, 2.3, 0.0, 0.5])
    counts = whole_along(readings)
    assert counts.sum() == 4
    assert np.all(np.abs(np.cumsum(counts) - np.cumsum(readings)) <= 0.5 + 1e-9)


def test_a_cell_is_worth_its_length_in_memories() -> None:
    """Of many readings of AR(1) alone, by a dense matrix: 1 + L/(2 tau)."""
    for lasting in (0.01, 1.0, 30.0):
        times = np.linspace(0, lasting, 400)
        matrix = np.exp(-np.abs(times[:, None] - times))
        told = float(np.linalg.solve(matrix, np.ones(400)).sum())
        one = np.ones(1)
        found = effective_capacity(np.array([1e6]), lasting * one, one, one)
        assert found[0] == pytest.approx(told, rel=2e-3)


def _inputs(noise: DesignNoise) -> DesignInputs:
    return replace(DROP, noise=noise, limits=replace(DROP.limits, longest_s=60.0))


def _bound(inputs: DesignInputs, plan: Plan, time_s: Array) -> float:
    return inputs.typical_bound(inputs.information(plan.torque, time_s))


@pytest.mark.parametrize(
    "noise",
    [
        DesignNoise(ar1=AR1(0.5, 0.01)),
        DesignNoise(ar1=AR1(0.5, 1.0), offset=False, drift=False),
        DesignNoise(flicker=Flicker(0.3), drift=False),
    ],
    ids=str,
)
def test_a_plan_allows_for_the_memory(noise: DesignNoise) -> None:
    """It tells more than the same torque read as under white noise, evenly, or at random."""
    inputs = _inputs(noise)
    steps = Torque(hold(np.array([0.05, 5.0, 54.95]), np.array([1.0, 0.4, 1.0])), 8e-9)
    plan = planned(inputs, [steps])
    assert np.isnan(plan.gap)
    assert len(plan.time_s) == 1000
    assert np.all(np.diff(plan.time_s) > 0.999e-5)
    ours = inputs.typical_bound(plan.information)
    white = planned(_inputs(DesignNoise()), [steps])
    assert ours < 0.7 * _bound(inputs, plan, white.time_s)
    even = Sampling(bursts=(Burst(0.01, 1000 / 59.9, 1000),)).over(60.0)
    assert ours < 0.7 * _bound(inputs, plan, even)
    # A few slots after a step, and anywhere in the logarithm of the time after it.
    rng = np.random.default_rng(0)
    for _ in range(20):
        after = np.exp(rng.uniform(np.log(1e-5), np.log([0.049, 4.9, 54.9]), (800, 3)))
        slots = np.unique(np.rint((after + np.array([0.0, 0.05, 5.05])) * 1e5))
        drawn = np.sort(rng.choice(slots, 1000, replace=False)) / 1e5
        assert ours < _bound(inputs, plan, drawn)


def test_where_only_an_offset_is_fitted_along_the_gap_stays_true() -> None:
    inputs = _inputs(DesignNoise(offset=True, drift=True))
    steps = Torque(hold(np.array([0.05, 5.0, 54.95]), np.array([1.0, 0.4, 1.0])), 8e-9)
    plan = planned(inputs, [steps])
    assert 0 <= plan.gap < 0.01
    ours = inputs.typical_bound(plan.information)
    white = planned(_inputs(DesignNoise()), [steps])
    assert ours < _bound(inputs, plan, white.time_s)
