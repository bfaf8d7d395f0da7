"""Every method on the same traces, and what is counted of it."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from scipy.optimize import least_squares

from benchmarks.field.elements import Maxwell
from benchmarks.field.fitted import CREEP, Fitted, Limits, Method, attempt, truths
from benchmarks.field.traces import Trace
from benchmarks.section import Row
from benchmarks.timing import Timed, clocked
from biogrip.arrays import Array


@dataclass
class Runs:
    """What a method did, trace by trace.

    Parameters
    ----------
    fit_s, whole_s
        Time of the fit; with limits.
    chi2
        Of what was fitted; infinite where nothing was.
    found, compliance, limits
        Samples, creep compliances and limits; none where there are none.
    failures
        Kinds of errors.
    """

    fit_s: list[float] = field(default_factory=list)
    whole_s: list[float] = field(default_factory=list)
    chi2: list[float] = field(default_factory=list)
    found: list[Maxwell | None] = field(default_factory=list)
    compliance: list[Array | None] = field(default_factory=list)
    limits: list[Limits | None] = field(default_factory=list)
    failures: Counter[str] = field(default_factory=Counter)

    def run(self, method: Method, trace: Trace) -> None:
        """Identify a trace, and keep what came of it."""
        fit_s, fitted = clocked(partial(attempt, partial(method.fit, trace), self.failures))
        wanted = fitted.limits if fitted is not None else None
        limits_s, limits = (
            clocked(partial(attempt, wanted, self.failures)) if wanted else (0.0, None)
        )
        self.fit_s.append(fit_s)
        self.whole_s.append(fit_s + limits_s)
        self.chi2.append(np.inf if fitted is None else chi2(trace, method.measured, fitted))
        self.found.append(None if fitted is None else fitted.sample)
        self.compliance.append(
            None if fitted is None else _compliance(trace, method.measured, fitted)
        )
        self.limits.append(limits)


def chi2(trace: Trace, measured: str, fitted: Fitted) -> float:
    """Return the square sum of what a fit leaves, in units of the noise; infinite for no number."""
    left = (fitted.curve - _data(trace, measured)) / _noise(trace, measured)
    found = float(left @ left)
    return found if np.isfinite(found) else np.inf


def chi2_from_truth(trace: Trace, measured: str) -> float:
    """Return chi^2 of the optimum in the basin of the truth, by SciPy in the logarithms."""
    n, data, noise = trace.branches, _data(trace, measured), _noise(trace, measured)

    def rows(x: Array) -> Array:
        sample = Maxwell(float(np.exp(x[0])), np.exp(x[1 : n + 1]), np.exp(x[n + 1 :]))
        curve = sample.compliance if measured == CREEP else sample.modulus
        return np.asarray((curve(trace.time_s) - data) / noise)

    truth = trace.sample
    start = np.log([truth.k_p, *truth.k, *truth.tau])
    return 2.0 * float(least_squares(rows, start, xtol=1e-12, ftol=1e-12).cost)


def compared(methods: Sequence[Method], ours: str, branches: int, count: int) -> list[Row]:
    """Identify so many traces by every method in turn, after a warm-up; a row a method."""
    runs = {method.name: Runs() for method in methods}
    for method in methods:
        Runs().run(method, Trace(branches, count))
    traces = [Trace(branches, seed) for seed in range(count)]
    for trace in traces:
        for method in methods:
            runs[method.name].run(method, trace)
    timed = {
        "fit": Timed({name: np.array(run.fit_s) for name, run in runs.items()}),
        "whole": Timed({name: np.array(run.whole_s) for name, run in runs.items()}),
    }
    best = {
        measured: _lowest(
            [chi2_from_truth(trace, measured) for trace in traces],
            *(
                runs[method.name].chi2
                for method in methods
                if method.measured == measured and not method.more_general
            ),
        )
        for measured in {method.measured for method in methods}
    }
    rows: list[Row] = []
    for method in methods:
        run = runs[method.name]
        above = np.array(run.chi2) - best[method.measured]
        row: Row = {
            "branches": branches,
            "method": method.name,
            "measured": method.measured,
            "traces": count,
            "reached": int(np.sum(above < 1)),
            "failures": dict(run.failures),
            **_errors(traces[0], run),
            **coverage([trace.sample for trace in traces], run.limits),
        }
        for part, times in timed.items():
            row |= {f"{part}_{key}": x for key, x in times.against(method.name, ours).items()}
        rows.append(row)
    return rows


def _data(trace: Trace, measured: str) -> Array:
    return trace.compliance if measured == CREEP else trace.modulus


def _noise(trace: Trace, measured: str) -> float:
    return trace.compliance_noise if measured == CREEP else trace.modulus_noise


def _lowest(*chi2s: Sequence[float]) -> Array:
    lowest: Array = np.min(np.array(chi2s), axis=0)
    return lowest


def _compliance(trace: Trace, measured: str, fitted: Fitted) -> Array | None:
    if measured == CREEP:
        return fitted.curve
    return None if fitted.sample is None else fitted.sample.compliance(trace.time_s)


def _errors(trace: Trace, run: Runs) -> Mapping[str, object]:
    """Medians over traces of relative errors; where there is no answer they are infinite."""
    expected, truth = trace.sample.compliance(trace.time_s), trace.sample.named()
    compliance = [
        np.inf if found is None else np.sqrt(np.mean((found / expected - 1) ** 2))
        for found in run.compliance
    ]
    parameters = [
        [abs(value.get(name, np.inf) / truth[name] - 1) for name in truth]
        for value in (_comparable(sample, truth) for sample in run.found)
    ]
    medians = np.median(parameters, axis=0)
    return {
        "compliance_error": _finite(float(np.median(compliance))),
        "parameter_errors": {
            name: _finite(float(error)) for name, error in zip(truth, medians, strict=True)
        },
    }


def _comparable(sample: Maxwell | None, truth: Mapping[str, float]) -> Mapping[str, float]:
    """Parameters of a sample, if it has as many branches; else none is known to be which."""
    value = {} if sample is None else sample.named()
    return value if value.keys() == truth.keys() else {}


def coverage(samples: Sequence[Maxwell], limits: Sequence[Limits | None]) -> Mapping[str, object]:
    """Return how many limits there are, are on both sides, and have the truth between them."""
    holds: Counter[str] = Counter()
    given: Counter[str] = Counter()
    closed = 0
    for sample, each in zip(samples, limits, strict=True):
        truth = truths(sample)
        for name, (low, high) in (each or {}).items():
            if name in truth:
                given[name] += 1
                holds[name] += low <= truth[name] <= high
                closed += bool(np.isfinite(low) and np.isfinite(high))
    return {
        "intervals": given.total(),
        "intervals_closed": closed,
        "intervals_hold": holds.total(),
        "coverage": {name: holds[name] / given[name] for name in given},
    }


def _finite(value: float) -> float | None:
    """JSON has no infinity."""
    return value if np.isfinite(value) else None
