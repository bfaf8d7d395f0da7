"""A recorded load or deformation as a protocol: a piece from row to row, along all that was read.

Between two rows it is the cubic that has the readings and the rates at both. The rate at a row is

- that of the side on which the rows go on in a line, as beside a step; if they do on both sides,
  each on its own, the rate jumps there;
- else that of the quartic through five rows, where these are smooth: of a sinusoid with 25 rows a
  period it is off by 1e-4, where the mean of the rates on both sides is off by 1e-2;
- the mean of both sides elsewhere, as in noise;
- at the second row it jumps if nothing changed up to there.

A step of which the rows tell only between which two of them it came stands in the middle
(`with_steps`); how far it may be from there is uncertain.
"""

import numpy as np

from biogrip.arrays import Array, BoolArray
from biogrip.physics.protocol import Course

# Rows around one of which a quartic is known, and that many on either side.
_ROWS, _ASIDE = 5, 2
# Change of the second derivative from row to row, as a share of its size, in smooth rows; second
# derivative of rows in a line, as a share of that at the end of the line.
_SMOOTH, _STRAIGHT = 0.25, 0.1
# Change from row to row that is a step: over those of the rows around, and of the extent.
_ABRUPT, _LEAST_STEP = 8.0, 0.01


def with_steps(record: Array) -> tuple[Array, Array]:
    """Return a record, (n, 2), with a step in the middle of each two rows between which one came.

    A step is two rows of one time. Also returned are standard deviations of their times in s,
    (n_steps,), which are anywhere between the rows.
    """
    time_s, values = record.T
    sizes = np.pad(np.abs(np.diff(values)), _ASIDE)
    around = [np.roll(sizes, by) for by in (-2, -1, 1, 2)]
    abrupt = sizes > np.maximum(_ABRUPT * np.max(around, axis=0), _LEAST_STEP * np.ptp(values))
    before = np.flatnonzero(abrupt[_ASIDE:-_ASIDE])
    middle_s = 0.5 * (time_s[before] + time_s[before + 1])
    steps = np.stack((np.repeat(middle_s, 2), np.ravel(values[before[:, None] + [0, 1]])), axis=1)
    lasts_s = time_s[before + 1] - time_s[before]
    return np.insert(record, np.repeat(before + 1, 2), steps, axis=0), lasts_s / np.sqrt(12)


def follow_rows(time_s: Array, values: Array, *, deforms: bool) -> Course:
    """Return the protocol that goes through all rows of a record, from the first on.

    Parameters
    ----------
    time_s : (n,)
        Times from the start of the protocol, ascending, at least two; two rows of one time are a
        step. Where nothing changes, rows make no phases of their own.
    values : (n,)
        What was controlled; at the first row it jumps there from zero.
    deforms
        True if that is a deformation.
    """
    # Without its steps the course goes on from row to row.
    at_once = np.diff(time_s, append=np.inf) == 0
    heights = np.where(at_once, np.diff(values, append=0.0), 0.0)
    first = ~np.append(False, at_once[:-1])
    levels = np.cumsum(heights)
    values, time_s = (values - levels + heights)[first], time_s[first]
    heights, levels = heights[first], levels[first]
    left, right = _rates(time_s, values)
    length, chord = np.diff(time_s), np.diff(values) / np.diff(time_s)
    # What the rates at both ends of a piece exceed that of a line by.
    first, last = right[:-1] - chord, left[1:] - chord
    powers = np.stack(
        (
            values[:-1],
            right[:-1],
            -2 * (2 * first + last) / length,
            6 * (first + last) / length**2,
        ),
        axis=1,
    )
    changes = powers.copy()
    powers[:, 0] += levels[:-1]
    changes[1:, 0] = heights[1:-1]
    changes[1:, 1] -= left[1:-1]
    changes[1:, 2] -= powers[:-1, 2] + powers[:-1, 3] * length[:-1]
    changes[1:, 3] -= powers[:-1, 3]
    changing = np.any(changes, axis=1)
    changing[0] = True
    return Course(time_s[:-1][changing], changes[changing], powers[changing], time_s[-1], deforms)


def _rates(time_s: Array, values: Array) -> tuple[Array, Array]:
    """Return the rates before and after each row, which differ where the rate jumps, (n,) each."""
    chords = np.diff(values) / np.diff(time_s)
    before, after = np.append(chords[:1], chords), np.append(chords, chords[-1:])
    if len(values) < _ROWS:
        return before, after
    bends = np.pad(2 * np.diff(chords) / (time_s[2:] - time_s[:-2]), 1 + _ASIDE, mode="edge")
    sizes = np.abs(bends)
    at_end = _STRAIGHT * sizes[_ASIDE:-_ASIDE]
    straight_before = np.maximum(sizes[:-4], sizes[1:-3]) <= at_end
    straight_after = np.maximum(sizes[3:-1], sizes[4:]) <= at_end
    quartic, smooth = _quartics(time_s, values, bends[_ASIDE:-_ASIDE])
    rates = np.where(smooth, quartic, 0.5 * (before + after))
    lines = [(straight_before, before), (straight_after, after)]
    left, right = (
        np.select([one[0], other[0]], [one[1], other[1]], rates)
        for one, other in (lines, lines[::-1])
    )
    if chords[0] == 0:
        # It was not recorded, or has just begun to change.
        left[1], right[1] = 0.0, chords[1]
    return left, right


def _quartics(time_s: Array, values: Array, bends: Array) -> tuple[Array, BoolArray]:
    """Return the rates at rows, (n,), of quartics through five rows, and whether these are smooth.

    Rows are the nearest five; second derivatives at rows are (n,), those of the ends repeated.
    """
    count = len(values)
    rows = np.clip(np.arange(count) - _ASIDE, 0, count - _ROWS)[:, None] + np.arange(_ROWS)
    inner = bends[rows[:, 1:-1]].T
    uneven = np.abs(inner[0] - 2 * inner[1] + inner[2])
    smooth: BoolArray = uneven <= _SMOOTH * np.sum(np.abs(inner), axis=0)
    others = rows[rows != np.arange(count)[:, None]].reshape(count, -1)
    # Derivatives of Lagrange's polynomials at the row itself, whose own is minus their sum.
    away, rates = (time_s[others] - time_s[:, None]).T, np.zeros(count)
    for row, (own, reading) in enumerate(zip(away, values[others].T, strict=True)):
        rest = np.delete(away, row, axis=0)
        rates += np.prod(rest / (rest - own), axis=0) / own * (reading - values)
    return rates, smooth
