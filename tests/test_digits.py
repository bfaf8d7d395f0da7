"""Numbers as they are written."""

import pytest

from biogrip.digits import rounded


@pytest.mark.parametrize(
    ("value", "found"),
    [(1.16499, 1.16499), (1.164996, 1.164996), (1.165, 1.165), (1.2345678, 1.2346), (None, None)],
)
def test_what_is_rounded_again_comes_out_as_if_once(value: float, found: float) -> None:
    assert rounded(value) == found
    assert value is None or f"{rounded(value):.3g}" == f"{value:.3g}"


def test_a_value_on_the_edge_keeps_few_digits() -> None:
    """Where last bits of a processor would decide, digits end somewhere."""
    assert rounded(1.165 - 1e-14) == 1.165
