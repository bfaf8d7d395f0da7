"""What a trace could hide: errors that no test would tell, and by how much they move its results.

Errors of several kinds are planted in the trace's own best fit, to first order: readings that jump
at some time, or are scaled from then on; a load that starts late; a second branch of the sample. A
fit absorbs a part of each, which moves the parameters, and leaves a part, by which tests tell it.
The size is that which the most sensitive test just misses, a scan for steps, parts fitted apart, or
means over stretches: half of such errors are told. No error is larger than its kind may well be,
nor than what moves a quantity twofold, up to where first order may hold.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtri

import biogrip.levels as levels
from biogrip.arrays import Array
from biogrip.digits import plain
from biogrip.fit.noise_model_fit import absorbed
from biogrip.judging.doubts import MANY, middle_of
from biogrip.judging.likelihood import Likelihood
from biogrip.judging.verdicts import DETERMINED, Finding
from biogrip.judging.whiteness import averaged, parts_apart, steps_of
from biogrip.physics.noise import without
from biogrip.physics.simulation import simulated_response

# Times of a jump and of a changed gain, in shares of the readings.
_SHARES = np.linspace(0.1, 0.9, 9)
# Onsets and strengths of finite differences, as shares of the first interval and of the branch; and
# relaxation times of a second branch over that of the first.
_LATE, _WEAK, _TIMES = 1e-3, 1e-3, (0.1, 10.0)


@dataclass(frozen=True)
class Hidden:
    """An error that a trace could hide, of the size that its tests just miss."""

    error: str
    """In words, with its size and time."""
    moves: dict[str, float]
    """By how much the logarithm of each quantity moves, by its label, with the error's sign."""
    beyond: tuple[str, float]
    """Label of the quantity that moves most, over how far its limit is, and that ratio."""

    def words(self) -> str:
        """Return what it does as a sentence."""
        label, _ = self.beyond
        return (
            f"{self.error[0].upper()}{self.error[1:]}, which this trace could hide, moves {label} "
            f"by {plain(100 * np.expm1(abs(self.moves[label])), 2)} %, beyond its limits."
        )


def find_hidden(likelihood: Likelihood, findings: Sequence[Finding]) -> list[Hidden]:
    """Return the worst error of each kind that moves a quantity with two limits, none of `MANY`."""
    residuals, best = likelihood.problem.residuals, likelihood.best
    limited = [each for each in findings if each.verdict == DETERMINED]
    if residuals.samples > MANY or not limited:
        return []
    _, slopes = residuals(best)
    nuisance = residuals.trace.condensed.nuisance
    basis = absorbed(np.vstack((slopes, nuisance)))
    steps = steps_of(basis, residuals.trace.condensed.cleared)
    # Of a sum of squares with as many degrees of freedom the mean is that of noise.
    others = [
        rows / np.sqrt(chdtri(len(rows), levels.FALSE_ALARM) - len(rows))
        for rows in (parts_apart(basis, middle_of(residuals)), averaged(basis))
        if len(rows)
    ]
    critical = steps.critical(levels.FALSE_ALARM)
    # How far the nearer limit of each is.
    room = dict[str, float]()
    for each in limited:
        profile = each.profile
        nearer = min(abs((end or 0.0) - profile.best) for end in (profile.low, profile.high))
        room[each.quantity.label] = max(nearer, 1e-12)
    information = slopes @ slopes.T / likelihood.noise_sd**2 + np.eye(len(slopes))
    worst: dict[str, Hidden] = {}
    for kind, words, unit, most_size, shape in _planted(likelihood):
        changed = residuals.trace.condensed.cleared(shape)
        left = without(basis, changed) / likelihood.noise_sd
        of_step = float(np.max(np.abs(steps.along(left)), initial=0.0)) / critical
        told = max([of_step, *(float(np.linalg.norm(rows @ left)) for rows in others)])
        moved = np.linalg.solve(information, slopes @ changed) / likelihood.noise_sd**2
        of_one = [float(each.quantity.gradient(best) @ moved) for each in limited]
        twofold = max(map(abs, of_one)) / np.log(2)
        size = 1 / max(told, 1 / most_size, twofold)
        moves = {label: size * by for label, by in zip(room, of_one, strict=True)}
        most = max(room, key=lambda label: abs(moves[label]) / room[label])
        beyond = most, abs(moves[most]) / room[most]
        found = Hidden(words.format(plain(size * unit, 2)), moves, beyond)
        if kind not in worst or beyond[1] > worst[kind].beyond[1]:
            worst[kind] = found
    return sorted(worst.values(), key=lambda each: -each.beyond[1])


def _planted(likelihood: Likelihood) -> Iterator[tuple[str, str, float, float, Array]]:
    """Yield kind, words, factor of the size in words, most, and shape of each error of size one."""
    residuals, best = likelihood.problem.residuals, likelihood.best
    time_s, response, peak = residuals.trace.time_s, residuals.response(best), residuals.peak
    count = len(time_s)
    for before in np.unique((_SHARES * count).astype(np.int64)).tolist():
        after, at = (np.arange(count) >= before).astype(float), plain(time_s[before], 2)
        yield "jump", f"a jump of {{}} % of the peak at {at} s", 100, levels.JUMP, peak * after
        yield "gain", f"a gain that changes by {{}} % at {at} s", 100, levels.GAIN, after * response
    late_s = _LATE * float(np.min(np.diff(time_s)))
    later = residuals.later(late_s).response(best)
    apart_s = float(time_s[1] - time_s[0])
    yield "start", "a start that is late by {} s", 1, apart_s, (later - response) / late_s
    for tau, shape in _second_branch(likelihood):
        words = f"a second branch of {plain(tau, 2)} s with {{}} % of its stiffness"
        yield "branch", words, 100, levels.BRANCH, shape


def _second_branch(likelihood: Likelihood) -> Iterator[tuple[float, Array]]:
    """Yield relaxation times of a second branch, and its effect for the stiffness of the first."""
    residuals = likelihood.problem.residuals
    network = residuals.model.network(np.exp(likelihood.best))
    if residuals.model.power_law or not network.k.size:
        return

    def response(stiffness: float, damping: float) -> Array:
        k = np.append(network.k, [[stiffness]], axis=1)
        more = replace(network, k=k, c=np.append(network.c, [[damping]], axis=1))
        given = residuals.gripper, more, residuals.course, residuals.trace.time_s
        return simulated_response(*given)[0]

    k, c = float(network.k[0, 0]), float(network.c[0, 0])
    for tau in (times * c / k for times in _TIMES):
        weaker, weak = 1e-9 * k, _WEAK * k
        change = response(weak, weak * tau) - response(weaker, weaker * tau)
        yield tau, change / _WEAK
