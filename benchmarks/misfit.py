"""The misfit of a population, against forming the responses in other ways."""

from collections.abc import Callable
from functools import partial
from itertools import pairwise

import numpy as np
from mpmath import mp, mpf
from scipy.integrate import solve_ivp
from scipy.signal import lsim

from benchmarks.section import Row, Section, number, times_ours
from benchmarks.setup import POPULATION, Problem, problem
from benchmarks.timing import alternate
from biogrip.arrays import Array, parts
from biogrip.experiment.protocol import torque_at
from biogrip.response.linear import rotation, step_response

OURS, ANEW = "biogrip", "biogrip, its table made anew"
NUMPY, BLOCKS = "vectorised numpy", "vectorised numpy, in blocks"
_ROUNDS = 7
_CHECKED = 40
# One by one, so many are timed and the time scaled to the population.
_LSIM, _RADAU = 40, 10
# Numbers formed at once: what fits a processor's cache is faster than all.
_AT_ONCE = 400_000

_TEXT = f"""\
RMS misfit of {POPULATION} individuals, drawn uniformly from the search range, against one trace of
4001 samples. *biogrip* sums geometric series and looks up the sums over the trace in a table, made
once a trace; it forms no response. *Vectorised numpy* forms all of them from the closed form, in
one go or *in blocks*, as many at a time as fit a processor's cache. The others integrate one
individual after the other; {_LSIM} and {_RADAU} of them are timed and scaled. Accuracy: relative
distance of the misfit from one of 50 digits, over {_CHECKED} individuals or as many as were
integrated."""


def misfit_section() -> Section:
    """Time every way, and measure its distance from 50 digits."""
    p = problem()
    samples = p.population()
    ways: dict[str, tuple[int, Callable[[Array], Array]]] = {
        OURS: (POPULATION, p.misfit()),
        ANEW: (POPULATION, lambda samples: p.misfit()(samples)),
        NUMPY: (POPULATION, partial(vectorised, p)),
        BLOCKS: (POPULATION, partial(in_blocks, p)),
        "scipy.signal.lsim, one by one": (_LSIM, partial(by_lsim, p)),
        "SciPy Radau, one by one": (_RADAU, partial(by_radau, p)),
    }
    timed = alternate(
        {name: partial(way, samples[:count]) for name, (count, way) in ways.items()},
        _ROUNDS,
    )
    exact = np.array([misfit_50_digits(p, sample) for sample in samples[:_CHECKED]])
    rows = []
    for name, (count, way) in ways.items():
        checked = min(count, _CHECKED)
        distance = np.abs(way(samples[:checked]) / exact[:checked] - 1)
        rows.append(
            {
                "way": name,
                "individuals_timed": count,
                **timed.against(name, OURS, POPULATION / count),
                "median_relative_error": float(np.median(distance)),
                "largest_relative_error": float(distance.max()),
            }
        )
    columns: dict[str, Callable[[Row], str]] = {
        "way": lambda row: row["way"],
        "time (ms)": lambda row: number(row["time_ms"]),
        "times ours (lowest to highest)": times_ours,
        "relative error, median": lambda row: _error(row["median_relative_error"]),
        "largest": lambda row: _error(row["largest_relative_error"]),
    }
    title = f"Misfit of {POPULATION} individuals against 4001 samples"
    return Section("misfit", title, _TEXT, columns, rows)


def _error(value: float) -> str:
    return f"{value:.0e}" if value > 1e-16 else "below 1e-16"


def vectorised(p: Problem, samples: Array) -> Array:
    """Form all responses at once and average their squared distance."""
    response = step_response(p.gripper, p.model.network(samples), inertia=False)
    difference = rotation(response, p.steps, p.time_s) - p.trace_rad
    misfit: Array = np.sqrt(np.mean(difference**2, axis=1))
    return misfit


def in_blocks(p: Problem, samples: Array) -> Array:
    """Do so with as many at a time as fit a processor's cache."""
    at_once = max(1, _AT_ONCE // len(p.time_s))
    response_of = partial(step_response, p.gripper, symmetric=p.steps.symmetric, inertia=False)
    found = []
    for some in parts(len(samples), at_once):
        difference = rotation(response_of(p.model.network(samples[some])), p.steps, p.time_s)
        difference -= p.trace_rad
        squares = np.einsum("nt,nt->n", difference, difference)
        found.append(np.sqrt(squares / len(p.time_s)))
    return np.concatenate(found)


def by_lsim(p: Problem, samples: Array) -> Array:
    """What a user would write first: each transfer function and lsim, inputs held."""
    torque = torque_at(p.steps, p.time_s)
    found = []
    for sample in samples:
        numerator, denominator = _transfer_function(p, sample)
        _, phi, _ = lsim((numerator, denominator), torque, p.time_s, interp=False)
        found.append(np.sqrt(np.mean((phi - p.trace_rad) ** 2)))
    return np.array(found)


def by_radau(p: Problem, samples: Array) -> Array:
    """Integrate the inertia-free equations of each individual by an implicit method."""
    return np.array([_radau(p, sample) for sample in samples])


def _radau(p: Problem, sample: Array) -> float:
    k, k_p, c, c_p = sample
    arm, u = p.gripper.left, 2 * p.gripper.lever_m**2
    # By symmetry the sample's middle stays: half the network, its node at y.
    damping = arm.damping_Nms_per_rad + c_p * u
    matrix = np.array(
        [
            [-(arm.stiffness_Nm_per_rad + (k_p + k) * u) / damping, k * u / damping],
            [k / c, -k / c],
        ]
    )
    phi, state = np.empty(len(p.time_s)), np.zeros(2)
    torque = np.cumsum(p.steps.left[:, 0])
    for phase, (start, end) in enumerate(pairwise([*p.steps.time_s, p.time_s[-1]])):
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


def misfit_50_digits(p: Problem, sample: Array) -> float:
    """Evaluate the inertia-free response and its misfit with 50 digits."""
    with mp.workdps(50):
        numerator, denominator = _transfer_function(p, np.array([mpf(float(v)) for v in sample]))
        (n_0, n_1), (a_0, a_1, a_2) = numerator[::-1], denominator[::-1]
        root = mp.sqrt(a_1**2 - 4 * a_0 * a_2)
        rates = [(-a_1 - root) / (2 * a_2), (-a_1 + root) / (2 * a_2)]
        weights = [(n_0 + n_1 * rate) / (rate * (2 * a_2 * rate + a_1)) for rate in rates]
        factors = [mp.exp(rate * mpf(p.interval_s)) for rate in rates]
        phi = [mpf(0)] * len(p.time_s)
        for start, jump in zip(p.steps.time_s, p.steps.left[:, 0], strict=True):
            terms = [mpf(float(jump)) * weight for weight in weights]
            for index in range(round(start / p.interval_s), len(phi)):
                phi[index] += mpf(float(jump)) * n_0 / a_0 + sum(terms)
                terms = [term * factor for term, factor in zip(terms, factors, strict=True)]
        square = sum((a - mpf(float(b))) ** 2 for a, b in zip(phi, p.trace_rad, strict=True))
        return float(mp.sqrt(square / len(phi)))


def _transfer_function(p: Problem, sample: Array) -> tuple[list[float], list[float]]:
    """Polynomials of phi/tau = Q/(Z Q + 2 b^2 P), highest power first."""
    k, k_p, c, c_p = sample
    u, arm = 2 * p.gripper.lever_m**2, p.gripper.left
    stiffness = arm.stiffness_Nm_per_rad + k_p * u
    damping = arm.damping_Nms_per_rad + c_p * u
    return [c, k], [damping * c, stiffness * c + damping * k + u * k * c, stiffness * k]
