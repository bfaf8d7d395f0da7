"""Response of one mode of unit weight to a protocol, and its derivative by the mode's rate.

After a torque's unit step an arm turns by modes e^(r t) - 1, with rates r < 0. So a mode that
follows a torque T(t), and a branch, spring and damper in series, stretched by x(t), obey

    g' = r g + r T        g' = r g + x'

Both are carried on from phase to phase: a superposition of responses since the start would lose
digits by cancellation. The second is no difference of the first and x: of a fast branch it would
leave rounding errors only. Within a phase a torque t^n/n! gives, with z = r t,

    g = r t^(n+1) phi_(n+1)(z)        dg/dr = t^(n+1) [phi_n(z) - n phi_(n+1)(z)]

for z phi_n'(z) = phi_(n-1)(z) - n phi_n(z), and a deformation t^n/n! gives g = t^n phi_n(z).
"""

import numpy as np

from biogrip.arrays import Array, ComplexArray
from biogrip.physics.linear import phi_function
from biogrip.physics.protocol import TorqueHistory


def mode_responses(rates: Array, history: TorqueHistory, time_s: Array) -> tuple[Array, Array]:
    """Compute responses of modes of unit weight, or of branches of unit stiffness, and dg/dr.

    Parameters
    ----------
    rates : (n, n_modes)
        In 1/s, real, negative or zero.
    history
        The torque; if it deforms, the deformation.
    time_s : (n_times,)
        Ascending; at the very instant of a step, what precedes it. Before the protocol nothing
        responds.

    Returns
    -------
    responses, slopes : (n, n_drives, n_modes, n_times)
        In units of what is controlled, for each of the `drives`, and those times s.
    """
    rate = rates[:, None, :, None]
    powers, swings = history.within_phases
    shape = len(rates), powers.shape[1], rates.shape[1]
    responses, slopes = np.zeros((2, *shape, len(time_s)))
    reached, its_slope = np.zeros((2, *shape, 1))
    ends = np.append(history.time_s[1:], history.end_s)
    firsts = np.append(time_s.searchsorted(history.time_s, side="right"), len(time_s))
    level = np.zeros(powers.shape[1])
    # The step of a deformation is the start of a phase.
    orders = (1, 2) if history.deforms else (0, 1, 2)
    to_power, to_swing = (_stretched, _swayed) if history.deforms else (_turned, _swung)
    for k, start in enumerate(history.time_s):
        here = slice(firsts[k], firsts[k + 1])
        # The end of a phase is the initial state of the next.
        elapsed = np.append(time_s[here], ends[k]) - start
        if history.deforms:
            reached = reached + (_course(powers[k], swings[k], 0.0) - level)[:, None, None]
            level = _course(powers[k], swings[k], float(elapsed[-1]))
        remains = np.exp(rate * elapsed)
        response, slope = reached * remains, (its_slope + reached * elapsed) * remains
        for order in orders:
            height = powers[k, :, order, None, None]
            if height.any():
                one, one_slope = to_power(order, rate, elapsed)
                response, slope = response + height * one, slope + height * one_slope
        for omega, amplitudes in swings[k]:
            one, one_slope = to_swing(omega, rate, elapsed, amplitudes[:, None, None])
            response, slope = response + one, slope + one_slope
        responses[..., here], slopes[..., here] = response[..., :-1], slope[..., :-1]
        reached, its_slope = response[..., -1:], slope[..., -1:]
    return responses, slopes


def _course(powers: Array, swings: list[tuple[float, ComplexArray]], elapsed: float) -> Array:
    """Return what is controlled of each drive at one time within a phase, (n_drives,)."""
    value, slope, curvature = powers.T
    polynomial: Array = value + slope * elapsed + curvature * elapsed**2 / 2
    return polynomial + sum((a * np.exp(1j * omega * elapsed)).real for omega, a in swings)


def _turned(order: int, rate: Array, elapsed: Array) -> tuple[Array, Array]:
    """Return the response to a torque t^n/n!, and its derivative."""
    z = rate * elapsed
    if order == 0:
        growth = np.expm1(z)
        return growth, elapsed * (growth + 1)
    power = elapsed ** (order + 1)
    this, before = phi_function(order + 1, z), phi_function(order, z)
    return rate * power * this, power * (before - order * this)


def _swung(omega: float, rate: Array, elapsed: Array, phasor: ComplexArray) -> tuple[Array, Array]:
    """Return the response to a torque Re(a e^(i omega t)), and its derivative."""
    remains = np.exp(rate * elapsed)
    difference = np.exp(1j * omega * elapsed) - remains
    share = rate / (1j * omega - rate)
    slope = 1j * omega / (1j * omega - rate) ** 2 * difference - share * elapsed * remains
    return (phasor * share * difference).real, (phasor * slope).real


def _stretched(order: int, rate: Array, elapsed: Array) -> tuple[Array, Array]:
    """Return the response to a deformation t^n/n!, n above 0, and its derivative."""
    z, power = rate * elapsed, elapsed**order
    this, after = phi_function(order, z), phi_function(order + 1, z)
    return power * this, power * elapsed * (this - order * after)


def _swayed(omega: float, rate: Array, elapsed: Array, phasor: ComplexArray) -> tuple[Array, Array]:
    """Return the response to the change of Re(a e^(i omega t)) since t = 0, and its derivative."""
    remains = np.exp(rate * elapsed)
    difference = np.exp(1j * omega * elapsed) - remains
    share = 1j * omega / (1j * omega - rate)
    slope = share / (1j * omega - rate) * difference - share * elapsed * remains
    return (phasor * share * difference).real, (phasor * slope).real
