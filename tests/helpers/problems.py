"""Problems of the default study: its samples, protocol and settings, and traces to be fitted."""

import functools
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from biogrip.arrays import Array
from biogrip.fit.problem import Fit, TraceProblem, silent
from biogrip.judging.diagnosis import Diagnosis, diagnose
from biogrip.judging.likelihood import Likelihood, make_likelihood
from biogrip.physics.condensed import Condensed
from biogrip.physics.models import MODELS
from biogrip.physics.noise import Noise, add_noise, nuisance_basis
from biogrip.physics.protocol import Course, sample_times
from biogrip.physics.response import step_response, superpose
from biogrip.physics.sample_model import SampleModel
from biogrip_study.methods.registry import identify_by
from tests.helpers.default import STUDY

MODEL = MODELS["generalized_maxwell"]
SAMPLES = {name: case.parameters for name, case in STUDY.cases.items()}
RANGES = vars(STUDY.config.search_range)
EXPERIMENT = STUDY.cases["liquid_drop_2"].experiment
GRIPPER, TORQUE = EXPERIMENT.gripper, EXPERIMENT.torque


def rotation(
    model: SampleModel, parameters: ArrayLike, times: Array, *, inertia: bool = True
) -> Array:
    """Of the study's gripper under its protocol, with one sample."""
    network = model.network(np.atleast_2d(parameters))
    return superpose(step_response(GRIPPER, network, inertia=inertia), TORQUE, times)[0]


@functools.cache
def clean(case: str, rate_Hz: float = 1.0) -> tuple[Array, Array]:
    times = sample_times(400.0, rate_Hz)
    return times, rotation(MODEL, [SAMPLES[case][name] for name in MODEL.names], times)


def posed_for(model: SampleModel, times: Array, trace: Array, **assumed: Any) -> TraceProblem:
    """The default study's problem for any model and trace; assumed is as `Experiment`'s."""
    return replace(EXPERIMENT, ranges=RANGES, **assumed).of(times, trace, model)


def pose_noisy(
    times: Array, trace: Array, n: int, model: SampleModel = MODEL, level: float = 0.1, **own: Any
) -> list[TraceProblem]:
    noise = Noise("gaussian", level, "peak")
    traces = [add_noise(trace, noise, np.random.default_rng([seed, 7])) for seed in range(n)]
    return replace(EXPERIMENT, ranges=RANGES, **own).of_each(times, traces, model)


def problem(case: str, seed: int, rate_Hz: float = 1.0) -> TraceProblem:
    return pose_noisy(*clean(case, rate_Hz), seed + 1)[seed]


def run(method: str, posed: TraceProblem, seed: int = 0) -> Fit:
    settings, rng = STUDY.config.method(method), np.random.default_rng(seed)
    (answer,) = identify_by(method, settings, [posed], [rng], silent)
    return answer


def likelihood_of(posed: TraceProblem, seed: int = 0) -> Likelihood:
    """What is judged of a trace: its best fit by least squares."""
    found = run("least_squares", posed, seed)
    return make_likelihood(posed, np.log(found.parameters), found.misfit, confidence=0.95)


def diagnosis_of(posed: TraceProblem) -> Diagnosis:
    return diagnose(posed, run("least_squares", posed), confidence=0.95)


def condensed_of(torque: Course, time_s: Array, **nuisance: bool) -> Condensed:
    """Rows that stand for the samples of any trace at these times."""
    along = {"offset": False, "drift": False, **nuisance}
    return Condensed(torque, time_s, nuisance_basis(time_s, **along))
