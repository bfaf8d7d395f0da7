from collections.abc import Mapping
from textwrap import dedent
from typing import Any

import pytest

from biogrip.tables.mechanics import contact_loss, linear_cases
from tests.helpers.default import study_of


def rows_of(overlay: str) -> dict[tuple[str, str], Mapping[str, Any]]:
    study = study_of(f"seeds: 3\n{dedent(overlay)}")
    found = contact_loss(study.of(linear_cases(study)))
    return {(row["case"], row["quantity"]): row for row in found.rows}


def test_what_nobody_notices_is_taken_for_the_sample() -> None:
    found = rows_of(
        """
        least_squares: {candidates: 200, starts: 4}
        cases: {bent: {sample: {model: damper, c_p: 9.0}, models: {target: nonlinear}}}
        """
    )
    # The cell is pressed throughout, and what is not linear is left out.
    drops = {"liquid_drop_1", "liquid_drop_2"}
    assert {case for case, _ in found} == drops
    for case in drops:
        total, misfit = found[case, "c + c_p"], found[case, "misfit"]
        assert total["lost_at_s"] == pytest.approx(200)
        # Of 2001 samples with 10 % noise the sum is known to 1 %; four times that is allowed.
        assert total["held"] == pytest.approx(10, rel=0.03)
        assert total["until_lost"] == pytest.approx(10, rel=0.04)
        assert total["error_percent"] > 30
        assert misfit["let_go"] > 1.4
        assert misfit["until_lost"] == pytest.approx(1, abs=0.02)


def test_a_sample_that_is_lost_at_once_tells_nothing() -> None:
    found = rows_of(
        """
        measurement: {rate_Hz: 0.1}
        only: [brief]
        protocol:
          phases: [{duration_s: 5, torque_Nm: 1.6e-9}, {duration_s: 300, torque_Nm: 0}]
        cases: {brief: {sample: {model: damper, c_p: 9.0}}}
        """
    )
    assert "until_lost" not in found["brief", "c_p"]
    assert found["brief", "misfit"]["until_lost"] is None
