"""A trace's problem posed for another model is what it is if posed for that at once."""

import numpy as np
import pytest

from biogrip.fit.case_problem import CaseProblem
from biogrip.physics.misfit import SeriesMisfit
from biogrip.physics.models import CANDIDATES
from tests.helpers.default import study_of
from tests.helpers.problems import clean

TIMES, RESPONSE = clean("liquid_drop_2")
TRACE = RESPONSE * np.random.default_rng(3).normal(1.0, 0.1, len(TIMES))


@pytest.mark.parametrize("name", CANDIDATES)
@pytest.mark.parametrize(("block", "by_series"), [("", True), ("{offset: true}", False)])
def test_it_is_the_same_to_the_last_bit(name: str, block: str, by_series: bool) -> None:
    case_problem: CaseProblem = (
        study_of(block and f"measurement: {block}").case("liquid_drop_2").problem
    )
    model = CANDIDATES[name].model
    first = case_problem.of(TIMES, TRACE)
    assert isinstance(first.misfit, SeriesMisfit) == by_series
    ours, fresh = case_problem.for_model(first, model), case_problem.of(TIMES, TRACE, model)
    low, high = fresh.low, fresh.high
    assert (ours.low.tolist(), ours.high.tolist()) == (low.tolist(), high.tolist())
    assert (ours.genome.low.tolist(), ours.genome.sizes) == (
        fresh.genome.low.tolist(),
        fresh.genome.sizes,
    )
    points = np.random.default_rng(4).uniform(low, high, (40, len(low)))
    np.testing.assert_array_equal(ours.misfit(np.exp(points)), fresh.misfit(np.exp(points)))
    for one, other in zip(ours.residuals(points[0]), fresh.residuals(points[0]), strict=True):
        np.testing.assert_array_equal(one, other)
    # And the first is what it was.
    again = case_problem.of(TIMES, TRACE)
    sample = np.exp(0.5 * (first.low + first.high))[None]
    assert first.misfit(sample) == again.misfit(sample)
