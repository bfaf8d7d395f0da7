"""What printed values and errors leave: ends worked out by hand."""

from typing import Any

import pytest

from biogrip.tables.cases import interval_of, interval_of_value, value_in_case
from tests.helpers.default import STUDY


@pytest.mark.parametrize(
    ("printed", "target", "error", "ends"),
    [
        # 10 (1 - 0.027) to 10 (1 - 0.0255): two digits are too few, for 9.7 errs by 3 %.
        (9.7, 10.0, "2.6", (9.73, 9.745)),
        (0.97, 1.0, "2.6", (0.973, 0.9745)),
        # 35 (1 - 0.062) to 35 (1 - 0.0605).
        (32.8, 35.0, "6.1", (32.83, 32.8825)),
        # The error is cut off: rounded, it would be 0.9. 299.9 * 1.009 = 302.5991.
        (302.5, 299.9, "-0.8", (302.45, 302.5991)),
        # A sign that belies its value tells no side.
        (6.7, 9.5, "-29", (6.65, 6.7925)),
        # No number, or one that the value belies, leaves the value alone.
        (1e-4, 1e-3, ">100", (5e-5, 2e-4)),
        (5.5, 10.0, "3", (5.45, 5.6)),
        (5.5, None, None, (5.45, 5.6)),
        (5.5, 0.0, "3", (5.45, 5.6)),
    ],
)
def test_a_value_and_its_error_leave_an_interval(
    printed: float, target: Any, error: Any, ends: tuple[float, float]
) -> None:
    assert interval_of(printed, target, error) == pytest.approx(ends, rel=1e-12)


def test_a_value_alone_is_rounded_or_cut_off() -> None:
    assert interval_of_value(0.23) == pytest.approx((0.225, 0.24))


def test_of_dampers_that_trade_the_sum_is_ten() -> None:
    """9.7375 + 0.23, and 9.7375 + 0.25: c has the printed error, c_p none."""
    for name, value in (("liquid_drop_1", 9.9675), ("liquid_drop_2", 9.9875)):
        told = value_in_case(STUDY.cases[name], ["c", "c_p"])
        assert told
        assert told[0] == pytest.approx(value)
        assert told[1] < told[0] < told[2]
    assert value_in_case(STUDY.cases["liquid_drop_1"], ["alpha"]) is None
