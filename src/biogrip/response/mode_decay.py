"""Response of a branch of unit stiffness to a deformation, and its derivative by its rate.

A spring in series with a damper, stretched by x(t), forgets at its rate r < 0,

    g' = r g + x',

so its force is e^(r t) after a unit step, where an arm that follows a torque turns by e^(r t) - 1.
Written by itself, for of a fast branch the difference of both would leave rounding errors only.
"""

import numpy as np

from biogrip.arrays import Array, ComplexArray
from biogrip.experiment.protocol import TorqueHistory
from biogrip.response.linear import phi_function


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
            swung, its_slope = _swing(omega, rate, elapsed, amplitudes[:, None, None])
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


def _swing(omega: float, rate: Array, elapsed: Array, phasor: ComplexArray) -> tuple[Array, Array]:
    """Return the response to the change of Re(a e^(i omega t)) since t = 0, and its derivative."""
    remains = np.exp(rate * elapsed)
    difference = np.exp(1j * omega * elapsed) - remains
    share = 1j * omega / (1j * omega - rate)
    slope = share / (1j * omega - rate) * difference - share * elapsed * remains
    return (phasor * share * difference).real, (phasor * slope).real
