"""Fits of all sample models against SciPy's, on very many random traces.

``python -m tests.helpers.fit_campaign [traces [processes]]`` takes some 40 minutes for 500 traces
on 2 processes, and prints the tables that the documentation shows. The test suite has a few.

The residuals are formed without the library. The rotation is the inverse Laplace transform of
tau(s)/(I s^2 + c_g s + k_g + 2 b^2 F(s)), with the sample's impedance F(s) written down from the
definition of each model. It is inverted by quadrature on hyperbolas [1]. These do not enclose the
pole of the ringing arms, which is subtracted first and added again in the time domain.

References
----------
.. [1] J. A. C. Weideman and L. N. Trefethen, Parabolic and hyperbolic contours for computing the
   Bromwich integral, Mathematics of Computation 76 (2007), 1341-1356.
"""

import os
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import cache, cached_property
from itertools import combinations, pairwise, permutations, product
from multiprocessing import get_context
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares

from biogrip.arrays import Array, ComplexArray
from biogrip.experiment.sample import CANDIDATES, MODELS, Parameter
from biogrip.identify.least_squares import LeastSquaresSettings
from biogrip.identify.nested_fits import fit_models
from biogrip.library import Arm, GeneRange, Gripper, hold, set_up

TRIED = (
    *(name for name, model in MODELS.items() if not model.power_law),
    *("fractional_kelvin_voigt", "fractional_maxwell"),
    *("generalized_maxwell_2", "generalized_maxwell_3"),
)
"""Names of the models that every trace is fitted with."""

NAMES = {model: CANDIDATES[model].model.names for model in TRIED}
"""Of their parameters."""

ALLOWED = 0.1
"""By how much chi^2 may be above the best known, or differ from what the misfit says."""

THOROUGH = (400, 12)
"""Number of random points that SciPy's fits are screened from, and of these fits."""

INERTIA, DAMPING, STIFFNESS = 1e-14, 3.3e-12, 4.4e-7
LENGTH_M, ANGLE_DEG = 1.5e-3, 75.0
GRIPPER = Gripper(LENGTH_M, ANGLE_DEG, *[Arm(INERTIA, DAMPING, STIFFNESS)] * 2)
COUPLING = 2 * (LENGTH_M * np.sin(np.radians(ANGLE_DEG))) ** 2
"""Torque on an arm per rotation, for a sample of 1 N/m."""

_SAME_NETWORK = ("liquid_drop", "zener_maxwell", "zener_kelvin")
_GENERALIZED = ("generalized_maxwell", "generalized_maxwell_2", "generalized_maxwell_3")

NESTED: tuple[tuple[str, str], ...] = (
    ("damper", "kelvin_voigt"),
    *product(("damper", "kelvin_voigt", "maxwell", *_SAME_NETWORK), _GENERALIZED),
    *product(("maxwell",), _SAME_NETWORK),
    *permutations(_SAME_NETWORK, 2),
    *product(("burgers",), _GENERALIZED[1:]),
    *combinations(_GENERALIZED, 2),
)
"""Pairs of a model and a richer one that becomes it where elements are zero."""

RIGID: tuple[tuple[str, str], ...] = (
    *product(("damper",), ("maxwell", *_SAME_NETWORK, "burgers", "fractional_maxwell")),
    *product(("kelvin_voigt",), (*_SAME_NETWORK, "burgers")),
    *product(("maxwell", *_SAME_NETWORK), ("burgers",)),
)
"""The same for elements that are infinitely stiff."""

PAIRS = {"elements are zero": NESTED, "limits of rigid elements": RIGID}


class Elements:
    """Impedances of the elements of n samples, with derivatives.

    An impedance has the shape (2 + n_slopes, n, n_nodes): its value, its derivative by log s, and
    if they are asked for, those by the logarithms of the parameters.

    Parameters
    ----------
    names
        Of the parameters.
    parameters : (n, n_parameters)
        In SI units; an element of zero is absent, one of infinity rigid.
    s : (n or 1, n_nodes)
        Laplace variable in 1/s.
    slopes
        Whether the derivatives by the parameters are wanted.
    """

    def __init__(
        self, names: Sequence[str], parameters: Array, s: ComplexArray, *, slopes: bool
    ) -> None:
        self._places = {name: place for place, name in enumerate(names)}
        # These act like zero and infinity, but every ratio of them and its square are finite.
        self._columns = np.clip(parameters, 1e-70, 1e70).T[:, :, None]
        self._s = s
        self._shape = 2 + slopes * len(names), len(parameters), s.shape[1]
        self._slopes = slopes

    def spring(self, name: str) -> ComplexArray:
        """Return the impedance k."""
        return self._element(self._columns[self._places[name]], 0.0, name)

    def damper(self, name: str) -> ComplexArray:
        """Return the impedance c s."""
        return self._element(self._columns[self._places[name]] * self._s, 1.0, name)

    def springpot(self, modulus: str, exponent: str) -> ComplexArray:
        """Return the impedance k_alpha (s t_0)^alpha, with t_0 = 1 s."""
        alpha, log_s = self._columns[self._places[exponent]], np.log(self._s)
        found = self._element(
            self._columns[self._places[modulus]] * np.exp(alpha * log_s), alpha, modulus
        )
        if self._slopes:
            found[2 + self._places[exponent]] = found[0] * alpha * log_s
        return found

    def branch(self, spring: str, damper: str) -> ComplexArray:
        """Return the impedance of a spring and a damper in series."""
        return in_series(self.spring(spring), self.damper(damper))

    def _element(self, value: ArrayLike, power: float | Array, name: str) -> ComplexArray:
        found = np.zeros(self._shape, dtype=complex)
        found[0] = value
        found[1] = power * found[0]
        if self._slopes:
            found[2 + self._places[name]] = found[0]
        return found


def in_series(*impedances: ComplexArray) -> ComplexArray:
    """Return the impedance of elements in series, whose compliances add up."""
    value = 1 / sum(1 / impedance[0] for impedance in impedances)
    found = np.zeros_like(impedances[0])
    for impedance in impedances:
        found[1:] += (value / impedance[0]) ** 2 * impedance[1:]
    found[0] = value
    return found


def _generalized(e: Elements, *indices: str) -> ComplexArray:
    found = e.spring("k_p") + e.damper("c_p")
    for index in indices:
        found += e.branch(f"k{index}", f"c{index}")
    return found


IMPEDANCES: dict[str, Callable[[Elements], ComplexArray]] = {
    "damper": lambda e: e.damper("c_p"),
    "kelvin_voigt": lambda e: e.spring("k_p") + e.damper("c_p"),
    "maxwell": lambda e: e.branch("k", "c"),
    "liquid_drop": lambda e: e.spring("k_p") + e.branch("k", "c"),
    "zener_maxwell": lambda e: e.spring("k_p") + e.branch("k", "c"),
    "zener_kelvin": lambda e: in_series(e.spring("k_s"), e.spring("k_v") + e.damper("c_v")),
    "burgers": lambda e: in_series(
        e.spring("k_s"), e.damper("c_s"), e.spring("k_v") + e.damper("c_v")
    ),
    "fractional_kelvin_voigt": lambda e: e.spring("k_p") + e.springpot("k_alpha", "alpha"),
    "fractional_maxwell": lambda e: in_series(e.springpot("k_alpha", "alpha"), e.damper("c")),
    "generalized_maxwell": lambda e: _generalized(e, ""),
    "generalized_maxwell_2": lambda e: _generalized(e, "_1", "_2"),
    "generalized_maxwell_3": lambda e: _generalized(e, "_1", "_2", "_3"),
}
"""Force over shortening of each model's sample, from its elements."""


@dataclass(frozen=True)
class Window:
    """A contour for the inverse Laplace transform at some times.

    Parameters
    ----------
    s : (n_nodes,)
        Nodes in the upper half of the plane.
    kernel : (2 n_nodes, n_times)
        Matrix that turns real and imaginary parts at the nodes into values at the times.
    """

    s: ComplexArray
    kernel: Array


NODES, RATIO = 32, 10.0


def window(time_s: Array) -> Window:
    """Return the hyperbola for times of which the last is at most ten times the first [1]."""
    alpha, spread, rate = _best_hyperbola(RATIO)
    scale = rate * NODES / (RATIO * time_s[0])
    theta = spread / NODES * (np.arange(NODES) + 0.5)
    s = scale * (1 + np.sin(1j * theta - alpha))
    slope = 1j * scale * np.cos(1j * theta - alpha)
    weights = spread / NODES / np.pi * slope[:, None] * np.exp(s[:, None] * time_s)
    return Window(s, np.concatenate((weights.imag, weights.real)))


@cache
def _best_hyperbola(ratio: float) -> tuple[float, float, float]:
    """Return angle, extent and scale of the hyperbola that converges fastest [1]."""
    alpha = np.linspace(np.pi / 4, np.pi / 2, 2002)[1:-1]
    opened = (np.pi - 2 * alpha) * ratio + 4 * alpha - np.pi
    spread = np.arccosh(opened / ((4 * alpha - np.pi) * np.sin(alpha)))
    best = np.argmax((np.pi - 2 * alpha) / spread)
    rate = np.pi * (4 * alpha - np.pi) / spread
    return float(alpha[best]), float(spread[best]), float(rate[best])


class StepResponses:
    """Rotations of samples at uniform times under torque steps.

    Parameters
    ----------
    interval_s, samples
        Sampling interval and number of samples; the first sample is at the first step.
    steps
        For each step the index of the sample at which it happens, and the change of the torque
        of both arms in N m.
    inertia
        Whether the arms have inertia.
    """

    def __init__(
        self, interval_s: float, samples: int, steps: Sequence[tuple[int, float]], *, inertia: bool
    ) -> None:
        self._samples, self._steps = samples, steps
        self._inertia = INERTIA if inertia else 0.0
        self._elapsed_s: Array = interval_s * np.arange(1.0, samples)
        ends = [0]
        while ends[-1] < samples - 1:
            ends.append(min(int(RATIO * (ends[-1] + 1)), samples - 1))
        self._windows = [window(self._elapsed_s[a:b]) for a, b in pairwise(ends)]
        self._nodes = np.concatenate([each.s for each in self._windows])[None]

    def __call__(self, model: str, parameters: Array, *, slopes: bool = False) -> Array:
        """Compute the rotations and, if asked for, their derivatives.

        Parameters
        ----------
        model
            Name of the model.
        parameters : (n, n_parameters)
            In the order of the model's.
        slopes
            Whether the derivatives are wanted.

        Returns
        -------
        (1 + n_slopes, n, n_samples)
            First the rotation in rad, then its derivatives by the log-parameters.
        """
        transform = self._transforms(model, parameters, self._nodes, slopes=slopes)
        ring = self._ring(model, parameters, slopes=slopes) if self._inertia else None
        if ring:
            transform -= ring.transform(self._nodes)
        parts = []
        for each, own in zip(
            self._windows, np.split(transform, len(self._windows), axis=2), strict=True
        ):
            parts.append(np.concatenate((own.real, own.imag), axis=2) @ each.kernel)
        response = np.concatenate(parts, axis=2)
        if ring:
            ring.add_to(response, self._elapsed_s)
        return self._superposed(response)

    def _superposed(self, response: Array) -> Array:
        found = np.zeros((*response.shape[:2], self._samples))
        for start, jump in self._steps:
            found[..., start + 1 :] += jump * response[..., : self._samples - 1 - start]
        return found

    def _impedance(
        self, model: str, parameters: Array, s: ComplexArray, *, slopes: bool
    ) -> ComplexArray:
        """Return torque over rotation, with derivatives in the order of `Elements`."""
        elements = Elements(NAMES[model], parameters, s, slopes=slopes)
        found = COUPLING * IMPEDANCES[model](elements)
        found[0] += (self._inertia * s + DAMPING) * s + STIFFNESS
        found[1] += (2 * self._inertia * s + DAMPING) * s
        return found

    def _transforms(
        self, model: str, parameters: Array, s: ComplexArray, *, slopes: bool
    ) -> ComplexArray:
        """Return transforms of step responses and derivatives, (1 + n_slopes, n, n_nodes)."""
        impedance = self._impedance(model, parameters, s, slopes=slopes)
        response = 1 / (impedance[0] * s)
        return np.concatenate((response[None], -response / impedance[0] * impedance[2:]))

    def _ring(self, model: str, parameters: Array, *, slopes: bool) -> "Ring":
        """Find the ring by Cauchy's integrals on a circle around the pole."""
        pole = self._ring_pole(model, parameters)
        rings = np.isfinite(pole)
        pole = np.where(rings, pole, 1j)
        radius = _RADIUS * pole.imag[:, None]
        around = radius * np.exp(2j * np.pi / _AROUND * np.arange(_AROUND))
        found = self._transforms(model, parameters, pole[:, None] + around, slopes=slopes)
        once = np.where(rings, np.mean(found * around, axis=2), 0.0)
        twice = np.where(rings, np.mean(found * around**2, axis=2), 0.0)
        # The response's pole is simple, that of its derivatives is double.
        twice[0] = 0.0
        return Ring(pole, once, twice)

    def _ring_pole(self, model: str, parameters: Array) -> ComplexArray:
        """Return the pole in the upper half of the plane, NaN where the arms do not swing.

        The first iteration maps the upper half of the plane into itself, because F is positive
        real, and so approaches the only pole there from anywhere. Newton's method ends it.
        """
        s = np.full((len(parameters), 1), 1j * np.sqrt(STIFFNESS / INERTIA))
        for _ in range(6):
            escape_formula = INERTIA * s * s
            rest = self._impedance(model, parameters, s, slopes=False)[0] - escape_formula
            s = 1j * np.sqrt(rest / INERTIA)
        for _ in range(40):
            value, slope = self._impedance(model, parameters, s, slopes=False)
            step = s * value / slope
            # Shorter steps where the whole one would leave the upper half of the plane.
            far = step.imag > 0.5 * s.imag
            step = np.where(far, step * (0.5 * s.imag / np.where(far, step.imag, 1.0)), step)
            s = s - step
            converged = np.abs(step) < 1e-13 * np.abs(s)
            if np.all(converged | (s.imag < _HOPELESS * np.abs(s))):
                break
        swings = (np.abs(step) < 1e-9 * np.abs(s)) & (s.imag > _LEAST_SWING * np.abs(s))
        return np.where(swings, s, np.nan)[:, 0]


# Radius of the circle around the pole as a share of its distance from the real axis; nodes.
_RADIUS, _AROUND = 0.2, 16
# The contours enclose poles that are nearer to the negative axis than the first angle; Newton's
# method stops at the second.
_LEAST_SWING, _HOPELESS = 0.05, 1e-3


@dataclass(frozen=True)
class Ring:
    """The share of the ringing arms in step responses and their derivatives.

    Parameters
    ----------
    pole : (n,)
        In the upper half of the plane.
    once, twice : (1 + n_slopes, n)
        Coefficients of 1/(s - pole) and 1/(s - pole)^2.
    """

    pole: ComplexArray
    once: ComplexArray
    twice: ComplexArray

    def transform(self, s: ComplexArray) -> ComplexArray:
        """Return its transform, (1 + n_slopes, n, n_nodes)."""
        found = np.zeros((*self.once.shape, s.shape[1]), dtype=complex)
        for pole, once, twice in (
            (self.pole, self.once, self.twice),
            (self.pole.conj(), self.once.conj(), self.twice.conj()),
        ):
            near = 1 / (s - pole[:, None])
            found += (once[..., None] + twice[..., None] * near) * near
        return found

    def add_to(self, response: Array, time_s: Array) -> None:
        """Add it to responses of shape (1 + n_slopes, n, n_times) until it has decayed."""
        slowest = -np.max(np.where(self.once[0] != 0, self.pole.real, -np.inf))
        early_s = time_s[time_s * slowest < 40]
        swing = np.exp(self.pole[:, None] * early_s)
        found = (self.once[..., None] + self.twice[..., None] * early_s) * swing
        response[..., : len(early_s)] += 2 * found.real


@dataclass(frozen=True)
class Trace:
    """A simulated trace.

    Parameters
    ----------
    seed
        Seed that it was drawn with.
    made_by, parameters
        Model that made it, and its parameters.
    steps, interval_s
        As of `StepResponses`.
    rotation_rad : (n_samples,)
        Rotation with noise.
    noise_rad
        Standard deviation of its noise.
    peak_rad
        Largest rotation without noise.
    """

    seed: int
    made_by: str
    parameters: Array
    steps: tuple[tuple[int, float], ...]
    interval_s: float
    rotation_rad: Array
    noise_rad: float
    peak_rad: float

    @property
    def samples(self) -> int:
        """How many samples there are."""
        return len(self.rotation_rad)

    @property
    def time_s(self) -> Array:
        """Sampling times."""
        return self.interval_s * np.arange(float(self.samples))

    @cached_property
    def _responses(self) -> StepResponses:
        return StepResponses(self.interval_s, self.samples, self.steps, inertia=True)

    def rotations(self, model: str, parameters: Array, *, slopes: bool = False) -> Array:
        """Compute rotations as `StepResponses` does."""
        return self._responses(model, parameters, slopes=slopes)

    def chi2(self, model: str, parameters: Array) -> Array:
        """Compute chi^2 of samples, (n,)."""
        residuals = (self.rotations(model, parameters)[0] - self.rotation_rad) / self.noise_rad
        return np.einsum("nt,nt->n", residuals, residuals)

    def chi2_of_misfit(self, misfit_rad: float) -> float:
        """Convert a root-mean-square misfit to chi^2."""
        return self.samples * (misfit_rad / self.noise_rad) ** 2


def trace_of(seed: int) -> Trace:
    """Draw a trace: sample, torques, sampling and noise."""
    rng = np.random.default_rng(seed)
    while True:
        made_by = str(rng.choice(TRIED))
        duration_s, samples = _between(rng, 3.0, 1000.0), round(_between(rng, 201, 2001))
        interval_s = duration_s / (samples - 1)
        parameters = plausible(made_by, 1, interval_s, duration_s, rng)
        steps = _steps(samples, rng)
        simulated = StepResponses(interval_s, samples, steps, inertia=True)
        clean = simulated(made_by, parameters)[0, 0]
        peak_rad = float(np.abs(clean).max())
        noise_rad = peak_rad * _between(rng, 0.001, 0.2)
        noise = noise_rad * rng.standard_normal(samples)
        if _creeps(clean, steps):
            return Trace(
                seed, made_by, parameters[0], steps, interval_s, clean + noise, noise_rad, peak_rad
            )


def plausible(
    model: str, count: int, interval_s: float, duration_s: float, rng: np.random.Generator
) -> Array:
    """Draw parameters, (count, n_parameters), with which a trace depends on the sample.

    Stiffnesses are around the gripper's own, and times between the sampling interval and the
    duration of the trace.
    """

    def stiffness() -> Array:
        return STIFFNESS / COUPLING * _between(rng, 0.1, 1000.0, count)

    def time() -> Array:
        return _between(rng, 2 * interval_s, duration_s, count)

    def drawn(parameter: Parameter, exponent: Array) -> Array:
        if parameter.kind == "damping":
            return stiffness() * time()
        if parameter.kind == "springpot":
            return stiffness() * time() ** exponent
        return exponent if parameter.kind == "exponent" else stiffness()

    exponent = rng.uniform(0.05, 0.95, count)
    low, high = np.exp(search_range(model))
    parameters = [drawn(parameter, exponent) for parameter in CANDIDATES[model].model.parameters]
    return np.clip(np.stack(parameters, axis=1), low, high)


def _between(rng: np.random.Generator, low: float, high: float, count: int | None = None) -> Any:
    """Draw numbers whose logarithms are uniform."""
    return np.exp(rng.uniform(np.log(low), np.log(high), count))


def _steps(samples: int, rng: np.random.Generator) -> tuple[tuple[int, float], ...]:
    """Draw two to four phases, none shorter than a tenth of the trace; the last may be free."""
    phases = int(rng.integers(2, 5))
    shares = 0.1 + (1 - 0.1 * phases) * rng.dirichlet(np.ones(phases))
    starts = np.round(np.cumsum([0.0, *shares[:-1]]) * (samples - 1)).astype(int)
    torques = _between(rng, 2e-10, 5e-9, phases)
    if rng.uniform() < 0.25:
        torques[-1] = 0.0
    return tuple(zip(starts.tolist(), np.diff(torques, prepend=0.0).tolist(), strict=True))


def _creeps(clean: Array, steps: Sequence[tuple[int, float]]) -> bool:
    """Tell whether a rotation differs from any multiple of the torque by 1 % of its peak."""
    torque = np.zeros_like(clean)
    for start, jump in steps:
        torque[start + 1 :] += jump
    difference = clean - torque * (torque @ clean) / (torque @ torque)
    return bool(np.sqrt(np.mean(difference**2)) > 0.01 * np.abs(clean).max())


def search_range(model: str) -> tuple[Array, Array]:
    """Return the logarithms of the ends of the default search range."""
    chosen = [_ranges()[p.range_name] for p in CANDIDATES[model].model.parameters]
    low, high = np.log([[genes.low, genes.high] for genes in chosen]).T
    return low, high


@cache
def _ranges() -> Mapping[str, GeneRange]:
    return set_up(GRIPPER, (hold(1.0, 1e-9),), CANDIDATES["damper"]).ranges


def fits_of(trace: Trace) -> dict[str, tuple[Array, float]]:
    """Fit all models with the library; return parameters and misfit in rad."""
    starts = [start for start, _ in trace.steps]
    torques = np.cumsum([jump for _, jump in trace.steps])
    lengths = np.diff([*starts, trace.samples - 1]) * trace.interval_s
    phases = tuple(map(hold, lengths.tolist(), torques.tolist()))
    experiment = set_up(GRIPPER, phases, CANDIDATES[TRIED[0]])
    problem = experiment.of(trace.time_s, trace.rotation_rad)
    found = fit_models(
        {model: [experiment.for_model(problem, CANDIDATES[model].model)] for model in TRIED},
        BUDGET,
        {model: [np.random.default_rng(trace.seed)] for model in TRIED},
        lambda: None,
    )
    return {model: (fit.parameters, fit.misfit_rad) for model, (fit,) in found.items()}


BUDGET = LeastSquaresSettings(candidates=1000, starts=16)
"""What the library's fits are given, as by default."""


class Weighted:
    """Residuals in units of the noise and their derivatives, for SciPy."""

    def __init__(self, trace: Trace, model: str) -> None:
        self._trace, self._model = trace, model
        self._at: Array | None = None
        self._found = np.empty(0)

    def residuals(self, logs: Array) -> Array:
        """Compute residuals, (n_samples,)."""
        return self._formed(logs)[0] - self._trace.rotation_rad / self._trace.noise_rad

    def slopes(self, logs: Array) -> Array:
        """Compute derivatives by the log-parameters, (n_samples, n_parameters)."""
        return self._formed(logs)[1:].T

    def _formed(self, logs: Array) -> Array:
        # SciPy asks for both at the same point.
        if self._at is None or not np.array_equal(self._at, logs):
            found = self._trace.rotations(self._model, np.exp(logs)[None], slopes=True)
            self._at, self._found = logs.copy(), found[:, 0] / self._trace.noise_rad
        return self._found


def lowest_chi2(
    trace: Trace, model: str, starts: Sequence[Array], effort: tuple[int, int] = THOROUGH
) -> float:
    """Find the lowest chi^2 within the search range by SciPy, from many starts.

    Parameters
    ----------
    trace, model
        Trace, and the model that is fitted to it.
    starts
        Parameters to start at, besides random ones.
    effort
        As of `THOROUGH`.
    """
    low, high = search_range(model)
    weighted = Weighted(trace, model)

    def fit(start: Array) -> float:
        found = least_squares(
            weighted.residuals,
            start,
            weighted.slopes,
            bounds=(low, high),
            ftol=TOLERANCE,
            xtol=TOLERANCE,
            gtol=TOLERANCE,
            max_nfev=MOST_STEPS,
        )
        return 2 * float(found.cost)

    given = [np.log(np.clip(start, np.exp(low), np.exp(high))) for start in starts]
    points = (*_screened(trace, model, effort), *given)
    return min(fit(np.clip(point, low, high)) for point in points)


# With a looser tolerance many fits stop on ridges.
TOLERANCE, MOST_STEPS = 1e-11, 200


def _screened(trace: Trace, model: str, effort: tuple[int, int]) -> Array:
    """Return the best of many random points, half from the whole range and half plausible ones."""
    drawn, starts = effort
    rng = np.random.default_rng([trace.seed, TRIED.index(model)])
    low, high = search_range(model)
    wide = rng.uniform(low, high, (drawn // 2, len(low)))
    last_s = trace.interval_s * (trace.samples - 1)
    near = np.log(plausible(model, drawn // 2, trace.interval_s, last_s, rng))
    best = []
    for points in (wide, near):
        chi2 = [trace.chi2(model, np.exp(some)) for some in np.array_split(points, 8)]
        best.append(points[np.argsort(np.concatenate(chi2))[: starts // 2]])
    return np.concatenate(best)


@dataclass(frozen=True)
class Judged:
    """A fit of the library, compared with the independent residuals.

    Parameters
    ----------
    chi2
        chi^2 of its parameters by the independent residuals.
    scipy
        Lowest chi^2 that SciPy finds.
    reported
        chi^2 from the misfit that the library reports.
    uncertainty
        Difference of `chi2` and `reported` that the accuracy of both responses explains.
    """

    chi2: float
    scipy: float
    reported: float
    uncertainty: float

    @property
    def above(self) -> float:
        """Difference to the best known chi^2."""
        return max(self.chi2 - self.scipy, 0.0)

    @property
    def consistent(self) -> bool:
        """Whether the reported misfit is that of the parameters."""
        return abs(self.reported - self.chi2) <= ALLOWED + self.uncertainty


def judged(trace: Trace, effort: tuple[int, int] = THOROUGH) -> dict[str, Judged]:
    """Fit all models to a trace, and compare the fits with SciPy's."""
    found = {}
    for model, (parameters, misfit_rad) in fits_of(trace).items():
        starts = [parameters, trace.parameters] if model == trace.made_by else [parameters]
        chi2 = float(trace.chi2(model, parameters[None])[0])
        found[model] = Judged(
            chi2,
            lowest_chi2(trace, model, starts, effort),
            trace.chi2_of_misfit(misfit_rad),
            _uncertainty(trace, model, chi2),
        )
    return found


def _uncertainty(trace: Trace, model: str, chi2: float) -> float:
    """Bound the change of chi^2 by errors of the response, by Cauchy and Schwarz."""
    power_law = CANDIDATES[model].model.power_law
    error = (ACCURACY_OF_POWER_LAWS if power_law else ACCURACY) * trace.peak_rad / trace.noise_rad
    return float(2 * np.sqrt(trace.samples * chi2) * error)


ACCURACY, ACCURACY_OF_POWER_LAWS = 1e-10, 5e-8
"""Largest difference to the library's responses of plausible samples, in shares of the peak.

The library replaces power laws by Maxwell branches, hence the second value.
"""


def wrong_way_round(
    found: Mapping[str, Judged], pairs: Sequence[tuple[str, str]]
) -> dict[tuple[str, str], float]:
    """Return by how much chi^2 of the richer model of each pair is above that of the other."""
    return {(less, more): found[more].chi2 - found[less].chi2 for less, more in pairs}


def violations(trace: Trace, found: Mapping[str, Judged]) -> Iterator[str]:
    """Describe everything that is wrong with the fits of a trace, a line each."""
    start = f"trace {trace.seed} ({trace.made_by})"
    for model in TRIED:
        fit = found[model]
        if fit.above > ALLOWED:
            yield f"{start}, {model}: chi^2 {fit.chi2:.3f}, best known {fit.scipy:.3f}"
        if not fit.consistent:
            yield f"{start}, {model}: chi^2 {fit.chi2:.3f}, by its misfit {fit.reported:.3f}"
    for kind, pairs in PAIRS.items():
        for (less, more), worse in wrong_way_round(found, pairs).items():
            if worse > ALLOWED:
                text = f"{more} {found[more].chi2:.3f}, {less} {found[less].chi2:.3f}"
                yield f"{start}, {kind}: chi^2 of {text}"


def tables(every: Sequence[Mapping[str, Judged]]) -> Iterator[str]:
    """Write the tables of models and of nested pairs in Markdown."""
    yield (
        "| model | fits | above the best known by more than 0.1 "
        "| largest | misfits not of their parameters | SciPy's above by more than 0.1 |"
    )
    yield "| --- | --- | --- | --- | --- | --- |"
    for model in TRIED:
        fits = [found[model] for found in every]
        cells = (
            len(fits),
            sum(fit.above > ALLOWED for fit in fits),
            f"{max((fit.above for fit in fits), default=0.0):.2g}",
            sum(not fit.consistent for fit in fits),
            sum(fit.scipy > fit.chi2 + ALLOWED for fit in fits),
        )
        yield f"| {' | '.join(map(str, (model, *cells)))} |"
    yield ""
    yield "| nested pairs | compared | wrong way round by more than 0.1 | largest |"
    yield "| --- | --- | --- | --- |"
    for kind, pairs in PAIRS.items():
        worse = [w for found in every for w in wrong_way_round(found, pairs).values()]
        wrong = sum(w > ALLOWED for w in worse)
        yield f"| {kind} | {len(worse)} | {wrong} | {max([0.0, *worse]):.2g} |"


def judged_of(seed: int) -> tuple[dict[str, Judged], list[str]]:
    """Draw a trace, fit it, and describe what is wrong."""
    trace = trace_of(seed)
    found = judged(trace)
    return found, list(violations(trace, found))


def main(traces: int, processes: int) -> None:
    """Print what is wrong, as it is found, and then the tables."""
    # Matrices are small. The processes read this when they import NumPy.
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    every = []
    with ProcessPoolExecutor(processes, mp_context=get_context("spawn")) as pool:
        for found, lines in pool.map(judged_of, range(traces)):
            every.append(found)
            for line in lines:
                print(line, flush=True)
    print("", *tables(every), sep="\n")


if __name__ == "__main__":
    main(
        int(sys.argv[1]) if len(sys.argv) > 1 else 500,
        int(sys.argv[2]) if len(sys.argv) > 2 else 2,
    )
