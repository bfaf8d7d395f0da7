"""Several traces of one sample, as one trace: residuals are stacked, parameters are shared.

Each trace is divided by its noise, whose standard deviation is known with some degrees of freedom.
What its instrument may have added, an offset, a drift, a contact, stays its own: it is projected
out of its own rows (`Condensed`). Of a start that is fitted along these allow to first order.
"""

from collections.abc import Iterator, Sequence
from copy import copy
from dataclasses import KW_ONLY, dataclass, field, replace
from typing import Any

import numpy as np

from biogrip.arrays import Array
from biogrip.fit.problem import TraceProblem
from biogrip.physics.condensed import Condensed, SweptRows
from biogrip.physics.noise import moduli_of, places_of, with_uncertain
from biogrip.physics.protocol import is_storage, spacing_at
from biogrip.physics.residuals import CondensedTrace, Residuals
from biogrip.physics.response import Modes, compute_modes
from biogrip.physics.sample_model import Network

# Step of a start over the time between readings: none of them lies so close to a step.
_OF_START = 1e-4


@dataclass(frozen=True, eq=False)
class StackedRows(Condensed):
    """Condensed rows of several traces, one after the other, each over its noise."""

    _: KW_ONLY
    rows: tuple[Condensed, ...]
    noise_sd: Array
    """Standard deviation of the noise of each, (n_traces,)."""

    def _each(self, samples: Array) -> Iterator[tuple[Condensed, Array]]:
        ends = np.cumsum([len(rows.all_s) for rows in self.rows])[:-1]
        yield from zip(self.rows, np.split(samples, ends, axis=-1), strict=True)

    def cleared(self, rows: Array) -> Array:
        """Project nuisance out of functions, (..., n_samples), and whiten noise, of each trace."""
        return np.concatenate([of.cleared(part) for of, part in self._each(rows)], axis=-1)

    def of_trace(self, readings: Array) -> Array:
        """Return rows of all traces without nuisance, (n_rows,)."""
        return np.concatenate([of.of_trace(part) for of, part in self._each(readings)])

    def of_modes(self, modes: Modes) -> Array:  # type: ignore[override]
        """Return rows of samples, (n, 1 + n_parameters, n_rows), whose modes all traces share."""
        pairs = zip(self.rows, self.noise_sd, strict=True)
        return np.concatenate([of.of_modes(modes) / sd for of, sd in pairs], axis=-1)

    @property
    def taken(self) -> Array:
        """Functions of free amplitude, (n_taken, n_samples), each of one trace."""
        from scipy.linalg import block_diag

        return np.asarray(block_diag(*(of.taken for of in self.rows)))


@dataclass(frozen=True, eq=False)
class StackedResiduals(Residuals):
    """Residuals of several traces of one sample, one after the other, each over its noise."""

    noise_sd: Array = field(default_factory=lambda: np.ones(0))
    """Standard deviation of the noise of each of the `parts`, (n_traces,)."""

    @property
    def pairs(self) -> list[tuple[Residuals, Any]]:
        """Residuals of each trace with the standard deviation of its noise."""
        return [*zip(self.parts, self.noise_sd, strict=True)]

    @property
    def duration_s(self) -> float:
        """Time of the last reading of any trace, or the longest that a sweep tells of."""
        return max(part.duration_s for part in self.parts)

    @property
    def covered_s(self) -> tuple[float, float]:
        """From when to when after a change there are readings, of any trace."""
        firsts, lasts = zip(*(part.covered_s for part in self.parts), strict=True)
        return min(firsts), max(lasts)

    def grip(self, log_parameters: Array) -> None:
        """Return nothing: the force of the jaws is told of each trace."""

    def ring(self, network: Network, noise_sd: float) -> None:
        """Return nothing: the ring of the arms is told of each trace."""

    @property
    def of_responses(self) -> tuple[Any, ...]:
        """What responses depend on."""
        return tuple((part.of_responses, float(sd)) for part, sd in self.pairs)

    def condensed_responses(self, log_parameters: Array, *, slopes: bool = True) -> Array:
        """Compute rows, (n, 1 + n_parameters, n_rows): traces of one kind share their modes."""
        parameters, modes, rows = np.exp(log_parameters), dict[Any, Modes](), list[Array]()
        for part, sd in self.pairs:
            kind = part.gripper, part.model, part.course.deforms
            if kind not in modes:
                given = part.gripper, part.model, part.course, parameters
                modes[kind] = compute_modes(*given, slopes=slopes)
            rows.append(part.trace.condensed.of_modes(modes[kind]) / sd)
        return np.concatenate(rows, axis=-1)

    def of_lags(self, rates: Array) -> Array:
        """Return what lags of unit amplitude show, (n_rates, n_samples)."""
        return np.concatenate([part.of_lags(rates) / sd for part, sd in self.pairs], axis=-1)

    def simulated(self, log_parameters: Array) -> Array:
        """Return responses and derivatives, not cleared, (1 + n_parameters, n_samples)."""
        rows = [part.simulated(log_parameters) / sd for part, sd in self.pairs]
        return np.concatenate(rows, axis=-1)


def stack(
    problems: Sequence[TraceProblem], noise_sd: Array, freedom: float = np.inf
) -> TraceProblem:
    """Return the problem of one sample of several traces.

    Parameters
    ----------
    problems
        The problem of each trace; models have the same parameters.
    noise_sd : (n_traces,)
        Standard deviation of the noise of each, in the unit of its readings.
    freedom
        Degrees of freedom with which the noise is known.
    """
    low = np.min([problem.low for problem in problems], axis=0)
    high = np.max([problem.high for problem in problems], axis=0)
    residuals = _stacked([problem.residuals for problem in problems], noise_sd, freedom)
    return TraceProblem(residuals, low, high, problems[0].ranges)


def _stacked(parts: Sequence[Residuals], noise_sd: Array, freedom: float) -> StackedResiduals:
    first, rows = parts[0], tuple(part.trace.condensed for part in parts)
    pairs, every_s = zip(parts, noise_sd, strict=True), np.concatenate([of.all_s for of in rows])
    readings = np.concatenate([part.trace.readings / sd for part, sd in pairs])
    none = np.zeros((0, len(every_s)))
    condensed = StackedRows(first.course, every_s, none, rows=rows, noise_sd=noise_sd)
    trace = CondensedTrace(readings, condensed, None if freedom < np.inf else 1.0, 1.0)
    given = first.gripper, first.model, first.course, trace
    own: dict[str, Any] = {"instrument": first.instrument, "parts": tuple(parts)}
    return StackedResiduals(*given, **own, noise_sd=noise_sd, freedom=freedom)


def with_uncertain_start(problem: TraceProblem, best: Array, start_sd: float) -> TraceProblem:
    """Return a problem whose protocol may start sooner or later than at its best fit.

    The derivative of the response by the start, at log-parameters (n_parameters,), is added with a
    random amplitude (`with_uncertain`), whose standard deviation is in s: limits allow for it.
    """
    residuals, rows = problem.residuals, problem.residuals.trace.condensed
    step_s = _OF_START * spacing_at(residuals.trace.time_s, 0.0)
    sooner, later = (residuals.later(by_s).response(best) for by_s in (-step_s, step_s))
    by_start = start_sd / residuals.noise_scale * rows.cleared(later - sooner) / (2 * step_s)
    nuisance = with_uncertain(rows.nuisance, by_start[None])
    whitening = copy(rows.whitening)
    if whitening is not None:
        whitening.nuisance = nuisance
    rows = replace(rows, functions=nuisance[: len(nuisance) * (whitening is None)])
    trace = replace(residuals.trace, condensed=replace(rows, whitening=whitening))
    return replace(problem, residuals=replace(residuals, trace=trace))


@dataclass(frozen=True, eq=False)
class _InverseRows(SweptRows):
    """Rows of a sweep by what its sample yields, G* = G*^2 J*, with moduli G* as measured."""

    _: KW_ONLY
    readings: Array

    def of_modes(self, modes: Modes) -> Array:  # type: ignore[override]
        """Return rows of lags, (n_rates, 1, n_samples), of rates that modes have one each."""
        return self.cleared(self.of_lags(-modes.rates[:, 0]))[:, None]

    def of_lags(self, rates: Array) -> Array:
        """Return what lags of unit compliance add to the moduli, (n_rates, n_samples)."""
        stored, lost = moduli_of(self.readings, self.all_s)
        omega = self.all_s[is_storage(self.all_s)]
        shown = (stored + 1j * lost) ** 2 / (1 + 1j * omega / rates[:, None])
        return places_of(np.stack((shown.real, shown.imag), axis=-2), self.all_s)


@dataclass(frozen=True, eq=False)
class _SweptCompliance(Residuals):
    """A sweep as one of traces under a load."""

    def of_lags(self, rates: Array) -> Array:
        """Return what lags of unit compliance add to the moduli, (n_rates, n_samples)."""
        assert isinstance(self.trace.condensed, _InverseRows)
        return self.trace.condensed.of_lags(rates)


def of_one_kind(residuals: Residuals) -> Residuals:
    """Return the residuals of those of several traces that tell together of any linear sample.

    Under a load a sample's lags add, under a deformation what they leave does, and of grippers each
    has its own. Of traces of several kinds the most are taken. A sweep is of both: to first order
    in its noise, its compliances are the inverse of its moduli.
    """
    assert isinstance(residuals, StackedResiduals)
    kinds: dict[Any, list[tuple[Residuals, Any]]] = {}
    sweeps = [pair for pair in residuals.pairs if pair[0].course.sweeps]
    both = [(_inverse(of), sd) for of, sd in sweeps if len({*is_storage(of.trace.time_s)}) > 1]
    for part, sd in residuals.pairs:
        kind = part.course.sweeps, part.gripper, part.course.deforms
        kinds.setdefault(kind, []).append((part, sd))
    for (swept, _, deforms), of_kind in kinds.items():
        if not (swept or of_kind[0][0].instrument.has_jaws):
            of_kind += sweeps if deforms else both
    parts, noise_sd = zip(*max(kinds.values(), key=len), strict=True)
    return _stacked(parts, np.array(noise_sd), residuals.freedom)


def _inverse(part: Residuals) -> Residuals:
    """Return the residuals of a sweep as those of a trace under a load."""
    rows, trace = part.trace.condensed, part.trace
    given = rows.course, rows.all_s, rows.functions, rows.whitening
    trace = replace(trace, condensed=_InverseRows(*given, readings=trace.readings))
    of_part = part.gripper, part.model, part.course, trace
    return _SweptCompliance(*of_part, instrument=part.instrument)
