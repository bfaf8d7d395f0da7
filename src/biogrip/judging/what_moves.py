"""Errors of the printed values: by how much each quantity is off if the instrument is.

Limits take zero, gain, clock and steps of an instrument as exact. If these add d to the readings, a
fit's parameters move by

    (J J^T + s^2)^-1 J d,

to first order: a step of Gauss-Newton. J has the slopes of the response by the log-parameters in
white noise of the standard deviation s; the s^2 is a prior of one e-fold, as in
`Likelihood.deviation`. Any linear sample is fitted again. What is printed is then too large by the
exponential of that, less one. No test is asked if it would see the error: who knows the instrument
knows how large it is.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from biogrip.arrays import Array
from biogrip.digits import plain
from biogrip.judging.likelihood import Likelihood, Quantity
from biogrip.physics.protocol import is_storage, spacing_at
from biogrip.physics.residuals import Residuals

# Error of a zero and of a gain, as a share; of a phase, in rad; last decimal of what they move, and
# most e-folds.
_WRONG_SHARE, _WRONG_PHASE, _DECIMALS, _MOST = 0.01, np.radians(1.0), 6, 10.0

LEAST_MOVE = 1e-4
"""Error of a quantity, over its value, below which it is not worth a line."""

Response = Callable[[Residuals], Array]
"""What a sample shows, (n_samples,), under the protocol and at the times of residuals."""


@dataclass(frozen=True)
class Mistake:
    """An error of the instrument."""

    name: str
    """`zero`, `gain`, `clock` or `rise`; of a sweep `gain` or `phase`."""
    words: str
    """A clause that says what is wrong, and by how much."""
    change: Array
    """What it adds to the readings, (n_samples,)."""


@dataclass(frozen=True)
class Move:
    """What an error of the instrument does to the result."""

    name: str
    """Name of the `Mistake`."""
    words: str
    """Its clause."""
    changes: dict[str, float]
    """Error of each printed quantity over its value, by its label: 0.1 if it is 10 % too high."""


def find_mistakes(residuals: Residuals, response: Response) -> Iterator[Mistake]:
    """Yield the usual errors of an instrument: of zero, gain, clock and steps, or of a phase.

    Several traces of one sample have an instrument each: what moves it is told of each.
    """
    if residuals.parts:
        return
    time_s, shown = residuals.trace.time_s, response(residuals)
    read, controlled = (
        channel.name.replace("_", " ")
        for channel in (residuals.instrument.read, residuals.instrument.controlled)
    )
    if residuals.course.sweeps:
        turned = np.where(is_storage(time_s), -1.0, 1.0) * shown[::-1]
        yield Mistake("gain", "the moduli are read 1 % too large", _WRONG_SHARE * shown)
        if np.any(is_storage(time_s)):
            yield Mistake("phase", "the phase is read 1 degree too large", _WRONG_PHASE * turned)
        return
    zero = np.full(len(time_s), _WRONG_SHARE * float(np.max(np.abs(shown))))
    yield Mistake("zero", "the zero is 1 % of the peak too high", zero)
    gain = f"the {read} is read 1 % too large, or the {controlled} 1 % too small"
    yield Mistake("gain", gain, _WRONG_SHARE * shown)
    interval_s, first_s = spacing_at(time_s, 0.0), float(time_s[time_s > 0][0])
    earlier = residuals.later(-interval_s)
    words = f"the {controlled} came one interval between readings, {interval_s:.2g} s, earlier"
    yield Mistake("clock", f"{words} than told", response(earlier) - shown)
    # Readings within a rise would show it.
    rise_s = min(interval_s, first_s)
    until = "one interval between readings" if rise_s == interval_s else "until the first reading"
    slower = replace(residuals, course=residuals.course.risen(rise_s))
    words = f"the {controlled} took {rise_s:.2g} s, {until}, to rise, which was not told"
    yield Mistake("rise", words, response(slower) - shown)


def find_moves(
    likelihood: Likelihood, quantities: Sequence[Quantity], *, start_fitted: bool = False
) -> list[Move]:
    """Return what the usual errors of an instrument do to quantities.

    A start that is fitted along takes what of them is another start.
    """
    residuals, best = likelihood.problem.residuals, likelihood.best
    mistakes = list(find_mistakes(residuals, lambda other: other.response(best)))
    cleared = residuals.trace.condensed.cleared(np.array([each.change for each in mistakes]))
    _, slopes = residuals(best)
    starts = [each.name == "clock" and start_fitted for each in mistakes]
    slopes = np.vstack((slopes, cleared[starts]))
    information = slopes @ slopes.T + likelihood.noise_sd**2 * np.eye(len(slopes))
    moved = np.linalg.lstsq(information, slopes @ cleared.T)[0][: len(best)]
    changes = np.array([quantity.gradient(best) for quantity in quantities]) @ moved
    return as_moves(mistakes, [quantity.label for quantity in quantities], changes)


def as_moves(mistakes: Sequence[Mistake], labels: Sequence[str], changes: Array) -> list[Move]:
    """Return what errors do to quantities, without those that are NaN.

    Changes are of their logarithms, (n_labels, n_errors).
    """
    relative = np.expm1(np.clip(changes, -_MOST, _MOST))
    columns = (np.round(relative, _DECIMALS) + 0.0).T.tolist()
    rows = (zip(labels, column, strict=True) for column in columns)
    return [
        Move(mistake.name, mistake.words, {label: by for label, by in row if not math.isnan(by)})
        for mistake, row in zip(mistakes, rows, strict=True)
    ]


def error_in_words(by: float) -> str:
    """Return how far a printed value is off; beyond a factor of two a linear estimate ends."""
    if by > 1 or by < -0.5:
        return f"as {'more than twice' if by > 0 else 'less than half'} what it is"
    if abs(by) < LEAST_MOVE:
        return "right"
    return f"{plain(100 * abs(by), 2)} % too {'low' if by < 0 else 'high'}"
