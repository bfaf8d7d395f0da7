"""The misfit of a population, against forming the responses in three other ways."""

from itertools import pairwise

import numpy as np
from scipy.integrate import solve_ivp
from scipy.signal import lsim

from benchmarks.setup import Problem, problem, seconds
from biogrip.arrays import Array
from biogrip.protocol import torque_at
from biogrip.response.linear import rotation, step_response
from biogrip.response.misfit_series import SeriesMisfit

INDIVIDUALS = 500
# The one-by-one peers are timed on a few individuals and scaled.
FEW = 10


def misfit_rows() -> list[dict[str, str]]:
    """Measure every way; accuracy is the median relative distance from 'vectorised numpy'."""
    p = problem()
    samples = p.genome.decode(p.genome.draw(INDIVIDUALS, np.random.default_rng(1)))
    ours = SeriesMisfit(p.gripper, p.model, p.steps, 0.1, p.trace_rad)
    exact = vectorised(p, samples)
    base = seconds(lambda: ours(samples))
    rows = [_row("biogrip, no response formed", base, base, ours(samples), exact)]
    rows.append(
        _row("vectorised numpy", seconds(lambda: vectorised(p, samples)), base, exact, exact)
    )
    for name, peer in (
        ("scipy.signal.lsim, one by one", by_lsim),
        ("SciPy Radau, one by one", by_radau),
    ):
        few = np.array([peer(p, sample) for sample in samples[:FEW]])
        time_s = seconds(lambda peer=peer: [peer(p, s) for s in samples[:FEW]], 0.1)  # type: ignore[misc]
        rows.append(_row(name, time_s * INDIVIDUALS / FEW, base, few, exact[:FEW]))
    return rows


def vectorised(p: Problem, samples: Array) -> Array:
    """Form all responses at once and average their squared distance."""
    response = step_response(p.gripper, p.model.network(samples), inertia=False)
    difference = rotation(response, p.steps, p.time_s) - p.trace_rad
    misfit: Array = np.sqrt(np.mean(difference**2, axis=1))
    return misfit


def by_lsim(p: Problem, sample: Array) -> float:
    """What a user would write first: the transfer function and lsim, inputs held."""
    numerator, denominator = _transfer_function(p, sample)
    torque = torque_at(p.steps, p.time_s)
    _, phi, _ = lsim((numerator, denominator), torque, p.time_s, interp=False)
    return float(np.sqrt(np.mean((phi - p.trace_rad) ** 2)))


def by_radau(p: Problem, sample: Array) -> float:
    """The inertia-free equations (phi, x) integrated by an implicit method."""
    k, k_p, c, c_p = sample
    b, arm = p.gripper.lever_m, p.gripper.left
    u = 2 * b**2
    # By symmetry the sample's middle stays: half the network, its node at y.
    damping = arm.damping_Nms_per_rad + c_p * u
    matrix = np.array(
        [
            [-(arm.stiffness_Nm_per_rad + (k_p + k) * u) / damping, k * u / damping],
            [k / c, -k / c],
        ]
    )
    phi, state = np.empty(len(p.time_s)), np.zeros(2)
    edges = [*p.steps.time_s, p.time_s[-1]]
    torque = np.cumsum(p.steps.left[:, 0])
    for phase, (start, end) in enumerate(pairwise(edges)):
        load = np.array([torque[phase] / damping, 0.0])
        here = (p.time_s >= start) & (p.time_s <= end)
        solved = solve_ivp(
            lambda _, z, load=load: matrix @ z + load,
            (start, end),
            state,
            "Radau",
            p.time_s[here],
            jac=matrix,
            rtol=1e-6,
            atol=1e-12,
        )
        phi[here], state = solved.y[0], solved.y[:, -1]
    return float(np.sqrt(np.mean((phi - p.trace_rad) ** 2)))


def _transfer_function(p: Problem, sample: Array) -> tuple[list[float], list[float]]:
    k, k_p, c, c_p = sample
    u, arm = 2 * p.gripper.lever_m**2, p.gripper.left
    stiffness = arm.stiffness_Nm_per_rad + k_p * u
    damping = arm.damping_Nms_per_rad + c_p * u
    return [c, k], [damping * c, stiffness * c + damping * k + u * k * c, stiffness * k]


def _row(name: str, time_s: float, base: float, misfit: Array, exact: Array) -> dict[str, str]:
    difference = float(np.median(np.abs(misfit / exact - 1)))
    return {
        "way": name,
        "time (ms)": f"{1e3 * time_s:.3g}",
        "times ours": f"{time_s / base:.3g}",
        "median relative difference": f"{difference:.1e}",
    }
