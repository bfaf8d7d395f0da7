"""The end of a local search: trains of steps that can be set, at the very limits.

During the climb (`biogrip.design.climb`) a margin is kept to the force at which contact is lost,
and torques have any number of digits. Here neighbours are rounded to what can be set, and contact
is checked as for a plan.
"""

from collections.abc import Sequence
from functools import partial

import numpy as np

from biogrip.arrays import IntArray
from biogrip.design.experiment import DesignInputs
from biogrip.design.neighbours import Train, drawn_neighbour, train_of
from biogrip.design.rating import LOST, Rated, Rater, Torque
from biogrip.design.schedule import presses
from biogrip.design.set_values import set_values
from biogrip.design.waveform import Waveform, hold, tidied
from biogrip.experiment.protocol import Phase

# Gap and most fillings of samplings; least decrease of a logarithm.
_GAP, _FILLINGS, _BETTER = 2e-4, 100, 1e-6
# Fillings after which a neighbour is given up whose logarithm is larger by more; and fillings of
# those that are left.
_FEW, _NEAR, _MORE = 8, 3e-4, 30


def best_of(inputs: DesignInputs, torques: Sequence[Torque], most: int) -> list[Torque]:
    """Return the best trains that can be set and with which the jaws press, the best first."""
    rater = Rater(inputs, margin=0.0)
    rated = [
        (_rate(rater, train.waveform(inputs.limits)).logarithm, torque)
        for torque in torques
        for train, phases in [_rounded(inputs, torque)]
        if presses(inputs, phases)
    ]
    rated.sort(key=lambda each: each[0])
    return [torque for logarithm, torque in rated[:most] if logarithm < LOST]


def polish(inputs: DesignInputs, torque: Torque, tried: int, rng: np.random.Generator) -> Torque:
    """Rate neighbours of a train of steps one after the other, and go on from each better one.

    Parameters
    ----------
    inputs
        The design problem.
    torque
        Train of steps, with which the jaws press.
    tried
        Number of neighbours.
    rng
        Random generator.
    """
    limits = inputs.limits
    rater = Rater(inputs, margin=0.0)
    train, _ = _rounded(inputs, torque)
    rated = _rate(rater, train.waveform(limits))
    for _ in range(tried):
        other = drawn_neighbour(train, limits, rng)
        if other is None:
            break
        waveform = other.train.waveform(limits)
        beside = partial(_rate_beside, rater, rated, other.origins)
        if not _is_better(beside(waveform), rated):
            continue
        rounded, phases = _rounded(inputs, rater.torque(waveform))
        found = beside(rounded.waveform(limits))
        if _is_better(found, rated) and presses(inputs, phases):
            train, rated = rounded, found
    return rater.torque(tidied(train.waveform(limits)))


def _rounded(inputs: DesignInputs, torque: Torque) -> tuple[Train, tuple[Phase, ...]]:
    """Return a train rounded to what can be set, and its phases."""
    phases = set_values(inputs, torque)
    steps = np.array([(phase.duration_s, phase.left.value_Nm) for phase in phases])
    return train_of(hold(*steps.T), inputs.limits), phases


def _rate(rater: Rater, waveform: Waveform) -> Rated:
    return rater.rate(waveform, gap=_GAP, most=_FILLINGS)


def _rate_beside(rater: Rater, rated: Rated, origins: IntArray, waveform: Waveform) -> Rated:
    """Rate a train, from the sampling of one it was made from; roughly if it is hardly better."""
    rate = partial(rater.rate, waveform, gap=_GAP, to_beat=float(np.exp(rated.logarithm)))
    found = rate(most=_FEW, start=partial(rated.carried, origins))
    if found.best is None or found.best.gap <= _GAP or found.logarithm > rated.logarithm + _NEAR:
        return found
    mixture = found.best.mixture
    return rate(most=_MORE, start=lambda _: mixture)


def _is_better(found: Rated, rated: Rated) -> bool:
    return found.logarithm < rated.logarithm - _BETTER
