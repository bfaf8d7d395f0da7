"""Local fits from the same starts, by other libraries on the same residuals, too."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from benchmarks.fit_peers import by_lmfit, by_scipy, by_scipy_in_two_turns
from benchmarks.noisy_traces import BATCH, OURS, SIDE_BY_SIDE, case, noisy_trace
from benchmarks.report import Row as ReportRow
from benchmarks.report import Section, number, times_ours
from benchmarks.timing import Timed, alternate
from biogrip.arrays import Array
from biogrip.fit.least_squares import FINISHED, best_of_starts, screened
from biogrip.fit.problem import HistoryRow, TraceProblem, silent

_ROUNDS, _FEW = 5, 3

PEERS: Mapping[str, Callable[[TraceProblem, Array], Array]] = {
    "SciPy least_squares": by_scipy,
    "SciPy least_squares, in two turns": by_scipy_in_two_turns,
    "lmfit": by_lmfit,
}


@dataclass(frozen=True)
class Started:
    """A trace, and where its fits start."""

    problem: TraceProblem
    starts: Array
    """Log-parameters, (n_starts, n_parameters)."""
    before: HistoryRow
    """First row of the history, see `best_of_starts`."""


def started(seed: int) -> Started:
    """Choose starting points as the study's least squares does, from the best of random ones."""
    problem = noisy_trace(seed).problem()
    return Started(problem, *screened(problem, _settings(), np.random.default_rng(seed)))


def _settings() -> Any:
    return case().block.least_squares


def by_biogrip(traces: Sequence[Started]) -> Array:
    """Fit traces side by side as the study does; log-parameters, (n_traces, n_parameters)."""
    answers = best_of_starts(
        [trace.problem for trace in traces],
        [trace.starts for trace in traces],
        [trace.before for trace in traces],
        silent,
    )
    return np.log([answer.parameters for answer in answers])


def measure() -> list[ReportRow]:
    """Time every library, and measure how far from the best optima it ends."""
    traces = [started(seed) for seed in range(BATCH)]

    def one_by_one(fitter: Callable[[Started], Array], some: Sequence[Started]) -> Array:
        return np.array([fitter(trace) for trace in some])

    def theirs(fit: Callable[[TraceProblem, Array], Array], trace: Started) -> Array:
        return fit(trace.problem, trace.starts)

    alone: dict[str, Callable[[Started], Array]] = {
        OURS: lambda trace: by_biogrip([trace])[0],
        **{name: partial(theirs, fit) for name, fit in PEERS.items()},
    }
    calls: dict[str, Callable[[], Array]] = {
        name: partial(one_by_one, fitter, traces[:_FEW]) for name, fitter in alone.items()
    }
    calls[SIDE_BY_SIDE] = partial(by_biogrip, traces)
    timed = alternate(calls, _ROUNDS)
    counts = {name: len(traces) if name == SIDE_BY_SIDE else _FEW for name in calls}
    a_trace = Timed({name: spent / counts[name] for name, spent in timed.seconds.items()})
    found = {name: one_by_one(fitter, traces) for name, fitter in alone.items()}
    found[SIDE_BY_SIDE] = by_biogrip(traces)
    above = _chi2_above_best(traces, found)
    return [
        {
            "library": name,
            **a_trace.against(name, OURS),
            "times_side_by_side": a_trace.against(name, SIDE_BY_SIDE)["times_ours"],
            "largest_chi2_above_best": float(above[name].max()),
        }
        for name in (OURS, SIDE_BY_SIDE, *PEERS)
    ]


def _chi2_above_best(traces: Sequence[Started], found: Mapping[str, Array]) -> dict[str, Array]:
    """By library and trace; each entry of what was found is (n_traces, n_parameters)."""
    misfits = np.array(
        [
            trace.problem.residuals.misfit(np.exp([each[index] for each in found.values()]))
            for index, trace in enumerate(traces)
        ]
    ).T
    samples = traces[0].problem.residuals.samples
    return dict(zip(found, samples * ((misfits / misfits.min(axis=0)) ** 2 - 1), strict=True))


LOCAL_FITS = Section(
    "local_fits",
    "Local fits",
    f"""\
Traces of Table 5's sample, each fitted from the same {_settings().starts} starting points, the best
of random ones as in the study, to the best of the optima that they lead to. *biogrip* fits all
starts at once, roughly, then the best {FINISHED} to the end; *{BATCH} traces side by side*, as the
study does, all starts of all traces. The others drive the same residuals and Jacobian, condensed to
the same rows, one fit after the other and each to its own default tolerance
(`benchmarks/fit_peers.py`): SciPy's trust region (trf), and lmfit's Levenberg-Marquardt (leastsq,
bounds by its transformation, Dfun). *In two turns*, SciPy is spared what biogrip is spared: rough
fits, and the best {FINISHED} to the end. What is done once for all traces, and the starting points,
are not included. All but the batch are timed on its first {_FEW} traces, and times are those of
one. The last column, over all {BATCH}: chi^2 = n (m/m_best)^2, n the samples and m_best the lowest
misfit that any of them found, above its smallest value.""",
    {
        "library": lambda row: row["library"],
        "time a trace (ms)": lambda row: number(row["time_ms"]),
        "times ours (lowest to highest)": times_ours,
        "times ours side by side": lambda row: number(row["times_side_by_side"]),
        "largest chi^2 above the best": lambda row: f"{row['largest_chi2_above_best']:.1g}",
    },
    measure,
)
