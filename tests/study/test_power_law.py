"""Keys of power-law samples: what is refused, and in which words."""

from pathlib import Path

import pytest

from biogrip.digits import with_unit
from biogrip.errors import BiogripError
from tests.helpers.places import ROOT
from tests.study.test_config import load

SOLID = "model: fractional_kelvin_voigt, k_p: 0.3, k_alpha: 10.0"
LONG = "protocol: {phases: [{duration_s: 2e5, torque_Nm: 1e-9}]}, measurement: {rate_Hz: 0.01}"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            f"cases: {{cell: {{sample: {{{SOLID}, alpha: 1.0}}}}}}",
            "cases.cell.sample.alpha: found 1, allowed is above 0 and below 1.",
        ),
        (
            f"cases: {{cell: {{sample: {{{SOLID}, alpha: 0.0}}}}}}",
            "cases.cell.sample.alpha: found 0, allowed is at least 1e-18.",
        ),
        (
            f"cases: {{cell: {{sample: {{{SOLID}, alpha: 0.001}}}}}}",
            "cases.cell.sample.alpha: found 0.001, which is not searched for; allowed is 0.01 to "
            "1, or another search_range.",
        ),
        (
            "search_range: {alpha: {exponent: [-1, 1]}}",
            "search_range.alpha.exponent: found 1, which makes exponents of springpots above 1; "
            "allowed is at most 0.",
        ),
        (
            f"cases: {{cell: {{sample: {{{SOLID}, alpha: 0.3}}, {LONG}}}}}",
            "cases.cell.sample.model: found a protocol of 200000 s, allowed are at most 100000 s "
            "with fractional_kelvin_voigt.",
        ),
        (
            "model_selection: {models: [damper, fractional_maxwell]}\n"
            f"cases: {{cell: {{sample: {{model: damper, c_p: 1.0}}, {LONG}}}}}",
            "model_selection.models[1]: found fractional_maxwell and a protocol of 200000 s, "
            "allowed are at most 100000 s with it.",
        ),
        (
            f"cases: {{cell: {{sample: {{{SOLID}, alpha: 0.3}}, measurement: {{rate_Hz: 2e5}},"
            " protocol: {phases: [{duration_s: 0.1, torque_Nm: 1e-9}]}}}",
            "cases.cell.measurement.rate_Hz: found 200000, allowed is at most 100000 Hz with "
            "fractional_kelvin_voigt.",
        ),
        (
            "search_range: {k: {digit: [0, 0]}}",
            "search_range.k.digit: found [0, 0], allowed is a highest digit of at least 1.",
        ),
    ],
)
def test_what_no_springpot_can_be_is_refused(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(BiogripError) as refused:
        load(tmp_path, text)
    assert message in str(refused.value)


def test_the_study_of_power_law_cells_compares_springpots_with_branches(tmp_path: Path) -> None:
    study = load(tmp_path, (ROOT / "config" / "power_law.yaml").read_text(encoding="utf-8"))
    assert {case.sample.name for case in study.cases.values()} == {
        "fractional_kelvin_voigt",
        "fractional_maxwell",
        "liquid_drop",
    }
    for case in study.cases.values():
        assert {"generalized_maxwell", "fractional_maxwell"} <= set(case.models)


def test_a_number_without_a_unit_is_written_without_brackets() -> None:
    assert with_unit("k", "N/m") == "k (N/m)"
    assert with_unit("alpha", "") == "alpha"
