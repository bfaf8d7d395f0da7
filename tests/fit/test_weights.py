"""Readings of known standard deviations, against SciPy's weighted least squares."""

from dataclasses import replace
from math import gamma

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.fit.any_sample import proportional_deviations
from biogrip.fit.experiment import Experiment
from biogrip.fit.trace_fit import TraceFit, fit_traces
from biogrip.library import set_up
from biogrip.physics.gripper import Arm, Gripper
from biogrip.physics.instruments import INSTRUMENTS
from biogrip.physics.models import Sample
from biogrip.physics.protocol import hold
from tests.helpers.problems import run

# The fit of polystyrene at 190 degC that pyRheo publishes, with weights of 5 % of the compliance.
V, ETA, BETA = 25856.7, 68281.1, 0.4223
LEVER_M, TORQUE_NM = 1.5e-3, 3e-8
TIMES = np.geomspace(1.0, 1e4, 120)
# So soft that the force is held: of the torque they take 3e-8.
ARM = Arm(inertia_kgm2=1e-20, damping_Nms_per_rad=1e-12, stiffness_Nm_per_rad=1e-12)
POLYSTYRENE = set_up(
    Gripper(arm_length_m=LEVER_M, reference_angle_deg=90.0, left=ARM, right=ARM),
    (hold(1e4, TORQUE_NM),),
    Sample("fractional_maxwell"),
)


def rotation(time_s: Array, log_v: float, beta: float, log_eta: float) -> Array:
    """The creep compliance in closed form, as the arm of a given force turns."""
    compliance = time_s / np.exp(log_eta) + time_s**beta / (np.exp(log_v) * gamma(1 + beta))
    turned: Array = TORQUE_NM / (2 * LEVER_M**2) * compliance
    return turned


def noisy(share: float, seed: int = 3) -> Array:
    rng = np.random.default_rng(seed)
    clean = rotation(TIMES, np.log(V), BETA, np.log(ETA))
    trace: Array = clean * (1 + share * rng.standard_normal(len(TIMES)))
    return trace


def fitted(problem: Experiment, trace: Array) -> TraceFit:
    (fit,) = fit_traces(
        [problem], [(TIMES, trace)], lambda some, _: [run("least_squares", each) for each in some]
    )
    return fit


def test_the_published_fit_comes_out_to_five_digits() -> None:
    trace = noisy(0.0)
    fit = fitted(POLYSTYRENE.weighted(0.05 * trace), trace)
    assert fit.found.parameters == pytest.approx([V, BETA, ETA], rel=5e-6)


def test_a_plateau_is_no_noise() -> None:
    """A relaxation that ends at a plateau, of which deviations are a share as of all else."""
    times = np.geomspace(1.0, 1e3, 100)
    smooth = 800 + 700 * np.exp(-times / 20)
    readings = smooth * (1 + 0.01 * np.random.default_rng(0).standard_normal(len(times)))
    relaxation = set_up(INSTRUMENTS["modulus"], (hold(1e3, 1.0),), Sample("zener_maxwell"))
    found = proportional_deviations(replace(relaxation, noise_share=0.01), times, readings)
    assert found == pytest.approx(0.01 * smooth, rel=0.02)
