"""Confidence sets in parts, profiles dense enough to draw, and optima that were missed."""

from dataclasses import replace

import numpy as np
import pytest

from biogrip.arrays import Array, IntArray
from biogrip.judging.constrained_fits import ConstrainedFits
from biogrip.judging.limits import find_limits
from biogrip.judging.profiles import Points, Profile, compute_profiles, find_gaps
from biogrip.judging.quantities import parameters_and_sum
from biogrip.judging.verdicts import Finding
from biogrip.stages.intervals import refitted, shown_of
from tests.helpers.limits import likelihood_for
from tests.helpers.problems import MODEL

QUANTITIES = parameters_and_sum(MODEL)


def parabolas(values: Array) -> Array:
    """Two basins about -2 and 2, whose square roots are straight."""
    increases: Array = np.minimum((values + 2) ** 2, (values - 2) ** 2)
    return increases


def test_a_set_in_two_parts_has_a_gap() -> None:
    values = np.linspace(-5, 5, 101)
    (gap,) = find_gaps(values, parabolas(values), 1.0)
    assert gap == pytest.approx((-1.0, 1.0))
    assert find_gaps(values, parabolas(values), 4.5) == ()
    # What is above the threshold by no more than fits are good to is none.
    assert find_gaps(values, np.minimum(parabolas(values), 1.005), 1.0) == ()


def test_a_verdict_names_its_gaps() -> None:
    values = np.linspace(-5, 5, 101)
    gaps = find_gaps(values, parabolas(values), 1.0)
    whole = Profile(values, parabolas(values), 2.0, -3.0, 3.0, np.zeros(4))
    words = [Finding(QUANTITIES[0], p, 0.1).words() for p in (whole, replace(whole, gaps=gaps))]
    said = "determined only within a factor of 20: 7.39 N/m (0.0498 to 20.1)"
    assert words == [said, f"{said}, except 0.368 to 2.72 N/m"]


def test_no_limit_is_said_only_of_what_has_none() -> None:
    """A profile that ends between 95 and 99.9 % has no limit, yet not every value fits."""
    likelihood = likelihood_for("liquid_drop_1", 0)
    k = QUANTITIES[:1]
    ((plain,),) = compute_profiles([likelihood], k, smooth=False)
    rise = max(plain.increases[[0, -1]])
    said = []
    for wanted in (2.0, 7.0):
        noise_rad = likelihood.noise_rad * np.sqrt(rise / wanted)
        ((found,),) = compute_profiles([replace(likelihood, noise_rad=noise_rad)], k, smooth=False)
        assert (found.low, found.high) == (None, None)
        assert max(found.increases[[0, -1]]) == pytest.approx(wanted, rel=0.05)
        said.append(Finding(QUANTITIES[0], found, 0.1).words())
    assert said[0] == "not determined: the trace sets no limit within the search range"
    assert said[1].startswith("not determined: towards an end of the search range the fit is worse")
    assert said[1].endswith("and a limit takes 10.8)")


class Parabolas(ConstrainedFits):
    """Fits that stay where they start."""

    def __init__(self) -> None:
        self.best, self.at_best = np.zeros((1, 1)), np.array([2.0])

    def at(
        self, profile: IntArray, targets: Array, near: Array, tolerance: float
    ) -> tuple[Array, Array]:
        """Rises of the parabolas."""
        return parabolas(targets), near


def test_points_are_added_until_a_curve_can_be_drawn() -> None:
    """And at the limits, where a curve has to cross the threshold."""
    values = np.array([-5.0, -3.0, -1.0, 1.0, 2.0, 3.0, 5.0])
    points = Points(Parabolas(), [values])
    points.from_optimum()
    points.smooth(np.array([[-3.0, 3.1]]))
    assert {-3.0, 3.1} <= set(points.values)
    assert np.all(np.diff(points.values) > 0)
    np.testing.assert_allclose(points.increases, parabolas(points.values))
    shown = np.sqrt(np.minimum(points.increases, 16.0))
    assert np.max(np.abs(np.diff(shown))) <= 0.3


def test_limits_tell_of_an_optimum_that_was_missed() -> None:
    right = likelihood_for("liquid_drop_2", 0)
    away = right.best + np.array([0.1, 0.0, 0.02, 0.0])
    misfit_rad = float(right.problem.misfit(np.exp(away)[None])[0])
    missed = replace(right, best=away, misfit_rad=misfit_rad)
    quantities = [QUANTITIES[0], QUANTITIES[4]]
    assert find_limits([right], quantities)[1] == {}
    lower = find_limits([right, missed], quantities)[1]
    assert list(lower) == [1]
    again = refitted(missed, lower[1], 0.95)
    assert again is not None
    assert again.misfit_rad == pytest.approx(right.misfit_rad, rel=1e-9)
    assert refitted(right, right.best, 0.95) is None
    # What is shown of it is what is shown of the right one.
    of_right, of_missed = shown_of([right, missed], quantities, 0.95)
    for one, other in zip(of_right, of_missed, strict=True):
        assert one.verdict == other.verdict == "determined"
        assert one.low == pytest.approx(other.low, rel=1e-5)
        assert one.high == pytest.approx(other.high, rel=1e-5)
