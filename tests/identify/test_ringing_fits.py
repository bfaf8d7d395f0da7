"""Fits of traces in which arms are seen ringing: side by side as alone, in parts as in one."""

import numpy as np

from biogrip.experiment.protocol import held, torque_history
from biogrip.experiment.sample import MODELS
from biogrip.identify.answer import silent
from biogrip.identify.least_squares import LeastSquaresSettings, identify_many
from biogrip.identify.problem import Problem, problem_of, rows_of
from biogrip.response.linear import rotation, step_response
from tests.helpers.problems import GRIPPER, RANGES

MODEL = MODELS["generalized_maxwell"]
CELL = np.array([35.0, 12.3, 299.9, 1e-3])
TORQUE = torque_history((held(20.0, 1.6e-8), held(20.0, 4e-9)))
# With four derivatives more than a hundred fits at once are more numbers than are held at once.
TIMES = np.concatenate([start + 1e-5 * np.arange(1, 1501) for start in (0.0, 20.0)])
TIMES = np.concatenate(
    (TIMES[:1500], np.linspace(1, 19, 500), TIMES[1500:], np.linspace(21, 40, 500))
)


def _problems(count: int) -> list[Problem]:
    clean = rotation(step_response(GRIPPER, MODEL.network(CELL)), TORQUE, TIMES)[0]
    rows = rows_of(TORQUE, TIMES, offset=False, drift=False, nonlinear=False, inertia=True)
    return [
        problem_of(
            GRIPPER,
            MODEL,
            TORQUE,
            TIMES,
            clean + 1e-6 * np.random.default_rng(seed).standard_normal(len(TIMES)),
            RANGES,
            inertia=True,
            noise_rad=1e-6,
            condensed=rows,
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
