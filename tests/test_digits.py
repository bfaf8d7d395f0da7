from biogrip.digits import instant, legible, p_value, plain, rounded, with_limits


def test_what_is_rounded_again_comes_out_as_if_once() -> None:
    """On the edge, where last bits of a processor would decide, digits end somewhere."""
    shown = {1.16499: 1.16499, 1.164996: 1.164996, 1.165: 1.165, 1.2345678: 1.2346}
    assert {value: rounded(value) for value in shown} == shown
    assert [f"{rounded(value):.3g}" for value in shown] == [f"{value:.3g}" for value in shown]
    assert (rounded(None), rounded(1.165 - 1e-14)) == (None, 1.165)
    # Six digits are enough of the first, and five of these six.
    assert rounded(25.185482) == rounded(25.1855) == 25.186


def test_numbers_are_as_fine_as_the_width_of_their_limits() -> None:
    for written, limits, words in (
        (with_limits, (2e-4, 1.96e-4, 2.04e-4), "0.000200 (0.000196 to 0.000204)"),
        (with_limits, (0.32, 0.31968, 0.32051), "0.3200 (0.3197 to 0.3205)"),
        (with_limits, (1500, 1490, 1520), "1500 (1490 to 1520)"),
        (with_limits, (2.21e4, 2.2071e4, 2.2132e4), "22100 (22070 to 22130)"),
        (with_limits, (3, 0.0512, 41.3), "3 (0.051 to 41)"),
        (with_limits, (1.2345e-5, 1.2e-5, 1.3e-5), "1.23e-05 (1.20e-05 to 1.30e-05)"),
        (with_limits, (5e8, 4.99999e8, 5.00001e8), "5.000000e+08 (4.999990e+08 to 5.000010e+08)"),
        (with_limits, (1.0, 1.0, 1.0), "1.000000 (1.000000 to 1.000000)"),
        # Of an instant the nearer limit counts.
        (instant, (8.51, 8.4, 8.63), "8.51 s (8.40 to 8.63)"),
        (instant, (5.0, -17.3, 5.3), "5.00 s (-17.30 to 5.30)"),
        (instant, (-0.2, -17.3, -0.2), "0 s (-17 to 0)"),
        (instant, (5.0, 5.0, 5.0), "5.0000000 s (5.0000000 to 5.0000000)"),
    ):
        assert written(*limits) == words


def test_decimals_are_plain_where_a_person_reads_them() -> None:
    numbers = [1500.4, 123456, 2.5e6, 1.04e-4, 1.04e-5, -1500, 0]
    assert " ".join(map(plain, numbers)) == "1500 123000 2.5e+06 0.000104 1.04e-05 -1500 0"
    assert [*map(p_value, (0.0018, 3e-5, 1e-9))] == ["p = 0.002", "p = 3e-05", "p < 1e-6"]


def test_powers_minus_signs_and_units_are_as_in_print() -> None:
    for text, found in (
        ("1.20e-05 N s/m", "1.20·10⁻⁵~N~s/m"),
        ("-2.9e+02 % of 3.36e+03", "−290~% of 3360"),
        ("-1.1e+07 (-0.87 %)", "−1.1·10⁷ (−0.87~%)"),
        ("k (N s/m), 5-95 of c-2 in section 4", "k (N~s/m), 5-95 of c-2 in section 4"),
    ):
        assert legible(text).replace("\xa0", "~") == found
