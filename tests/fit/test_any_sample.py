"""Deviations in proportion to what is read, of a trace whose sample has no model yet."""

from dataclasses import replace
from math import gamma
from typing import Any

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.fit.any_sample import fit_any_sample, proportional_deviations
from biogrip.library import set_up
from biogrip.physics.instruments import INSTRUMENTS
from biogrip.physics.models import Sample
from biogrip.physics.protocol import hold
from tests.helpers.default import STUDY
from tests.helpers.problems import clean, run

CLEAN_S, CLEAN = clean("endothelial_cell", 2.0)


def deviations(trace: Array, share: float = 0.05, **given: Any) -> Array:
    problem = replace(STUDY.cases["endothelial_cell"].experiment, noise_share=share, **given)
    return proportional_deviations(problem, CLEAN_S, trace)


def test_deviations_follow_the_rotation_without_its_noise() -> None:
    """Each reading has noise of 5 %; the smooth rotation is known far better."""
    rng = np.random.default_rng(0)
    found = deviations(CLEAN * (1 + 0.05 * rng.standard_normal(len(CLEAN_S))))
    large = np.quantile(CLEAN, 0.1) < CLEAN
    errors = np.abs(found[large] / (0.05 * CLEAN[large]) - 1)
    assert np.median(errors) < 0.05 / 3
    assert np.quantile(errors, 0.99) < 0.05


def test_no_reading_is_certain() -> None:
    """Of a trace without noise: the first rotation is zero, and counts as one of the smallest."""
    assert CLEAN[0] == 0
    smallest = np.sort(CLEAN)[: len(CLEAN) // 10]
    assert deviations(CLEAN).min() == pytest.approx(0.05 * np.median(smallest), rel=0.01)


@pytest.mark.parametrize(("share", "of_peak"), [(1e-3, 0.3), (0.02, 0.02)])
def test_other_noise_shows_where_the_rotation_is_small(share: float, of_peak: float) -> None:
    """Far above the share, and by so much that chance does not explain it."""
    rng = np.random.default_rng(1)
    floor = of_peak * float(CLEAN.max())
    proportional = CLEAN * (1 + share * rng.standard_normal(len(CLEAN_S)))
    found = deviations(proportional + floor * rng.standard_normal(len(CLEAN_S)), share)
    # Some eighty readings tell the scatter.
    assert found.min() == pytest.approx(floor, rel=0.3)


def test_other_noise_that_is_given_is_added() -> None:
    floor = 0.3 * float(CLEAN.max())
    given = deviations(CLEAN, noise_sd=floor)
    np.testing.assert_allclose(given, np.hypot(0.05 * CLEAN, floor), rtol=1e-3)


def test_an_offset_is_not_rotation() -> None:
    found = deviations(CLEAN + 3 * CLEAN.max(), offset=True)
    large = np.quantile(CLEAN, 0.2) < CLEAN
    np.testing.assert_allclose(found[large], 0.05 * CLEAN[large], rtol=0.1)


def test_of_readings_against_the_load_nothing_is_fitted() -> None:
    residuals = STUDY.cases["endothelial_cell"].experiment.of(CLEAN_S, -CLEAN).residuals
    fit = fit_any_sample(residuals)
    assert not fit.amplitudes.any()
    left, basis = fit.left_of_readings()
    np.testing.assert_array_equal(left, -CLEAN)
    assert basis.shape == (0, len(CLEAN))


def test_the_published_fit_comes_out_to_five_digits() -> None:
    """That of polystyrene at 190 degC in pyRheo, with weights of 5 % of the compliance."""
    v, beta, eta = 25856.7, 0.4223, 68281.1
    times = np.geomspace(1.0, 1e4, 120)
    compliance = times / eta + times**beta / (v * gamma(1 + beta))
    creep = set_up(INSTRUMENTS["compliance"], (hold(1e4, 1.0),), Sample("fractional_maxwell"))
    posed = creep.weighted(0.05 * compliance).of(times, compliance)
    assert run("least_squares", posed).parameters == pytest.approx([v, beta, eta], rel=5e-6)


def test_a_plateau_is_no_noise() -> None:
    """A relaxation that ends at a plateau, of which deviations are a share as of all else."""
    times = np.geomspace(1.0, 1e3, 100)
    smooth = 800 + 700 * np.exp(-times / 20)
    readings = smooth * (1 + 0.01 * np.random.default_rng(0).standard_normal(len(times)))
    relaxation = set_up(INSTRUMENTS["modulus"], (hold(1e3, 1.0),), Sample("zener_maxwell"))
    found = proportional_deviations(replace(relaxation, noise_share=0.01), times, readings)
    assert found == pytest.approx(0.01 * smooth, rel=0.02)
