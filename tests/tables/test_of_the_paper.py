"""Tables that hold the paper and its model against what can be written down by hand."""

import math
from pathlib import Path

import numpy as np
import pytest

from biogrip.fit.genome import GeneRange
from biogrip.physics.actuator import torque
from biogrip.physics.models import Published, Sample, Truth
from biogrip.records.identifications import DIFFERENCES
from biogrip.tables import evidence
from biogrip.tables import evidence as printed_values
from biogrip.tables import mechanics as left_out
from biogrip.tables.layout import Cell, Table
from biogrip.tables.mechanics import linearisation
from tests.helpers.default import STUDY, seen


def rows_of(made: Table) -> list[dict[str, Cell]]:
    names = [column.name for column in made.columns]
    return [dict(zip(names, row, strict=True)) for row in made.rows]


def test_distances_of_printed_values_are_shares_of_them() -> None:
    """Of 0.5 and 2.2, where 1.1 to 9.9 can be encoded."""
    published = Published(table=9, identified={"k_p": 2.2}, error_percent={"k_p": "-340"})
    truth = Truth("A spring", Sample("kelvin_voigt"), {"k_p": 0.5, "c_p": 0.0}, published)
    ranges = {"k_p": GeneRange((1, 1), (1, 9))}
    study = seen(cases={"spring": seen(truth=truth)}, ranges=ranges)
    target, identified = rows_of(printed_values.printed_values(study))
    assert (target["nearest_encodable"], target["within_range"]) == (1.1, "no")
    assert target["distance_percent"] == pytest.approx(-120)
    assert (identified["distance_percent"], identified["within_range"]) == (0, "yes")
    assert identified["recomputed_error_percent"] == pytest.approx(-340)


def test_the_linearisation_is_held_against_one_percent(tmp_path: Path) -> None:
    """Differences that go with the square of the torque, from a half to four times it."""
    differences = tmp_path / "differences.csv"
    rows = [("cell", 75.0, factor, 0.002 * factor**2) for factor in (0.5, 2.0, 4.0)]
    DIFFERENCES.write(differences, rows)
    (found,) = rows_of(linearisation(STUDY, differences))
    assert found["difference_percent"] == pytest.approx(0.2)
    assert found["factor_for_1_percent"] == pytest.approx(math.sqrt(5))


def test_a_damper_between_both_jaws_damps_a_rotation_twice() -> None:
    """Both arms close by b phi, so the damper by 2 b phi, and each arm's lever is b."""
    drop = seen(sample=Sample("kelvin_voigt"), parameters={"k_p": 0.5, "c_p": 11.0})
    study = seen(
        gripper=STUDY.gripper,
        actuator=STUDY.actuator,
        phases=STUDY.phases,
        gripped=["drop"],
        cases={"drop": drop},
    )
    rows = rows_of(left_out.left_out(study))
    (found,) = (row for row in rows if str(row["beside"]).startswith("the sample's"))
    b = 1.5e-3 * math.sin(math.radians(75))
    assert found["beside_size"] == pytest.approx(b * 11.0 * 2 * b)


def test_the_voltage_of_the_full_stroke_turns_a_free_arm_by_it() -> None:
    rows = rows_of(evidence.evidence(STUDY, [], [], []))
    (found,) = (row for row in rows if str(row["quantity"]).startswith("voltage for the full"))
    volts = np.array(found["this_study"], dtype=float)
    assert float(torque(STUDY.actuator, volts)) / 4.4e-7 == pytest.approx(4.5 * math.pi / 180)
