"""The end of a search: what can be set, at the very limits, and no worse than where it began."""

from functools import cache

import numpy as np
import pytest

from biogrip.design.polish import best_of, polish
from biogrip.design.rating import LOST, Rater, Torque
from biogrip.design.schedule import presses, sampled
from biogrip.design.search import best_torques
from biogrip.design.set_values import set_values, torque_of
from biogrip.design.within_reach import plan_within_reach
from biogrip.experiment.protocol import Load, Phase, hold
from biogrip.identify.answer import silent
from tests.design.test_climb import SECOND

# What a search of thousands found for it.
KNOWN = (
    *(hold(79.48, 8e-9), hold(0.01, 5.43e-9), hold(208.4, 8e-9), hold(0.27, 7.695e-9)),
    *(hold(111.8, 7.494e-9), hold(0.04, 7.722e-9)),
)


@cache
def _found() -> Torque:
    return best_torques(SECOND, 128, np.random.default_rng(1), silent)[0]


def _bound(torque: Torque) -> float:
    waveform = torque.waveform
    return Rater(SECOND, margin=0.0).rate(waveform, gap=5e-4, most=100).logarithm


def test_it_is_better_can_be_set_and_is_the_same_again() -> None:
    begun = torque_of(SECOND, (hold(100.0, 8e-9), hold(300.0, 7.5e-9)))
    assert begun is not None
    polished = polish(SECOND, begun, 100, np.random.default_rng(2))
    assert _bound(polished) < _bound(begun) - 0.05
    phases = set_values(SECOND, polished)
    assert presses(SECOND, phases)
    again = torque_of(SECOND, phases)
    assert again is not None
    assert set_values(SECOND, again) == phases
    assert _bound(again) == pytest.approx(_bound(polished), abs=1e-6)
    other = polish(SECOND, begun, 100, np.random.default_rng(2))
    np.testing.assert_array_equal(other.waveform.levels, polished.waveform.levels)


def test_of_no_neighbours_it_is_what_can_be_set() -> None:
    same = polish(SECOND, _found(), 0, np.random.default_rng(2))
    assert set_values(SECOND, same) == set_values(SECOND, _found())


def test_successive_steps_of_one_level_become_one() -> None:
    first, *rest = KNOWN
    apart = torque_of(SECOND, (hold(9.48, 8e-9), hold(70.0, 8e-9), *rest))
    assert apart is not None
    joined = polish(SECOND, apart, 0, np.random.default_rng(2))
    assert set_values(SECOND, joined) == (first, *rest)


def test_contact_is_kept_without_a_margin() -> None:
    """At the limit of contact, by bisection, a search with a margin would lose a train."""
    held, lost = 4000, 1000
    while held - lost > 1:
        middle = (held + lost) // 2
        held, lost = (middle, lost) if presses(SECOND, _released(middle)) else (held, middle)
    at_limit, beyond = (torque_of(SECOND, _released(level)) for level in (held, lost))
    assert at_limit is not None
    assert beyond is not None
    assert best_of(SECOND, [beyond, at_limit], 2) == [at_limit]
    assert Rater(SECOND).rate(at_limit.waveform).logarithm > LOST


def _released(level: int) -> tuple[Phase, ...]:
    return hold(20.0, 8e-9), hold(0.02, float(f"{level}e-12")), hold(379.98, 7e-9)


def test_the_best_come_first() -> None:
    torques = best_torques(SECOND, 128, np.random.default_rng(1), silent)[:6]
    best = best_of(SECOND, torques[::-1], 3)
    bounds = [_bound(each) for each in best]
    assert len(best) == 3
    # Those of what can be set differ by the gap of a rating.
    assert np.all(np.diff(bounds) > -1e-3)


def test_a_configured_train_is_where_a_design_goes_on() -> None:
    """Of a search that is too short to find anything as good as a longer one."""
    _, plan = plan_within_reach(
        SECOND, 128, np.random.default_rng(3), silent, neighbours=60, configured=KNOWN
    )
    bound = SECOND.typical_bound(plan.information)
    assert bound <= SECOND.typical_bound(sampled(SECOND, KNOWN).information)
    _, alone = plan_within_reach(SECOND, 128, np.random.default_rng(3), silent, neighbours=60)
    assert bound < 0.98 * SECOND.typical_bound(alone.information)


@pytest.mark.parametrize(
    "phases",
    [
        (),
        (hold(400.0, 0.0),),
        (hold(399.0, 8e-9),),
        (hold(399.995, 8e-9), hold(0.005, 1e-9)),
        (hold(200.0, 8.1e-9), hold(200.0, 1e-9)),
        (hold(200.0, 8e-9), hold(200.0, 1e-9, 2e-9)),
        (Phase(200.0, Load(1e-9, 1e-11), Load(1e-9, 1e-11)), hold(200.0, 8e-9)),
        tuple(hold(40.0, 1e-9 * (1 + k % 2)) for k in range(10)),
    ],
    ids=["none", "zero", "short", "off-grid", "large", "unlike", "ramp", "many"],
)
def test_what_a_search_could_not_find_is_no_start(phases: tuple[Phase, ...]) -> None:
    assert torque_of(SECOND, phases) is None
