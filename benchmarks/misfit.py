"""The misfit of a population, beside forming the responses with NumPy."""

from collections.abc import Callable
from functools import partial

import numpy as np

from benchmarks.noisy_traces import OURS, NoisyTrace, noisy_trace
from benchmarks.report import Row, Section, number, times_ours
from benchmarks.timing import alternate
from biogrip.arrays import Array, parts
from biogrip.physics.response import step_response, superpose

_POPULATION, _ROUNDS = 500, 7
# Numbers formed at once: what fits a processor's cache is faster than all.
_AT_ONCE = 400_000


def measure() -> list[Row]:
    """Time every way."""
    trace = noisy_trace()
    genes = trace.genome.draw(_POPULATION, np.random.default_rng(1))
    samples, misfit = trace.genome.decode(genes), trace.misfit()
    ways: dict[str, Callable[[], object]] = {
        OURS: partial(misfit, samples),
        "biogrip, its table made anew": lambda: trace.misfit()(samples),
        "vectorised numpy": partial(vectorised, trace, samples),
        "vectorised numpy, in blocks": partial(in_blocks, trace, samples),
    }
    timed = alternate(ways, _ROUNDS)
    return [{"way": name, **timed.against(name, OURS)} for name in ways]


def vectorised(trace: NoisyTrace, samples: Array) -> Array:
    """Form all responses at once and average their squared distance."""
    response = step_response(trace.gripper, trace.model.network(samples), inertia=False)
    difference = superpose(response, trace.steps, trace.time_s) - trace.trace_rad
    misfit: Array = np.sqrt(np.mean(difference**2, axis=1))
    return misfit


def in_blocks(trace: NoisyTrace, samples: Array) -> Array:
    """Do so with as many at a time as fit a processor's cache."""
    at_once = max(1, _AT_ONCE // len(trace.time_s))
    response_of = partial(step_response, trace.gripper, inertia=False)
    found = []
    for some in parts(len(samples), at_once):
        response = response_of(trace.model.network(samples[some]))
        difference = superpose(response, trace.steps, trace.time_s)
        difference -= trace.trace_rad
        squares = np.einsum("nt,nt->n", difference, difference)
        found.append(np.sqrt(squares / len(trace.time_s)))
    return np.concatenate(found)


MISFIT = Section(
    "misfit",
    f"Misfit of {_POPULATION} individuals against 4001 samples",
    f"""\
RMS misfit of {_POPULATION} individuals, drawn uniformly from the search range, against one trace of
4001 samples. *biogrip* sums geometric series and looks up the sums over the trace in a table, made
once a trace; it forms no response. *Vectorised numpy* forms all of them from the closed form, in
one go or *in blocks*, as many at a time as fit a processor's cache.""",
    {
        "way": lambda row: row["way"],
        "time (ms)": lambda row: number(row["time_ms"]),
        "times ours (lowest to highest)": times_ours,
    },
    measure,
)
