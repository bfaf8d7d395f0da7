"""The paper's numbers beside each other, and beside those of the study."""

import math
from typing import Any

import numpy as np
import pytest

from biogrip.fit.genome import GeneRange
from biogrip.physics.gripper import torque
from biogrip.physics.models import Published
from tests.helpers.default import STUDY, seen
from workflow.paper.evidence import evidence, printed_values, sampling_evidence

CASES: Any = STUDY.of(STUDY.published)


def test_distances_of_printed_values_are_shares_of_them() -> None:
    """Of 0.5 and 2.2, where 1.1 to 9.9 can be encoded."""
    published = Published(table=9, identified={"k_p": 2.2}, error_percent={"k_p": "-340"})
    spring = seen(parameters={"k_p": 0.5, "c_p": 0.0}, published=published)
    ranges = {name: GeneRange((1, 1), (1, 9)) for name in ("k_p", "c_p")}
    study = seen(cases={"spring": spring}, ranges=ranges)
    target, identified = printed_values(study).rows
    assert (target["nearest_encodable"], target["within_range"]) == (1.1, "no")
    assert target["distance_percent"] == pytest.approx(-120)
    assert (identified["distance_percent"], identified["within_range"]) == (0, "yes")
    assert identified["recomputed_error_percent"] == pytest.approx(-340)
    assert (identified["encodable"], identified["printed_from"]) == ("yes", pytest.approx(2.1975))


def test_the_voltage_of_the_full_stroke_turns_a_free_arm_by_it() -> None:
    rows = {row["quantity"]: row for row in evidence(STUDY.of([]), []).rows}
    volts = np.array(rows["voltage for the full stroke, no sample"]["this_study"])
    assert float(torque(STUDY.actuator, volts)) / 4.4e-7 == pytest.approx(4.5 * math.pi / 180)


def test_errors_are_held_against_bounds_of_what_the_traces_determine() -> None:
    rows = sampling_evidence(CASES).rows
    assert [(row["case"], row["parameter"]) for row in rows] == [
        *(("endothelial_cell", name) for name in ("k", "k_p", "c")),
        *(("liquid_drop_1", name) for name in ("k", "c + c_p")),
        *(("liquid_drop_2", name) for name in ("k", "c + c_p")),
        *(("all", name) for name in ("error / bound", "rates (Hz)")),
    ]
    # c + c_p of Table 6 is 9.7375 + 0.23, c by its error; 100 (10.0001 - 9.9675) / 10.0001
    assert rows[4]["paper_error_percent"] == pytest.approx(0.325997, rel=1e-5)
    names = [name for name in rows[0] if name.startswith("bound_percent")]
    errors = np.array([row["paper_error_percent"] for row in rows[:-2]])
    for name in names:
        bounds = np.array([row[name] for row in rows[:-2]])
        assert rows[-2][name] == pytest.approx(np.sqrt(np.mean((errors / bounds) ** 2)))
    # Middle 95 % of chi-squared of seven: 1.690 to 16.013; at 10 Hz it is seven times the square.
    at_10_Hz = 7 * rows[-2]["bound_percent_10_Hz"] ** 2
    ends = [rows[-1][f"paper_error_{end}_percent"] for end in ("from", "to")]
    assert ends == pytest.approx([10 * 1.690 / at_10_Hz, 10 * 16.013 / at_10_Hz], rel=1e-3)
    for row in rows[:-2]:
        # Infinite where so few samples carry no information.
        bounds = np.array([row[name] for name in names])
        told = bounds[np.isfinite(bounds)]
        assert np.all(told[:-1] / told[1:] > 2)
        # Ten times the samples, from 1 to 10 Hz; elsewhere times are too coarse, or so fine that
        # more is seen of k.
        if np.isfinite(bounds[1]):
            assert bounds[1] / bounds[2] == pytest.approx(np.sqrt(10), rel=0.05)
