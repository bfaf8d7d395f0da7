"""Problems of the default study: its samples, protocol and settings, and traces to be fitted."""

import functools
from typing import Any

import numpy as np

from biogrip.arrays import Array
from biogrip.fit import least_squares
from biogrip.fit.methods import identifier
from biogrip.fit.problem import Identification, Problem, make_problem, silent
from biogrip.physics.condensed import Condensed
from biogrip.physics.gripper import Gripper
from biogrip.physics.instruments import INSTRUMENTS
from biogrip.physics.linear import rotation, step_response
from biogrip.physics.models import MODELS
from biogrip.physics.noise import Noise, add_noise
from biogrip.physics.protocol import TorqueHistory, sample_times, torque_history
from biogrip.physics.residuals import Residuals, Trace
from biogrip.physics.sample_model import SampleModel
from biogrip.physics.whitening import nuisance_basis
from tests.helpers.default import STUDY

MODEL = MODELS["generalized_maxwell"]
SAMPLES = {name: case.parameters for name, case in STUDY.cases.items()}


def study_torque() -> TorqueHistory:
    """The default study's protocol."""
    return torque_history(STUDY.phases)


@functools.cache
def clean(case: str, rate_Hz: float = 1.0) -> tuple[Array, Array]:
    gripper, torque = STUDY.gripper, study_torque()
    times = sample_times(400.0, rate_Hz)
    network = MODEL.network([[SAMPLES[case][name] for name in MODEL.names]])
    return times, rotation(step_response(gripper, network), torque, times)[0]


def problem(case: str, seed: int, level: float = 0.1, rate_Hz: float = 1.0) -> Problem:
    times, response = clean(case, rate_Hz)
    rng = np.random.default_rng([seed, 7])
    trace = add_noise(response, Noise("gaussian", level, "peak"), rng)
    return posed_for(MODEL, times, trace)


def run(method: str, case_problem: Problem, seed: int = 0) -> Identification:
    identify = identifier(method, STUDY.config.method(method))
    (answer,) = identify([case_problem], [np.random.default_rng(seed)], silent)
    return answer


def condensed_of(
    torque: TorqueHistory,
    time_s: Array,
    *,
    offset: bool = False,
    drift: bool = False,
) -> Condensed:
    """Rows that stand for the samples of any trace at these times."""
    nuisance = nuisance_basis(time_s, offset=offset, drift=drift)
    return Condensed(torque, time_s, nuisance)


def problem_alone(
    gripper: Gripper,
    model: SampleModel,
    torque: TorqueHistory,
    time_s: Array,
    rotation_rad: Array,
    *,
    noise_rad: float | None = None,
    condensed: Condensed | None = None,
    **assumed: Any,
) -> Problem:
    """The problem of a trace that by default shares its rows with no other.

    Assumed is as `condensed_of`'s.
    """
    rows = condensed or condensed_of(torque, time_s, **assumed)
    given = gripper, model, torque, Trace(time_s, rotation_rad, rows, noise_rad)
    return make_problem(Residuals(*given, instrument=INSTRUMENTS["rotation"]), STUDY.ranges)


def condensed_rows(residuals: Residuals, x: Array) -> tuple[Array, Array]:
    """Rows that stand for the residuals at log-parameters (n_parameters,), and their slopes."""
    rows = residuals.condensed_responses(x[None])[0]
    return rows[0] - residuals.condensed_trace, rows[1:]


SETTINGS: Any = STUDY.config.method("least_squares")
GRIPPER, TORQUE = STUDY.gripper, study_torque()


def posed_for(model: SampleModel, times: Array, trace: Array) -> Problem:
    """The default study's problem for any model and trace."""
    return problem_alone(STUDY.gripper, model, study_torque(), times, trace)


def case_problem(
    times: Array,
    response: Array,
    count: int,
    model: SampleModel = MODEL,
    level: float = 0.1,
    **assumed: Any,
) -> list[Problem]:
    """Problems that share everything but the noise; assumed is as `condensed_of`'s."""
    condensed = condensed_of(TORQUE, times, **assumed)
    noise = Noise("gaussian", level, "peak")
    traces = [add_noise(response, noise, np.random.default_rng([n, 7])) for n in range(count)]
    return [
        problem_alone(GRIPPER, model, TORQUE, times, trace, condensed=condensed) for trace in traces
    ]


def of_case(case: str, count: int, level: float = 0.1) -> list[Problem]:
    return case_problem(*clean(case), count, level=level)


def identified(
    problems: list[Problem], seeds: list[int], settings: Any = SETTINGS
) -> list[Identification]:
    rngs = [np.random.default_rng(seed) for seed in seeds]
    return least_squares.identify_many(problems, settings, rngs)
