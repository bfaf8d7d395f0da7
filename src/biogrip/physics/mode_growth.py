"""Response of a branch of unit stiffness to a deformation, and its derivative by its rate.

A spring in series with a damper, stretched by x(t), forgets at its rate r < 0,

    g' = r g + x',

so its force is e^(r t) after a unit step, where an arm that follows a torque turns by e^(r t) - 1.
Written by itself, for of a fast branch the difference of both would leave rounding errors only.

Response of a mode of unit weight to a protocol, and its derivative by the mode's rate.
"""

import numpy as np

from biogrip.arrays import Array, ComplexArray, IntArray
from biogrip.physics.linear import phi_function
from biogrip.physics.protocol import TorqueHistory, drives


def compute_decay(rates: Array, history: TorqueHistory, time_s: Array) -> tuple[Array, Array]:
    """Compute responses of branches of unit stiffness, and derivatives by the rate.

    Parameters
    ----------
    rates : (n, n_modes)
        In 1/s, real, negative or zero.
    history
        The deformation that is held.
    time_s : (n_times,)
        Ascending. A reading at the very instant of a step is taken before it.

    Returns
    -------
    decay, slope : (n, 1, n_modes, n_times)
        In units of the deformation, and those times s.
    """
    rate = rates[:, None, :, None]
    powers, swings = history.within_phases
    shape = len(rates), powers.shape[1], rates.shape[1]
    decay, slope = np.zeros((2, *shape, len(time_s)))
    left, left_slope = np.zeros((2, *shape, 1))
    starts = np.append(history.time_s, history.end_s)
    firsts = np.append(time_s.searchsorted(history.time_s, side="right"), len(time_s))
    level = np.zeros(powers.shape[1])
    for k, start in enumerate(history.time_s):
        here = slice(firsts[k], firsts[k + 1])
        # The end of a phase is the initial state of the next.
        elapsed = np.append(time_s[here], starts[k + 1]) - start
        course, now = _course(powers[k], swings[k], elapsed[-1:]), _course(powers[k], swings[k], 0)
        begun = left + (now - level)[:, None, None]
        remains = np.exp(rate * elapsed)
        grown = begun * remains
        grown_slope = (left_slope + begun * elapsed) * remains
        for order in (1, 2):
            if powers[k, :, order].any():
                height = powers[k, :, order, None, None]
                one, its_slope = _decay(order, rate, elapsed)
                grown, grown_slope = grown + height * one, grown_slope + height * its_slope
        for omega, amplitudes in swings[k]:
            swung, its_slope = _decay_swing(omega, rate, elapsed, amplitudes[:, None, None])
            grown, grown_slope = grown + swung, grown_slope + its_slope
        decay[..., here], slope[..., here] = grown[..., :-1], grown_slope[..., :-1]
        left, left_slope, level = grown[..., -1:], grown_slope[..., -1:], course
    return decay, slope


def _course(powers: Array, swings: list[tuple[float, ComplexArray]], elapsed: Array | int) -> Array:
    """Return the deformation of each drive at one time within a phase, (n_drives,)."""
    value, slope, curvature = powers.T
    polynomial: Array = value + slope * elapsed + curvature * elapsed**2 / 2
    return polynomial + sum((a * np.exp(1j * omega * elapsed)).real for omega, a in swings)


def _decay(order: int, rate: Array, elapsed: Array) -> tuple[Array, Array]:
    """Return the response to t^n/n! with n above 0, t^n phi_n(r t), and its derivative."""
    z, power = rate * elapsed, elapsed**order
    this, after = phi_function(order, z), phi_function(order + 1, z)
    return power * this, power * elapsed * (this - order * after)


def _decay_swing(
    omega: float, rate: Array, elapsed: Array, phasor: ComplexArray
) -> tuple[Array, Array]:
    """Return the response to the change of Re(a e^(i omega t)) since t = 0, and its derivative."""
    remains = np.exp(rate * elapsed)
    difference = np.exp(1j * omega * elapsed) - remains
    share = 1j * omega / (1j * omega - rate)
    slope = share / (1j * omega - rate) * difference - share * elapsed * remains
    return (phasor * share * difference).real, (phasor * slope).real


# exp(-40) is lost in rounding.
_DECAYED = 40.0


def compute_growth(rates: Array, torque: TorqueHistory, time_s: Array) -> tuple[Array, Array]:
    """Compute responses of modes of unit weight to a protocol, and derivatives by the rate.

    A mode is carried on from step to step: with G its response at the last step, T the
    torque since, and e the time since,

        g(e) = G + (G + T) (e^(r e) - 1)    dg/dr = [G' + (G + T) e] e^(r e)

    Ramps and sinusoids are treated alike: a superposition of responses since the start would
    lose digits by cancellation.

    Parameters
    ----------
    rates : (n, n_modes)
        In 1/s, negative. Rates in a column should be similar: times at which all of a column have
        decayed are not computed.
    torque
        The protocol.
    time_s : (n_times,)
        Ascending. Before the protocol nothing responds.

    Returns
    -------
    growth, slope : (n, n_drives, n_modes, n_times)
        In N m, and N m s, for each of the `drives`; of a deformation, those of `compute_decay`.
    """
    if torque.deforms:
        return compute_decay(rates, torque, time_s)
    if before := int(time_s.searchsorted(torque.time_s[0])):
        growth, slope = compute_growth(rates, torque, time_s[before:])
        zeros = np.zeros((*growth.shape[:-1], before))
        return np.concatenate((zeros, growth), axis=-1), np.concatenate((zeros, slope), axis=-1)
    n, m = rates.shape
    if not torque.only_steps:
        return _from_phase_to_phase(rates, torque, time_s)
    levels = np.cumsum(drives(torque.left, torque.right, torque.symmetric)[..., 0], axis=1)
    reached, slanted = _at_steps(rates, torque.time_s, levels)
    firsts = np.append(time_s.searchsorted(torque.time_s), len(time_s))
    phase = np.repeat(np.arange(len(levels[0])), np.diff(firsts))
    elapsed = time_s - torque.time_s[phase]
    growth = np.empty((n, len(levels), m, len(time_s)))
    slope = np.empty_like(growth)
    for j, slowest in enumerate(-np.max(rates, axis=0, initial=-np.inf)):
        live = elapsed < _DECAYED / slowest
        if live.all():
            growth[:, :, j], slope[:, :, j] = _carried_on(
                rates[:, j], reached[..., j], slanted[..., j], levels, phase, elapsed
            )
            continue
        # In the same order as elsewhere, so that the last bits agree.
        decayed = reached[..., j] - (reached[..., j] + levels)
        growth[:, :, j], slope[:, :, j] = decayed.take(phase, axis=2), 0.0
        alive = np.flatnonzero(live)
        growth[:, :, j, alive], slope[:, :, j, alive] = _carried_on(
            rates[:, j], reached[..., j], slanted[..., j], levels, phase[alive], elapsed[alive]
        )
    return growth, slope


def _from_phase_to_phase(rates: Array, torque: TorqueHistory, time_s: Array) -> tuple[Array, Array]:
    """Compute growth and slope, (n, n_drives, n_modes, n_times), phase by phase."""
    rate = rates[:, None, :, None]
    powers, swings = torque.within_phases
    shape = len(rates), powers.shape[1], rates.shape[1]
    growth = np.empty((*shape, len(time_s)))
    slope = np.empty_like(growth)
    reached = np.zeros((*shape, 1))
    slanted = np.zeros_like(reached)
    starts = np.append(torque.time_s, torque.end_s)
    firsts = np.append(time_s.searchsorted(torque.time_s), len(time_s))
    for k, start in enumerate(torque.time_s):
        here = slice(firsts[k], firsts[k + 1])
        # The end of a phase is the initial state of the next.
        elapsed = np.append(time_s[here], starts[k + 1]) - start
        decay = 1 + np.expm1(rate * elapsed)
        grown, grown_slope = reached * decay, (slanted + reached * elapsed) * decay
        for order, heights in enumerate(powers[k].T[..., None, None]):
            if heights.any():
                one, its_slope = _growth(order, rate, elapsed)
                grown, grown_slope = (
                    grown + heights * one,
                    grown_slope + heights * its_slope,
                )
        for omega, amplitudes in swings[k]:
            swung = _swing(omega, rate, elapsed, amplitudes[:, None, None])
            grown, grown_slope = grown + swung[0], grown_slope + swung[1]
        growth[..., here], slope[..., here] = grown[..., :-1], grown_slope[..., :-1]
        reached, slanted = grown[..., -1:], grown_slope[..., -1:]
    return growth, slope


def _carried_on(
    rates: Array,
    reached: Array,
    slanted: Array,
    levels: Array,
    phase: IntArray,
    elapsed: Array,
) -> tuple[Array, Array]:
    """Return a mode of each sample, (n, n_drives, n_times), from its responses at the steps."""
    growing = np.expm1(rates[:, None] * elapsed)[:, None]
    growth = (reached + levels).take(phase, axis=2)
    slope = growth * elapsed
    growth *= growing
    growth += reached.take(phase, axis=2)
    slope += slanted.take(phase, axis=2)
    slope *= 1 + growing
    return growth, slope


def _at_steps(rates: Array, starts_s: Array, levels: Array) -> tuple[Array, Array]:
    """Return responses of modes at each step, and derivatives, (n, n_drives, n_steps, m)."""
    gaps = np.diff(starts_s)
    growing = np.expm1(rates * gaps[:, None, None])
    reached = np.zeros((len(gaps) + 1, len(rates), len(levels), rates.shape[1]))
    slanted = np.zeros_like(reached)
    for k, gap in enumerate(gaps):
        grown = growing[k][:, None]
        amplitude = reached[k] + levels[:, k, None]
        reached[k + 1] = reached[k] + amplitude * grown
        slanted[k + 1] = (slanted[k] + amplitude * gap) * (1 + grown)
    return np.moveaxis(reached, 0, 2), np.moveaxis(slanted, 0, 2)


def _growth(order: int, rate: Array, elapsed: Array) -> tuple[Array, Array]:
    """Return a mode's response to t^order/order! over its weight, and derivative by the rate.

    With z = r t these are r t^(n+1) phi_(n+1)(z) and t^(n+1) [phi_n(z) - n phi_(n+1)(z)],
    for z phi_n'(z) = phi_(n-1)(z) - n phi_n(z).
    """
    z = rate * elapsed
    if order == 0:
        growth = np.expm1(z)
        return growth, elapsed * (growth + 1)
    power = elapsed ** (order + 1)
    this, before = phi_function(order + 1, z), phi_function(order, z)
    return rate * power * this, power * (before - order * this)


def _swing(omega: float, rate: Array, elapsed: Array, phasor: ComplexArray) -> tuple[Array, Array]:
    """Return a mode's response to Re(a e^(i omega t)) over its weight, and derivative by the rate.

    These are the real parts of those to a e^(i omega t).
    """
    decay = np.exp(rate * elapsed)
    difference = np.exp(1j * omega * elapsed) - decay
    share = rate / (1j * omega - rate)
    slope = 1j * omega / (1j * omega - rate) ** 2
    growth, by_rate = share * difference, slope * difference - share * elapsed * decay
    return (phasor * growth).real, (phasor * by_rate).real
