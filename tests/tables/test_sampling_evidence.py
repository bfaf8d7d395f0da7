from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from biogrip.tables.evidence import sampling_evidence
from tests.helpers.default import STUDY, seen

CASES: Any = STUDY.of(STUDY.published)


def test_rows_are_what_the_traces_determine() -> None:
    rows = sampling_evidence(CASES).rows
    assert [row[:2] for row in rows] == [
        ("endothelial_cell", "k"),
        ("endothelial_cell", "k_p"),
        ("endothelial_cell", "c"),
        ("liquid_drop_1", "k"),
        ("liquid_drop_1", "c + c_p"),
        ("liquid_drop_2", "k"),
        ("liquid_drop_2", "c + c_p"),
        ("all", "error / bound"),
    ]
    # 100 (10.0001 - 9.93) / 10.0001
    assert rows[4][2] == pytest.approx(0.700993, rel=1e-5)


def test_the_last_row_is_the_root_mean_square_of_those_above() -> None:
    rows = sampling_evidence(CASES).rows
    numbers = np.array([row[2:] for row in rows[:-1]], dtype=float)
    wanted = [np.sqrt(np.mean((numbers[:, 0] / column) ** 2)) for column in numbers[:, 1:].T]
    np.testing.assert_allclose(np.array(rows[-1][3:], dtype=float), wanted)


def test_ten_times_the_samples_are_worth_about_the_root_of_ten() -> None:
    """From 1 to 10 Hz; elsewhere times are too coarse, or so fine that more is seen of k."""
    for row in sampling_evidence(CASES).rows[:-1]:
        # Infinite where so few samples carry no information.
        bounds = np.array(row[3:], dtype=float)
        told = bounds[np.isfinite(bounds)]
        assert np.all(told[:-1] / told[1:] > 2)
        if np.isfinite(bounds[1]):
            assert bounds[1] / bounds[2] == pytest.approx(np.sqrt(10), rel=0.05)


def test_what_the_paper_does_not_give_has_no_row() -> None:
    case = CASES.cases["liquid_drop_2"]
    published = replace(case.truth.published, identified={"k": 0.97, "c": 9.7})
    truth = replace(case.truth, published=published)
    changed = seen(truth=truth, problem=case.problem, noise=case.noise)
    rows = sampling_evidence(seen(cases={**CASES.cases, "liquid_drop_2": changed})).rows
    assert [row[1] for row in rows if row[0] == "liquid_drop_2"] == ["k", "c"]
    assert sampling_evidence(seen(cases={})).rows == []
