"""What every method gives, and how it is kept to one process, silence and a time limit."""

import io
import logging
import signal
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass
from typing import TypeVar

from benchmarks.field.elements import Maxwell
from benchmarks.field.traces import Trace
from biogrip.arrays import Array

Result = TypeVar("Result")

Limits = Mapping[str, tuple[float, float]]
"""95 % limits by parameter, named as of `Maxwell.named`, `Kelvin.named` and below."""

CREEP, RELAXATION = "creep", "relaxation"

TIME_LIMIT_S = 60.0
"""Of a fit, and once more of its limits."""


@dataclass(frozen=True)
class Fitted:
    """What a method found in a trace.

    Parameters
    ----------
    sample
        The sample, branches by relaxation time; none if it cannot be had from springs and dampers.
    curve : (n_samples,)
        What it draws through what it was given.
    limits
        Finds its limits, if it has any.
    """

    sample: Maxwell | None
    curve: Array
    limits: Callable[[], Limits] | None = None


@dataclass(frozen=True)
class Method:
    """A way to identify a sample.

    Parameters
    ----------
    name
        In tables.
    fit
        Does it.
    measured
        What it is given: the trace of creep, or one of relaxation.
    more_general
        Whether its model has an element more than the samples, and so fits noise better.
    """

    name: str
    fit: Callable[[Trace], Fitted]
    measured: str = CREEP
    more_general: bool = False


def truths(sample: Maxwell) -> dict[str, float]:
    """Return all that a limit may be of, by name."""
    dampers = {f"c_{j}": float(c) for j, c in enumerate(sample.k * sample.tau, start=1)}
    return {**sample.named(), **dampers, **sample.kelvin().named(), "flow": 0.0}


@contextmanager
def kept_in_bounds() -> Iterator[None]:
    """Keep quiet whoever prints, warns or logs, and stop whoever takes too long."""

    def stop(*_: object) -> None:
        raise TimeoutError

    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, TIME_LIMIT_S)
    logging.disable(logging.CRITICAL)
    try:
        with warnings.catch_warnings(), redirect_stdout(io.StringIO()):
            warnings.simplefilter("ignore")
            yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
        logging.disable(logging.NOTSET)


def attempt(call: Callable[[], Result], failures: Counter[str]) -> Result | None:
    """Call others' code: whatever it raises is a result, too, and is counted by its kind."""
    try:
        with kept_in_bounds():
            return call()
    except Exception as error:
        failures[type(error).__name__] += 1
        return None
