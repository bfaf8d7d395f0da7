"""What no torque tells is left out of what is asked."""

from dataclasses import replace

import numpy as np
import pytest

from biogrip.design.experiment import NO_BOUND, relative_bounds
from biogrip.design.schedule import planned
from biogrip.design.search import best_torques
from biogrip.design.waveform import Limits
from biogrip.design.within_reach import plan_within_reach
from biogrip.errors import BiogripError
from biogrip.identify.answer import silent
from tests.design.test_plan import DROP

# The drop's c_p resists for milliseconds, a reading comes every 50 ms.
SLOW = replace(
    DROP,
    parameters=np.array([[9.5, 1.0, 10.0, 1e-2]]),
    fastest_Hz=20.0,
    limits=Limits(400.0, 0.5, 8, 0.05),
)


def test_what_can_be_told_is_asked_as_ever() -> None:
    inputs, plan = plan_within_reach(DROP, 128, np.random.default_rng(1), silent)
    assert inputs is DROP
    again = planned(DROP, best_torques(DROP, 128, np.random.default_rng(1), silent))
    assert (plan.phases, plan.bursts) == (again.phases, again.bursts)
    np.testing.assert_array_equal(DROP.bounds(plan.information), relative_bounds(plan.information))


@pytest.mark.parametrize("targets", [(0, 1, 2, 3), (0, 1, 2)])
def test_a_parameter_that_no_torque_tells_is_left_out(targets: tuple[int, ...]) -> None:
    """Asked for or not, it would take the bounds of those that it trades against with it."""
    slow = replace(SLOW, criterion=replace(SLOW.criterion, targets=targets))
    inputs, plan = plan_within_reach(slow, 128, np.random.default_rng(1), silent)
    assert inputs.out_of_reach == (3,)
    assert inputs.criterion.targets == (0, 1, 2)
    bounds = inputs.bounds(plan.information)[0]
    assert bounds[3] > 10 * NO_BOUND
    without = plan.information - inputs.before
    np.testing.assert_array_equal(relative_bounds(without)[0] == np.inf, [1, 0, 1, 1])
    known = relative_bounds(without[:, :3, :3])[0]
    # c_p is a thousandth of c: to a factor of e to the tenth it moves c by 1 %, k by some 2 %.
    # Of k_p both are the same but for rounding.
    assert np.all((known * (1 - 1e-9) <= bounds[:3]) & (bounds[:3] < known + 0.03))


def test_what_is_taken_to_be_known_is_no_part_of_a_bound() -> None:
    """Two parameters that are told apart, one of them to a factor of e to the third."""
    before = np.zeros((4, 4))
    before[3, 3] = NO_BOUND**-2
    inputs = replace(DROP, before=before, out_of_reach=(3,))
    information = np.diag([4.0, 4.0, 4.0, 1 / 9]) + before
    np.testing.assert_allclose(inputs.bounds(information[None])[0], [0.5, 0.5, 0.5, 3.0])


def test_where_nothing_that_is_asked_can_be_told_it_says_so() -> None:
    inputs = replace(SLOW, criterion=replace(SLOW.criterion, targets=(3,)))
    with pytest.raises(BiogripError, match=r"readings at 20 Hz tell c_p, .*`fastest_Hz`"):
        plan_within_reach(inputs, 128, np.random.default_rng(1), silent)
