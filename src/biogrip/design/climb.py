"""Local search from the best trains of steps that are known: their ends are climbed.

A neighbour of a train (`biogrip.design.neighbours`) replaces it if its best sampling is better.
Several trains are climbed side by side, and the worse half is given up again and again [1]_. The
best are polished (`biogrip.design.polish`).

References
----------
.. [1] K. Jamieson and A. Talwalkar, Non-stochastic best arm identification and hyperparameter
   optimization, Proceedings of Machine Learning Research 51 (2016), 240-248.
"""

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from biogrip.design.experiment import DesignInputs
from biogrip.design.neighbours import (
    Neighbour,
    Train,
    drawn_neighbour,
    random_train,
    train_of,
    without,
)
from biogrip.design.polish import best_of, polish
from biogrip.design.rating import LOST, Rated, Rater, Torque
from biogrip.design.waveform import Limits
from biogrip.worker_processes import worker_processes

# Gap and most fillings of samplings, so that small differences of trains show.
_GAP, _FILLINGS = 0.002, 40
# Least decrease of a logarithm, and how much may be lost where a step can be left out.
_BETTER, _AS_GOOD = 1e-6, 2e-5
# Most trains climbed side by side, fewest neighbours of each in the first round, and of how many
# trains drawn at random one is the best.
_SIDE_BY_SIDE, _FEWEST, _DRAWN = 16, 60, 40
# Trains that are polished.
_POLISHED = 2


@dataclass(frozen=True)
class Climber:
    """A train on its way up."""

    train: Train
    """The best so far."""
    rated: Rated
    """Its rating."""
    rng: np.random.Generator
    """Generator of its neighbours."""


def climb(
    inputs: DesignInputs,
    torques: Sequence[Torque],
    tried: int,
    rng: np.random.Generator,
    progress: Callable[[int, float], None],
    known: Sequence[Torque] = (),
) -> list[Torque]:
    """Climb from trains of steps and from random ones; the best comes first.

    Parameters
    ----------
    inputs
        The design problem.
    torques
        Trains of steps, the best first.
    tried
        Neighbours that are rated in all, about.
    rng
        Generator of random trains and neighbours.
    progress
        Called with the number tried, and the lowest typical relative bound.
    known
        Trains of steps from elsewhere, polished if they are among the best.

    Returns
    -------
    list of Torque
        Polished ones, one for each train that was climbed to the end, and those given.
    """
    rater = Rater(inputs)
    many = int(np.clip(tried // (4 * _FEWEST), 1, _SIDE_BY_SIDE))
    # The better ones of a search are often alike.
    chosen = [index for index in (0, *2 ** np.arange((many - 1) // 2)) if index < len(torques)]
    starts = [train_of(torques[index].waveform, inputs.limits) for index in chosen]
    starts += [_drawn_train(rater, inputs, rng) for _ in range(many - len(starts))]
    rated = [(train, rater.rate(train.waveform(inputs.limits))) for train in starts]
    climbers = [
        Climber(train, rating, own)
        for (train, rating), own in zip(rated, rng.spawn(len(rated)), strict=True)
        if rating.logarithm < LOST
    ]
    if not climbers:
        return [*known, *torques]
    rounds = max(1, (len(climbers) - 1).bit_length())
    count, in_round = 0, tried // (rounds + 1)
    with worker_processes(
        min(len(os.sched_getaffinity(0)), len(climbers)), partial(_hold, rater, inputs)
    ) as processes:
        for _ in range(rounds):
            each = max(1, in_round // len(climbers))
            found = []
            for climber in processes.map(partial(_climb_here, each), climbers):
                found.append(climber)
                count += each
                progress(count, float(np.exp(min(one.rated.logarithm for one in found))))
            found.sort(key=lambda climber: climber.rated.logarithm)
            climbers = found[: max(2, len(found) // 2)]
        shortened = list(processes.map(_shorten_here, climbers))
        shortened.sort(key=lambda climber: climber.rated.logarithm)
        ends = [rater.torque(climber.train.waveform(inputs.limits)) for climber in shortened]
        polished: list[Torque] = []
        # With memory in the noise trains are rated roughly.
        if not inputs.noise.has_memory:
            best = best_of(inputs, [*known, *ends], _POLISHED)
            each = max(1, in_round // _POLISHED)
            polished = list(processes.map(partial(_polish_here, each), best, rng.spawn(len(best))))
    return best_of(inputs, polished, _POLISHED) + ends + list(torques)


_given: list[tuple[Rater, DesignInputs]] = []


def _hold(rater: Rater, inputs: DesignInputs) -> None:
    """Keep in a process what it climbs with, which cannot be sent to it."""
    _given.append((rater, inputs))


def _climb_here(tried: int, climber: Climber) -> Climber:
    return climb_one(*_given[-1], climber, tried)


def _shorten_here(climber: Climber) -> Climber:
    return _shortened(*_given[-1], climber)


def _polish_here(tried: int, torque: Torque, rng: np.random.Generator) -> Torque:
    _, inputs = _given[-1]
    return polish(inputs, torque, tried, rng)


def _drawn_train(rater: Rater, inputs: DesignInputs, rng: np.random.Generator) -> Train:
    """Return the best of some random trains."""
    trains = [random_train(inputs.limits, rng) for _ in range(_DRAWN)]
    return min(trains, key=lambda train: rater.rate(train.waveform(inputs.limits)).logarithm)


def climb_one(rater: Rater, inputs: DesignInputs, climber: Climber, tried: int) -> Climber:
    """Rate some neighbours one after the other, and go on from each that is better."""
    limits = inputs.limits
    train, rng = climber.train, climber.rng
    rated = rater.rate(train.waveform(limits), gap=_GAP, most=_FILLINGS)
    for _ in range(tried):
        other = drawn_neighbour(train, limits, rng)
        if other is None:
            break
        found = _rate_beside(rater, limits, rated, other, rated.logarithm)
        if found.logarithm < rated.logarithm - _BETTER and _is_sure(found):
            train, rated = other.train, found
    return Climber(train, rated, rng)


def _shortened(rater: Rater, inputs: DesignInputs, climber: Climber) -> Climber:
    """Leave out steps that make hardly a difference."""
    train, rated = climber.train, climber.rated
    allowed = rated.logarithm + _AS_GOOD
    for step in range(len(train.units) - 1, -1, -1):
        for longer in (step - 1, step + 1):
            if len(train.units) > 1 and 0 <= longer < len(train.units) and step < len(train.units):
                other = without(train, step, longer)
                found = _rate_beside(rater, inputs.limits, rated, other, allowed)
                if found.logarithm <= allowed and _is_sure(found):
                    train, rated = other.train, found
                    break
    return Climber(train, rated, climber.rng)


def _rate_beside(
    rater: Rater, limits: Limits, rated: Rated, other: Neighbour, allowed: float
) -> Rated:
    """Rate a neighbour, whose sampling is at first that of the train it was made from."""
    if not other.train.levels.any():
        return Rated(LOST)
    return rater.rate(
        other.train.waveform(limits),
        gap=_GAP,
        most=_FILLINGS,
        start=partial(rated.carried, other.origins),
        to_beat=float(np.exp(allowed)),
    )


def _is_sure(rated: Rated) -> bool:
    return rated.best is not None and rated.best.gap <= _GAP
