"""Fits of traces in which arms are seen ringing: side by side as alone, in parts as in one."""

import numpy as np
import pytest

from biogrip import library
from biogrip.experiment.protocol import hold, torque_history
from biogrip.experiment.sample import MODELS
from biogrip.identify.answer import silent
from biogrip.identify.least_squares import LeastSquaresSettings, identify_many
from biogrip.identify.multi_start import fit_from
from biogrip.identify.problem import Problem, make_problem
from biogrip.instrument.instruments import INSTRUMENTS
from biogrip.response.inertia import ringing_s
from biogrip.response.linear import rotation, step_response
from tests.helpers.problems import GRIPPER, RANGES, condensed_of, problem_alone

MODEL = MODELS["generalized_maxwell"]
CELL = np.array([35.0, 12.3, 299.9, 1e-3])
TORQUE = torque_history((hold(20.0, 1.6e-8), hold(20.0, 4e-9)))
# With four derivatives more than a hundred fits at once are more numbers than are held at once.
TIMES = np.concatenate([start + 1e-5 * np.arange(1, 1501) for start in (0.0, 20.0)])
TIMES = np.concatenate(
    (TIMES[:1500], np.linspace(1, 19, 500), TIMES[1500:], np.linspace(21, 40, 500))
)


def _problems(count: int) -> list[Problem]:
    clean = rotation(step_response(GRIPPER, MODEL.network(CELL)), TORQUE, TIMES)[0]
    rows = condensed_of(TORQUE, TIMES, ringing_s=ringing_s(GRIPPER))
    return [
        make_problem(
            GRIPPER,
            MODEL,
            TORQUE,
            TIMES,
            clean + 1e-6 * np.random.default_rng(seed).standard_normal(len(TIMES)),
            RANGES,
            rows,
            noise_rad=1e-6,
            instrument=INSTRUMENTS["rotation"],
        )
        for seed in range(count)
    ]


def test_a_fit_does_not_depend_on_the_others() -> None:
    problems, settings = _problems(3), LeastSquaresSettings(candidates=60, starts=45)
    rngs = [np.random.default_rng(seed) for seed in range(3)]
    together = identify_many(problems, settings, rngs, silent)
    alone = identify_many(problems[1:2], settings, [np.random.default_rng(1)], silent)[0]
    np.testing.assert_array_equal(together[1].parameters, alone.parameters)
    assert together[1].misfit_rad == alone.misfit_rad
    assert together[1].evaluations == alone.evaluations
    # All parameters come out, c_p too; its bound is a percent or two.
    for found in together:
        np.testing.assert_allclose(found.parameters, CELL, rtol=0.1)


# Dampers between the jaws end a ring before it is seen; a spring in front of them goes on.
RINGING = {
    "generalized_maxwell": {"k": 35.0, "k_p": 12.3, "c": 299.9, "c_p": 1e-3},
    "zener_kelvin": {"k_s": 12.0, "k_v": 20.0, "c_v": 100.0},
}


@pytest.mark.parametrize(("interval_s", "level"), [(0.017, 0.02), (0.021, 0.03), (0.030, 0.04)])
@pytest.mark.parametrize("model", RINGING)
def test_who_samples_fast_is_told_of_fits_with_rings(
    model: str, interval_s: float, level: float
) -> None:
    """Chi^2 is that of what is simulated; nobody has to ask for the arms' inertia."""
    protocol = (library.hold(200.0, 1.6e-9), library.hold(200.0, 0.32e-9))
    experiment = library.set_up(GRIPPER, protocol, library.Sample(model))
    time_s = np.arange(0.0, 400.0, interval_s)
    clean = library.simulate(experiment, RINGING[model], time_s)
    noise_rad = level * clean.max()
    trace = clean + noise_rad * np.random.default_rng(4).standard_normal(len(time_s))
    assert experiment.of(time_s, trace).residuals.inertia
    found = library.identify_sample(experiment, time_s, trace)
    told = dict(zip(experiment.searched.names, found.parameters.tolist(), strict=True))
    residual = library.simulate(experiment, told, time_s) - trace
    chi2 = float(residual @ residual) / noise_rad**2
    assert len(time_s) * (found.misfit_rad / noise_rad) ** 2 == pytest.approx(chi2, abs=1e-6)
    # As low as noise allows: by more than 30 the truth is not above it once in 100 000 times.
    truth = float(np.sum((clean - trace) ** 2)) / noise_rad**2
    assert truth - 30 < chi2 < truth


def test_a_ring_that_is_not_reckoned_with_is_taken_for_the_sample() -> None:
    """By standard deviations of k_s, in a trace that is sampled for it."""
    torque = torque_history((hold(2.0, 1.6e-9), hold(2.0, 0.32e-9)))
    model, sample = MODELS["zener_kelvin"], np.array([*RINGING["zener_kelvin"].values()])
    time_s = np.arange(0.0, 4.0, 0.002)
    clean = rotation(step_response(GRIPPER, model.network(sample)), torque, time_s)[0]
    noise_rad = 0.01 * clean.max()
    trace = clean + noise_rad * np.random.default_rng(4).standard_normal(len(time_s))
    with_it, without = (
        problem_alone(GRIPPER, model, torque, time_s, trace, noise_rad=noise_rad, ringing_s=ring_s)
        for ring_s in (ringing_s(GRIPPER), 0.0)
    )
    found, wrong = (fit_from([case_problem], np.log(sample)) for case_problem in (with_it, without))
    chi2, wrong_chi2 = (len(time_s) * (f.misfit_rad[0] / noise_rad) ** 2 for f in (found, wrong))
    assert wrong_chi2 > chi2 + 100
    slopes = with_it.residuals(found.x[0])[1] / noise_rad
    deviation = np.sqrt(np.linalg.inv(slopes @ slopes.T)[0, 0])
    assert abs(found.x[0, 0] - np.log(12.0)) < 4 * deviation
    assert abs(wrong.x[0, 0] - np.log(12.0)) > 4 * deviation
