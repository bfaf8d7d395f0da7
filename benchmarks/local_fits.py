"""Local fits from the same starts, against other libraries driving the same residuals."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial

import numpy as np

from benchmarks.batch import BATCH
from benchmarks.fit_peers import by_lmfit, by_pypesto, by_scipy, by_scipy_in_two_turns
from benchmarks.section import Row, Section, number, times_ours
from benchmarks.setup import problem
from benchmarks.starts import Started, fitted, started
from benchmarks.timing import Timed, alternate
from biogrip.arrays import Array
from biogrip.identify.multi_start import FINISHED

OURS, SIDE_BY_SIDE = "biogrip", f"biogrip, {BATCH} traces side by side"
SCIPY, SCIPY_IN_TURNS = "SciPy least_squares", "SciPy least_squares, in two turns"
LMFIT, PYPESTO = "lmfit", "pyPESTO"
_ROUNDS, _FEW = 5, 3

Fitter = Callable[[Started], Array]

PEERS: Mapping[str, Fitter] = {
    SCIPY: by_scipy,
    SCIPY_IN_TURNS: by_scipy_in_two_turns,
    LMFIT: by_lmfit,
    PYPESTO: by_pypesto,
}


def _text(starts: int) -> str:
    return f"""\
Traces of Table 5's sample, each fitted from the same {starts} starting points, the best of random
ones as in the study, to the best of the optima that they lead to. *biogrip* fits all starts at
once, roughly, then the best {FINISHED} to the end, and settles the best of these to its last digit
on all samples; *{BATCH} traces side by side*, as the study does, all starts of all traces. The
others drive the same residuals and Jacobian, condensed to the same rows, one fit after the other
and each to its own default tolerance (`benchmarks/fit_peers.py`): SciPy's trust region (trf);
lmfit's Levenberg-Marquardt (leastsq, bounds by its transformation, Dfun); pyPESTO's multi-start of
SciPy's trust region (ls_trf). *In two turns*, SciPy is spared what biogrip is spared: rough fits,
and the best {FINISHED} to the end. What is done once for all traces, and the starting points, are
not included. All but the batch are timed on its first {_FEW} traces, and times are those of one.
The last column, over all {BATCH}: chi^2 = n (m/m_best)^2, n the samples and m_best the lowest
misfit that any of them found, above its smallest value."""


def local_fits_section() -> Section:
    """Time every library, and measure how far from the best optima it ends."""
    traces = started([problem(seed) for seed in range(BATCH)])
    rows = compared(traces, _FEW, _ROUNDS)
    columns: dict[str, Callable[[Row], str]] = {
        "library": lambda row: row["library"],
        "time a trace (ms)": lambda row: number(row["time_ms"]),
        "times ours (lowest to highest)": times_ours,
        "times ours side by side": lambda row: number(row["times_side_by_side"]),
        "largest chi^2 above the best": lambda row: f"{row['largest_chi2_above_best']:.1g}",
    }
    title, text = "Local fits", _text(len(traces[0].starts))
    return Section("local_fits", title, text, columns, rows)


def compared(traces: Sequence[Started], few: int, rounds: int) -> list[Row]:
    """Fit traces by every library; all but the batch are timed on the first few."""
    alone: dict[str, Fitter] = {OURS: lambda trace: fitted([trace])[0], **PEERS}
    calls: dict[str, Callable[[], object]] = {
        name: partial(_one_by_one, fitter, traces[:few]) for name, fitter in alone.items()
    }
    calls[SIDE_BY_SIDE] = partial(fitted, traces)
    timed = alternate(calls, rounds)
    counts = {name: len(traces) if name == SIDE_BY_SIDE else few for name in calls}
    a_trace = Timed({name: spent / counts[name] for name, spent in timed.seconds.items()})
    found = {name: _one_by_one(fitter, traces) for name, fitter in alone.items()}
    found[SIDE_BY_SIDE] = fitted(traces)
    above = _chi2_above_best(traces, found)
    return [
        {
            "library": name,
            **a_trace.against(name, OURS),
            "times_side_by_side": a_trace.against(name, SIDE_BY_SIDE)["times_ours"],
            "traces_timed": counts[name],
            "largest_chi2_above_best": float(above[name].max()),
        }
        for name in (OURS, SIDE_BY_SIDE, *PEERS)
    ]


def _one_by_one(fitter: Fitter, traces: Sequence[Started]) -> Array:
    return np.array([fitter(trace) for trace in traces])


def _chi2_above_best(traces: Sequence[Started], found: Mapping[str, Array]) -> dict[str, Array]:
    """By library and trace; each entry of what was found is (n_traces, n_parameters)."""
    misfits = np.array(
        [
            trace.case_problem.misfit(np.exp([each[index] for each in found.values()]))
            for index, trace in enumerate(traces)
        ]
    ).T
    samples = traces[0].case_problem.residuals.samples
    return dict(zip(found, samples * ((misfits / misfits.min(axis=0)) ** 2 - 1), strict=True))
