"""The nonlinear model of a population, against SciPy integrating the nonlinear equations."""

import math
from collections.abc import Callable
from functools import partial
from itertools import pairwise

import numpy as np
from scipy.integrate import solve_ivp

from benchmarks.section import Row, Section, number, times_ours
from benchmarks.setup import POPULATION, Problem, problem
from benchmarks.timing import alternate
from biogrip.arrays import Array
from biogrip.response.linear import rotation, step_response
from biogrip.response.nonlinear import COARSE, correction, nonlinear_rotation

OURS, RADAU = "biogrip, a population", "SciPy Radau, one by one"
_ROUNDS = 5
_FEW = 25
_RTOL, _RTOL_REFERENCE = 1e-6, 1e-10

_TEXT = f"""\
RMS misfit of {POPULATION} individuals, drawn uniformly from the search range, against a trace of
4001 samples, on the nonlinear model without inertia. SciPy's Radau (rtol {_RTOL:.0e}) integrates
the equations of motion as they stand. It and our own solution of single traces, which keeps the
arms' inertia, are timed on {_FEW} individuals and scaled. Error: largest difference of the rotation
from Radau with rtol {_RTOL_REFERENCE:.0e}, as a share of the peak, over these {_FEW}. The linear
model is there to show what the correction costs and is worth."""


def nonlinear_section() -> Section:
    """Time both, and measure their distance from a finer integration."""
    p = problem()
    samples = p.population()
    few = samples[:_FEW]
    # By name: what is timed and its individuals, and the rotation that it computes.
    one_by_one, fine = partial(by_radau, p, rtol=_RTOL), partial(_single_traces, p)
    ways: dict[str, tuple[Callable[[Array], Array], Array, Callable[[Array], Array]]] = {
        OURS: (p.misfit(nonlinear=True), samples, partial(_population, p)),
        "biogrip, single traces": (fine, few, fine),
        RADAU: (one_by_one, few, one_by_one),
        "biogrip, linear model": (p.misfit(), samples, partial(_linear, p)),
    }
    timed = alternate(
        {name: partial(way, those) for name, (way, those, _) in ways.items()}, _ROUNDS
    )
    reference = by_radau(p, few, rtol=_RTOL_REFERENCE)
    peak = np.abs(reference).max(axis=1)
    rows = []
    for name, (_, those, rotation_of) in ways.items():
        error = np.abs(rotation_of(few) - reference).max(axis=1) / peak
        rows.append(
            {
                "way": name,
                "individuals_timed": len(those),
                **timed.against(name, OURS, POPULATION / len(those)),
                "median_error_over_peak": float(np.median(error)),
                "largest_error_over_peak": float(error.max()),
            }
        )
    columns: dict[str, Callable[[Row], str]] = {
        "way": lambda row: row["way"],
        "time (ms)": lambda row: number(row["time_ms"]),
        "times ours (lowest to highest)": times_ours,
        "error over peak, median": lambda row: f"{row['median_error_over_peak']:.0e}",
        "largest": lambda row: f"{row['largest_error_over_peak']:.0e}",
    }
    title = f"Misfit of {POPULATION} individuals on the nonlinear model"
    return Section("nonlinear", title, _TEXT, columns, rows)


def by_radau(p: Problem, samples: Array, *, rtol: float) -> Array:
    """Rotation from the nonlinear equations by SciPy, shape (n, n_times)."""
    return np.array([_radau(p, sample, rtol) for sample in samples])


def _radau(p: Problem, sample: Array, rtol: float) -> Array:
    k, k_p, c, c_p = (float(value) for value in sample)
    arm, length = p.gripper.left, p.gripper.arm_length_m
    hat = math.radians(p.gripper.reference_angle_deg)
    # Far below the steady rotation: the atol of a rotation, and of the node's displacement.
    stiffness = arm.stiffness_Nm_per_rad + 2 * (k + k_p) * p.gripper.lever_m**2
    smallest = 1e-3 * rtol * np.abs(p.steps.left[:, 0]).max() / stiffness

    def slope(_: float, state: Array, torque: float) -> list[float]:
        phi, node = state
        # cos(hat - phi) - cos(hat), without the difference.
        shortening = 4 * length * math.sin(hat - phi / 2) * math.sin(phi / 2)
        lever = length * math.sin(hat - phi)
        load = torque - arm.stiffness_Nm_per_rad * phi
        load -= lever * (k_p * shortening + k * (shortening - node))
        damping = arm.damping_Nms_per_rad + 2 * c_p * lever**2
        return [load / damping, k / c * (shortening - node)]

    phi, state = np.empty(len(p.time_s)), np.zeros(2)
    torques = np.cumsum(p.steps.left[:, 0])
    for torque, (start, end) in zip(
        torques, pairwise([*p.steps.time_s, p.time_s[-1]]), strict=True
    ):
        here = (p.time_s >= start) & (p.time_s <= end)
        solved = solve_ivp(
            slope,
            (start, end),
            state,
            "Radau",
            p.time_s[here],
            args=(torque,),
            rtol=rtol,
            atol=[smallest, smallest * length],
        )
        phi[here], state = solved.y[0], solved.y[:, -1]
    return phi


def _population(p: Problem, samples: Array) -> Array:
    """Rotation as the misfit of a population has it."""
    network = p.model.network(samples)
    response = step_response(p.gripper, network, inertia=False)
    found = correction(p.gripper, network, p.steps, COARSE)
    return rotation(response, p.steps, p.time_s) + found.at(p.time_s)


def _single_traces(p: Problem, samples: Array) -> Array:
    networks = [p.model.network(sample) for sample in samples]
    traces = [nonlinear_rotation(p.gripper, one, p.steps, p.time_s) for one in networks]
    return np.concatenate(traces)


def _linear(p: Problem, samples: Array) -> Array:
    response = step_response(p.gripper, p.model.network(samples), inertia=False)
    return rotation(response, p.steps, p.time_s)
