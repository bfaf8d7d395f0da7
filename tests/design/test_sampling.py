"""The best sampling: against closed forms, another solver, and everything else one could do."""

import numpy as np
import pytest
from scipy.optimize import minimize

from biogrip.arrays import Array
from biogrip.design.criteria import CRITERIA, OVER, Criterion, inverted
from biogrip.design.few_bins import in_few_bins
from biogrip.design.sampling import Optimum, best_sampling

GAP = 1e-3
ALL = (0, 1, 2)


def _quadratic(points: int = 201) -> Array:
    """Regression of a parabola on [-1, 1], (1, 3, n_points)."""
    x = np.linspace(-1, 1, points)
    return np.stack((np.ones_like(x), x, x**2))[None]


def _free(sensitivity: Array, criterion: Criterion) -> Optimum:
    room = np.full(sensitivity.shape[2], 1.0)
    return best_sampling(sensitivity, room, 1, criterion, gap=GAP, most=200)


@pytest.mark.parametrize(
    ("name", "weights"),
    [
        # Pukelsheim, Optimal Design of Experiments, section 9.5 and exercises of 9.12.
        ("D", (1 / 3, 1 / 3, 1 / 3)),
        ("A", (1 / 4, 1 / 2, 1 / 4)),
        ("E", (1 / 5, 3 / 5, 1 / 5)),
    ],
)
def test_parabola(name: str, weights: tuple[float, float, float]) -> None:
    """Three points and their weights are known; of a flat optimum, weights to the gap's root."""
    found = _free(_quadratic(), Criterion(name, "worst", ALL))
    assert found.gap < GAP
    near = [found.samples[:10].sum(), found.samples[90:111].sum(), found.samples[-10:].sum()]
    np.testing.assert_allclose(near, weights, atol=0.05)
    exact = inverted(np.einsum("w,npw,nqw->npq", weights, *2 * [_quadratic(3)]))
    criterion = Criterion(name, "worst", ALL)
    ratio = criterion.typical_bound(found.covariances) / criterion.typical_bound(exact)
    # Rounding of the regularised inverse is far below the gap.
    assert 1 - 1e-6 < ratio < 1 + GAP


def _random(seed: int, samples: int) -> tuple[Array, Array]:
    rng = np.random.default_rng(seed)
    time = np.linspace(0.05, 4, 40)
    rates = rng.uniform(0.3, 3.0, (samples, 3, 1))
    sensitivity = np.exp(-rates * time) * rng.uniform(0.5, 2.0, (samples, 3, 1)) * 10
    return sensitivity, rng.integers(1, 8, 40).astype(float)


def test_samples_weigh_by_a_power_of_the_root_of_their_determinant() -> None:
    """Of two parameters roots of 36 and 9, so 36 to 9 of squares."""
    covariances = np.array([np.diag([4.0, 9.0]), np.diag([1.0, 9.0])])
    of_samples, of_covariances = Criterion("D", "worst", (0, 1)).weights(covariances, 2.0)
    assert of_samples == pytest.approx([0.8, 0.2])
    np.testing.assert_allclose(of_covariances[0], np.diag([1 / 4, 1 / 9]))


@pytest.mark.parametrize("over", OVER)
@pytest.mark.parametrize("name", CRITERIA)
def test_nothing_else_is_better_than_the_gap_says(name: str, over: str) -> None:
    """Full cells, several samples: against another solver from where we stand, and at random."""
    sensitivity, capacity = _random(1, 3)
    criterion = Criterion(name, over, (0, 2))
    found = best_sampling(sensitivity, capacity, 60, criterion, gap=5e-3, most=300)
    assert found.gap < 5e-3
    assert found.samples.sum() == pytest.approx(60)
    assert np.all((found.samples >= 0) & (found.samples <= capacity * (1 + 1e-12)))

    def bound(samples: Array) -> float:
        covariances = inverted((sensitivity * samples) @ sensitivity.swapaxes(1, 2))
        return criterion.typical_bound(covariances[:, [[0], [2]], [0, 2]])

    ours = bound(found.samples)
    assert ours == pytest.approx(criterion.typical_bound(found.covariances), rel=1e-9)
    other = minimize(
        lambda x: np.log(bound(x)),
        np.minimum(capacity, found.samples + 0.05),
        method="SLSQP",
        bounds=[(0, c) for c in capacity],
        constraints={"type": "eq", "fun": lambda x: np.sum(x) - 60},
        options={"maxiter": 100},
    )
    spread = np.clip(other.x, 0, capacity)
    # What the other solver found may hold a little more than 60.
    assert ours <= bound(spread * 60 / max(60.0, spread.sum())) * (1 + found.gap)
    rng = np.random.default_rng(2)
    for _ in range(50):
        tried = capacity * rng.random(40) ** rng.uniform(0.2, 5)
        tried *= min(60 / tried.sum(), (capacity / np.maximum(tried, 1e-300)).min())
        assert ours <= bound(tried) * (1 + found.gap)


def test_information_from_before_counts() -> None:
    """What is there already is as good as readings that had to be made."""
    sensitivity, capacity = _random(5, 1)
    there = np.where(np.arange(40) < 10, capacity, 0.0)
    before = ((sensitivity * there) @ sensitivity.swapaxes(1, 2))[0]
    criterion = Criterion("A", "worst", ALL)
    found = best_sampling(sensitivity, capacity, 30, criterion, gap=1e-3, most=300, before=before)
    assert found.gap < 1e-3
    whole = inverted((sensitivity * (found.samples + there)) @ sensitivity.swapaxes(1, 2))
    # Inverses lose what their condition number is, 1e10 here.
    np.testing.assert_allclose(found.covariances, whole, rtol=1e-5)
    rng = np.random.default_rng(6)
    for _ in range(200):
        tried = capacity * rng.random(40) ** rng.uniform(0.2, 5)
        tried *= min(30 / tried.sum(), (capacity / np.maximum(tried, 1e-300)).min())
        other = inverted((sensitivity * (tried + there)) @ sensitivity.swapaxes(1, 2))
        assert criterion.typical_bound(whole) <= criterion.typical_bound(other) * (1 + found.gap)


def test_with_less_room_than_samples_all_cells_are_full() -> None:
    sensitivity, capacity = _random(3, 1)
    found = best_sampling(
        sensitivity, capacity, 10_000, Criterion("D", "worst", ALL), gap=GAP, most=5
    )
    np.testing.assert_array_equal(found.samples, capacity)
    assert found.gap == pytest.approx(0.0, abs=1e-9)


def test_in_few_cells_as_much_is_told() -> None:
    """Of Caratheodory's corner no more than 6 + 1 cells are filled in part, a sample."""
    sensitivity, capacity = _random(4, 2)
    criterion = Criterion("D", "mean", ALL)
    found = best_sampling(sensitivity, capacity, 60, criterion, gap=GAP, most=200)
    few = in_few_bins(sensitivity, found.samples, capacity, np.linspace(0, 1, 40))
    partly = (few > 1e-6) & (few < capacity - 1e-6)
    assert np.count_nonzero(partly) <= 2 * 6 + 1
    assert few.sum() == pytest.approx(60)
    before, after = (
        (sensitivity * one) @ sensitivity.swapaxes(1, 2) for one in (found.samples, few)
    )
    for one, other in zip(before, after, strict=True):
        shares = np.linalg.eigvals(np.linalg.solve(one, other)).real
        # Each entry of the whitened information by 1e-3: three of them in a row.
        np.testing.assert_allclose(shares, 1.0, atol=4e-3)


def test_in_few_cells_what_no_reading_tells_apart_is_left_alone() -> None:
    """A parameter that only goes with another, and one that never shows."""
    sensitivity, capacity = _random(4, 2)
    apart = np.concatenate(
        (sensitivity, 1e-3 * sensitivity[:, :1], np.zeros_like(sensitivity[:, :1])), axis=1
    )
    found = best_sampling(sensitivity, capacity, 60, Criterion("D", "mean", ALL), gap=GAP, most=200)
    cost = np.linspace(0, 1, 40)
    few = in_few_bins(apart, found.samples, capacity, cost)
    assert few.sum() == pytest.approx(60)
    partly = (few > 1e-6) & (few < capacity - 1e-6)
    assert np.count_nonzero(partly) <= 2 * 6 + 1
    before, after = (
        (sensitivity * one) @ sensitivity.swapaxes(1, 2) for one in (found.samples, few)
    )
    for one, other in zip(before, after, strict=True):
        shares = np.linalg.eigvals(np.linalg.solve(one, other)).real
        np.testing.assert_allclose(shares, 1.0, atol=4e-3)
