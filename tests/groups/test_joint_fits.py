"""Replicates of one cell, against SciPy on the stacked residuals and against a single trace."""

from collections.abc import Sequence

import numpy as np
import pytest
from scipy.optimize import least_squares

from biogrip.arrays import Array
from biogrip.groups.joint_fit import JointFit, fitted_jointly
from biogrip.groups.replicates import JointResiduals, joint_problem
from biogrip.identifiability.diagnosis import diagnose
from biogrip.identifiability.limits import find_limits
from biogrip.identify.answer import Identification
from biogrip.identify.local_fits import LocalFits
from biogrip.identify.problem import Problem
from biogrip.response.linear import rotation, step_response
from tests.helpers.problems import (
    GRIPPER,
    MODEL,
    SAMPLES,
    TORQUE,
    condensed_rows,
    posed_for,
    problem_alone,
    run,
)

CELL = "endothelial_cell"


def traces(
    noises: Sequence[float],
    rates: Sequence[int],
    scales: Sequence[float] | None = None,
    seed: int = 3,
) -> list[Problem]:
    """Traces of one cell with noises in shares of the peak, sampled so many times."""
    truth = np.array([[SAMPLES[CELL][name] for name in MODEL.names]])
    made = []
    for index, (noise, count) in enumerate(zip(noises, rates, strict=True)):
        times = np.linspace(0, 400, count)
        scaled = truth * (scales[index] if scales else 1.0)
        clean = rotation(step_response(GRIPPER, MODEL.network(scaled)), TORQUE, times)[0]
        rng = np.random.default_rng([seed, index])
        trace = clean + noise * clean.max() * rng.standard_normal(count)
        made.append(posed_for(MODEL, times, trace))
    return made


def fitted(problems: list[Problem], noise_rad: float | None = None) -> JointFit:
    def identify(problem: Problem) -> Identification:
        return run("least_squares", problem)

    known = None if noise_rad is None else [noise_rad] * len(problems)
    return fitted_jointly(problems, MODEL, identify, confidence=0.95, noise_rad=known)


@pytest.fixture(scope="module")
def uneven() -> list[Problem]:
    return traces([0.02, 0.1, 0.3], [401, 801, 201])


@pytest.fixture(scope="module")
def told(uneven: list[Problem]) -> JointFit:
    return fitted(uneven)


def stacked(problems: list[Problem], noise_rad: Sequence[float], x: Array) -> Array:
    return np.concatenate([p.residuals(x)[0] / s for p, s in zip(problems, noise_rad, strict=True)])


def test_the_best_fit_is_that_of_all_residuals_in_units_of_their_noises(
    uneven: list[Problem], told: JointFit
) -> None:
    best = told.diagnosis.likelihood.best
    found = least_squares(
        lambda x: stacked(uneven, told.noise_rad, x),
        best + 0.05,
        bounds=(uneven[0].low, uneven[0].high),
        xtol=1e-14,
        ftol=1e-14,
        gtol=1e-14,
    )
    ours = stacked(uneven, told.noise_rad, best)
    # Not lower by more than rounding; c_p is not determined, and need not be the same.
    assert ours @ ours <= 2 * found.cost * (1 + 1e-9)
    assert best[:3] == pytest.approx(found.x[:3], abs=1e-3)


def test_each_noise_is_what_its_trace_leaves(uneven: list[Problem], told: JointFit) -> None:
    best = told.diagnosis.likelihood.best
    peak = 2e-4
    for problem, own in zip(uneven, told.noise_rad, strict=True):
        residual, _ = problem.residuals(best)
        # But for the parameters, four of 1403 samples.
        assert own == pytest.approx(np.std(residual), rel=3e-3)
        assert own == pytest.approx(problem.residuals.noise_scale_rad, rel=0.2)
        assert own < peak
    scaled = stacked(uneven, told.noise_rad, best)
    # With all parameters free, chi^2 is what is left of the samples.
    assert scaled @ scaled == pytest.approx(len(scaled) - 4, rel=1e-6)


def test_chi_squared_rises_at_the_limits_by_the_threshold(
    uneven: list[Problem], told: JointFit
) -> None:
    likelihood = told.diagnosis.likelihood
    ours = stacked(uneven, told.noise_rad, likelihood.best)
    for finding in told.diagnosis.findings[:2]:
        index = finding.quantity.members[0]
        for limit in (finding.profile.low, finding.profile.high):
            assert limit is not None

            def rest(x: Array, at: float = limit, index: int = index) -> Array:
                return stacked(uneven, told.noise_rad, np.insert(x, index, at))

            free = np.delete(np.arange(4), index)
            found = least_squares(
                rest,
                np.clip(likelihood.best[free], uneven[0].low[free] + 1e-6, uneven[0].high[free]),
                bounds=(uneven[0].low[free], uneven[0].high[free]),
                x_scale="jac",
            )
            increase = 2 * found.cost - ours @ ours
            assert increase == pytest.approx(likelihood.threshold, rel=0.01)
        ((near,),) = find_limits([likelihood], [finding.quantity])[0]
        assert near == pytest.approx((finding.profile.low, finding.profile.high), abs=1e-3)


def test_one_trace_alone_is_what_identify_gives(uneven: list[Problem]) -> None:
    alone = fitted(uneven[:1])
    expected = diagnose(uneven[0], MODEL, run("least_squares", uneven[0]), confidence=0.95)
    assert [f.words() for f in alone.diagnosis.findings] == [f.words() for f in expected.findings]
    assert np.array_equal(alone.diagnosis.likelihood.best, expected.likelihood.best)
    assert alone.agreement is None
    # And stacked alone, to rounding.
    joint = joint_problem(uneven[:1], [1e-5])
    x = expected.likelihood.best
    assert joint.residuals(x)[0] == pytest.approx(uneven[0].residuals(x)[0], rel=1e-14)
    assert joint.misfit(np.exp(x)[None]) == pytest.approx(uneven[0].misfit(np.exp(x)[None]))


def test_a_trace_twice_is_one_with_half_the_variance() -> None:
    """Of known noise, all limits are those of half of it."""
    (once,) = traces([0.1], [401])
    noise = once.residuals.noise_scale_rad
    twice = fitted([once, once], noise)
    halved = diagnose(
        once, MODEL, run("least_squares", once), confidence=0.95, noise_rad=noise / np.sqrt(2)
    )
    assert twice.agreement == pytest.approx(1.0)
    for ours, theirs in zip(twice.diagnosis.findings, halved.findings, strict=True):
        assert ours.verdict == theirs.verdict
        for one, other in ((ours.low, theirs.low), (ours.high, theirs.high)):
            assert (one is None) == (other is None)
            if one is not None:
                assert one == pytest.approx(other, rel=1e-4)


def test_the_order_of_traces_does_not_matter(uneven: list[Problem], told: JointFit) -> None:
    other = fitted(uneven[::-1])
    assert other.noise_rad[::-1] == pytest.approx(told.noise_rad, rel=1e-6)
    for ours, theirs in zip(other.diagnosis.findings, told.diagnosis.findings, strict=True):
        assert ours.words() == theirs.words()
    assert other.agreement == pytest.approx(told.agreement, rel=1e-4)


def test_a_noisy_trace_adds_little_and_takes_nothing(uneven: list[Problem], told: JointFit) -> None:
    best_alone = fitted(uneven[:1]).diagnosis.findings[1].deviation
    together = told.diagnosis.findings[1].deviation
    assert 0.9 * best_alone < together < best_alone


def test_traces_of_different_samples_are_told() -> None:
    same, other = (
        fitted(traces([0.05, 0.05], [401, 401])),
        fitted(traces([0.05, 0.05], [401, 401], [1.0, 1.1])),
    )
    assert same.agreement is not None
    assert same.agreement > 1e-3
    assert not any("one and the same" in note.text for note in same.diagnosis.notes)
    assert any("one and the same" in note.text for note in other.diagnosis.notes)


def test_condensed_rows_have_the_sums_of_all_samples(uneven: list[Problem]) -> None:
    joint = joint_problem(uneven, [1e-6, 5e-6, 2e-5])
    x = np.log([[20.0, 10.0, 250.0, 1.0]])
    residual, slopes = joint.residuals(x[0])
    rows, condensed = condensed_rows(joint.residuals, x[0])
    assert rows @ rows == pytest.approx(residual @ residual, rel=1e-9)
    assert condensed @ condensed.T == pytest.approx(slopes @ slopes.T, rel=1e-6)
    misfit = np.sqrt(residual @ residual / len(residual))
    assert joint.misfit(np.exp(x))[0] == pytest.approx(misfit, rel=1e-9)
    assert joint.residuals.condensed_misfit(np.exp(x))[0] == pytest.approx(misfit, rel=1e-9)
    np.testing.assert_array_equal(joint.residuals.left(x[0]), residual)
    (gradient,), (root_mean_square,) = joint.residuals.gradients(x, [joint.residuals])
    assert gradient == pytest.approx(slopes @ residual, rel=1e-9)
    assert root_mean_square == pytest.approx(misfit, rel=1e-12)
    normal = LocalFits([joint]).normal(x, np.array([0]))
    assert normal.misfit_rad[0] == pytest.approx(misfit, rel=1e-9)


def test_what_each_instrument_added_is_its_own() -> None:
    """Offsets that differ from trace to trace, fitted along, change neither fit nor limits.

    And the nonlinear model's rows stand for its samples as the linear ones do.
    """
    (plain,) = traces([0.1], [201])
    times = np.linspace(0, 400, 201)
    truth = np.log([[SAMPLES[CELL][name] for name in MODEL.names]])
    clean = rotation(step_response(GRIPPER, MODEL.network(np.exp(truth))), TORQUE, times)[0]
    measured = [clean + added for added in (1e-5, -3e-5)]
    shifted = [
        problem_alone(GRIPPER, MODEL, TORQUE, times, trace, offset=True, nonlinear=True)
        for trace in measured
    ]
    joint = joint_problem(shifted, [1e-6, 3e-6])
    assert isinstance(joint.residuals, JointResiduals)
    residual, slopes = joint.residuals(truth[0])
    rows, condensed = condensed_rows(joint.residuals, truth[0])
    assert joint.residuals.free == 2 * (plain.residuals.free - 1)
    assert rows @ rows == pytest.approx(residual @ residual, rel=1e-5)
    assert condensed @ condensed.T == pytest.approx(slopes @ slopes.T, rel=1e-4)
    # What is left is what the linear model leaves out, the same for both.
    halves = (
        residual[:201] / joint.residuals.weights[0],
        residual[201:] / joint.residuals.weights[1],
    )
    assert halves[0] == pytest.approx(halves[1], abs=1e-15)


def test_the_colour_of_all_is_known_as_badly_as_that_of_the_least_known() -> None:
    """Student's t of few degrees of freedom is the wider one."""
    parts = [
        problem.residuals.with_freedom(freedom)
        for problem, freedom in zip(traces([0.1, 0.1], [101, 101]), (7.0, 30.0), strict=True)
    ]
    assert JointResiduals(parts, [1e-6, 1e-6]).freedom == 7.0
