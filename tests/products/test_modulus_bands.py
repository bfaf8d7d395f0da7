"""Bands of moduli, from the judged fit to the figure and the table; a rejected fit has none."""

import json
from pathlib import Path

import numpy as np
import pytest

from biogrip.products.figures.modulus_bands import MODULUS_BANDS
from biogrip.products.files.modulus_profiles import PATH, read_modulus_profiles
from biogrip.products.files.rows import read_table
from biogrip.products.files.verdicts import PATH as VERDICTS
from biogrip.products.plan import Plan
from biogrip.products.stages.judgement import JUDGED
from biogrip.products.stages.measurement import MEASUREMENT
from biogrip.products.stages.modulus_profiles import MODULUS_PROFILES, frequencies
from biogrip.products.stages.target import TARGET
from biogrip.products.tables.modulus_bands import MODULUS_BANDS_TABLE
from tests.helpers.default import plan_of, study_of

CASE = {"case": "solid"}
TEXT = """
seeds: 1
methods: [least_squares]
identifiability: {moduli: true}
measurement: {rate_Hz: 0.5}
only: [solid]
cases:
  solid: {sample: {model: kelvin_voigt, k_p: 0.3, c_p: 3.0}}
"""


@pytest.fixture
def plan(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Plan:
    monkeypatch.chdir(tmp_path)
    plan = Plan(study_of(TEXT), Path("results"))
    TARGET.run(plan, CASE)
    MEASUREMENT.run(plan, CASE | {"batch": "seeds_0-0"})
    JUDGED.run(plan, CASE)
    return plan


def rows_of(plan: Plan) -> list[dict[str, str]]:
    MODULUS_PROFILES.run(plan, CASE)
    MODULUS_BANDS_TABLE.run(plan, {})
    MODULUS_BANDS.run(plan, CASE)
    assert Path("results/figures/modulus_bands_solid.png").stat().st_size > 10_000
    return read_table(Path("results/tables/modulus_bands.csv"))


def test_bands_are_those_of_the_judged_fit(plan: Plan) -> None:
    rows = rows_of(plan)
    judged = json.loads(Path(VERDICTS.format(**CASE)).read_text(encoding="utf-8"))
    spring, damper = judged["quantities"]
    for row in rows:
        omega = float(row["frequency_rad_per_s"])
        own, factor = (spring, 1.0) if row["modulus"] == "G'" else (damper, omega)
        assert float(row["value"]) == pytest.approx(factor * own["value"], rel=1e-3)
        width = factor * (own["high"] - own["low"])
        for end in ("low", "high"):
            assert float(row[end]) == pytest.approx(factor * own[end], abs=0.01 * width)
        assert float(row["target"]) == pytest.approx(
            0.3 if own is spring else 3.0 * omega, rel=1e-5
        )
        assert float(row["half_width_percent"]) == pytest.approx(
            50 * width / (factor * own["value"]), rel=0.02
        )


def test_a_rejected_fit_has_no_limits(plan: Plan) -> None:
    file = Path(VERDICTS.format(**CASE))
    judged = json.loads(file.read_text(encoding="utf-8"))
    file.write_text(json.dumps(judged | {"fit": "rejected"}), encoding="utf-8")
    rows = rows_of(plan)
    assert {row["fit"] for row in rows} == {"rejected"}
    assert {row["low"] + row["high"] + row["half_width_percent"] for row in rows} == {""}
    assert len(read_modulus_profiles(Path(PATH.format(**CASE)))["moduli"]) == len(rows)


def test_only_cases_that_ask_for_bands_have_them() -> None:
    """The default study has none: they would take half of its minute."""
    of_one = plan_of("cases: {liquid_drop_2: {identifiability: {moduli: true}}}")
    for product in (MODULUS_PROFILES, MODULUS_BANDS):
        assert list(product.jobs(plan_of())) == []
        assert list(product.jobs(of_one)) == [{"case": "liquid_drop_2"}]
    assert list(MODULUS_BANDS_TABLE.jobs(plan_of())) == []
    (limits,) = MODULUS_BANDS_TABLE.inputs(of_one, {})["limits"]
    assert limits == PATH.format(case="liquid_drop_2")


def test_frequencies_reach_a_decade_beyond_the_experiment() -> None:
    """From a tenth of one over its length to ten times one over the time between readings."""
    found = frequencies(np.array([0.0, 1.0, 3.0, 1000.0]))
    assert found[[0, -1]] == pytest.approx([1e-4, 10.0])
    assert np.diff(np.log10(found)) == pytest.approx(0.5)
