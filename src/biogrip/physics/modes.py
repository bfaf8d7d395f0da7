"""Responses of modes and branches to a protocol, with derivatives by their rates.

After a load's unit step the response is one of modes e^(r t) - 1, with rates r whose real part is
negative. So a mode that follows a load T(t), and a branch, spring and damper in series, stretched
by x(t), obey

    g' = r g + r T        g' = r g + x'

Both are carried on from phase to phase: a superposition of responses since the start would lose
digits by cancellation, and so would the second as a difference of the first and x, of a fast
branch. Within a phase a load t^n/n! gives, with z = r t,

    g = r t^(n+1) phi_(n+1)(z)        dg/dr = t^(n+1) [phi_n(z) - n phi_(n+1)(z)]

for z phi_n'(z) = phi_(n-1)(z) - n phi_n(z), and a deformation t^n/n! gives g = t^n phi_n(z). If x
is T, that is g_T + T, and r times it is the rate of g_T.

References
----------
.. [1] J. D. Ferry, Viscoelastic Properties of Polymers, Wiley, 1980, chapter 3.
"""

from collections.abc import Iterator, Sequence
from math import factorial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from biogrip.arrays import Array, IntArray, parts
from biogrip.physics.protocol import Course

# Numbers formed together, which should fit a processor's cache.
_MODE_NUMBERS_AT_ONCE = 400_000
# Phases, and steps of a recursion, that are taken one by one.
_MOST_ONE_BY_ONE = 50


def sum_of_responses(
    rates: NDArray[Any], mixing: NDArray[Any], course: Course, time_s: Array
) -> Array:
    """Return sums of responses of the modes of n samples, (n, n_sums, n_times).

    Rates are (n, n_modes). What responses are multiplied by is (n, n_sums, n_modes), or twice as
    many for them and then their derivatives by the rates. See `mode_responses`.
    """
    n, sums, terms = mixing.shape
    rows, slopes = np.zeros((n, sums, len(time_s))), terms > rates.shape[1]
    for some in parts(n, max(1, _MODE_NUMBERS_AT_ONCE // max(1, rates.shape[1] * len(time_s)))):
        for here, both in responses_in_turn(rates[some], course, time_s, slopes=slopes):
            # One product per sample: the order of its sums does not depend on their number.
            rows[some, :, here] = (mixing[some] @ np.concatenate(both, axis=1)).real
    return rows


def lag_course(course: Course, shares: Sequence[float], time_s: Array) -> Array:
    """Return loads that lag behind, (n_lags, n_times), at ascending times.

    Of a deformation, they are the forces of springs that forget it with these relaxation times,
    given as shares of the protocol's duration.
    """
    rates, sign = -1 / (course.end_s * np.array(shares)), 1.0 if course.deforms else -1.0
    return sign * mode_responses(rates[None], course, time_s)[0]


def mode_responses(rates: NDArray[Any], course: Course, time_s: Array) -> NDArray[Any]:
    """Compute responses of modes of unit weight, or of branches of unit stiffness.

    Rates in 1/s, (n, n_modes), have no positive real part. Times, (n_times,), ascend; at the very
    instant of a step is what precedes it, and before the protocol nothing responds. Responses are
    (n, n_modes, n_times), in units of what is controlled.
    """
    responses = np.zeros((*rates.shape, len(time_s)), rates.dtype)
    for here, (at_times,) in responses_in_turn(rates, course, time_s, slopes=False):
        responses[..., here] = at_times
    return responses


def responses_in_turn(
    rates: NDArray[Any], course: Course, time_s: Array, *, slopes: bool = True
) -> Iterator[tuple[slice, NDArray[Any]]]:
    """Yield parts of the times after the start, and responses there stacked on dg/dr.

    Responses are those of `mode_responses`; without `slopes` there are no derivatives.
    """
    if course.sweeps:
        yield slice(None), moduli_of_modes(rates, time_s)[: 1 + slopes]
        return
    at_once = max(1, _MODE_NUMBERS_AT_ONCE // max(rates.size, 1))
    lengths = np.diff(course.time_s, append=course.end_s)
    # What precedes a step is read at its instant.
    firsts = np.append(time_s.searchsorted(course.time_s, side="right"), len(time_s))
    # The step of a deformation is the start of a phase.
    steps = np.append(course.changes[:, 0] * course.deforms, 0.0)
    state = np.zeros((1 + slopes, *rates.shape), rates.dtype)
    state[0] += steps[0]
    for phases in parts(len(lengths), at_once):
        powers, lasts = course.within_phases[phases], lengths[phases]
        go_on = _Motion(rates[:, :, None], powers, deforms=course.deforms, slopes=slopes)
        after = steps[phases.start + 1 :][: len(lasts)]
        states = go_on.carried(state, lasts, after)
        state = states[..., -1]
        first, counts = firsts[phases.start], np.diff(firsts[phases.start :])[: len(lasts)]
        phase = np.repeat(np.arange(len(lasts)), counts)
        for some in parts(len(phase), at_once):
            here = slice(first + some.start, first + min(some.stop, len(phase)))
            in_phase = phase[some]
            elapsed = time_s[here] - course.time_s[phases][in_phase]
            if np.array_equal(elapsed, lasts[in_phase]):
                # Rows of a record are read at the ends of its phases.
                at_ends = states[..., in_phase + 1]
                at_ends[0] -= after[in_phase]
                yield here, at_ends
            else:
                yield here, go_on.after(states, in_phase, elapsed)


def moduli_of_modes(rates: Array, places: Array) -> Array:
    """Compute moduli of branches of unit stiffness, and dg/dr, (2, n, n_modes, n_places) [1]_.

    A branch that forgets at the rate -r has the complex modulus i w / (i w + r). Its storage part,
    w^2 / (w^2 + r^2), stands at the place w, in rad/s, its loss part, w r / (w^2 + r^2), at -w.
    """
    omega, stores, forgets = np.abs(places), places > 0, -rates[..., None]
    size = omega**2 + forgets**2
    moduli = np.where(stores, omega**2, omega * forgets) / size
    of_loss = omega * (forgets**2 - omega**2)
    return np.stack((moduli, np.where(stores, 2 * forgets * omega**2, of_loss) / size**2))


class _Motion:
    """How modes, (n, n_modes, 1), go on in phases whose orders are (n_phases, n_orders)."""

    def __init__(self, rates: Array, powers: Array, *, deforms: bool, slopes: bool) -> None:
        self._rates, self._powers = rates, powers
        self._deforms, self._slopes = deforms, slopes

    def carried(self, state: Array, lengths_s: Array, steps: Array) -> Array:
        """Return modes at the starts of phases, stretched by steps after each, and at their end."""
        remains, gained = self._terms(np.arange(len(lengths_s)), lengths_s)
        reached = _recursion(state[0], remains, gained[0] + steps)
        if not self._slopes:
            return reached[None]
        moved = reached[..., :-1] * lengths_s * remains + gained[1]
        return np.stack((reached, _recursion(state[1], remains, moved)))

    def after(self, states: Array, phase: IntArray, elapsed_s: Array) -> Array:
        """Return modes at times since the starts of phases, (..., n_times)."""
        remains, moved = self._terms(phase, elapsed_s)
        reached = states[..., phase]
        moved[0] += reached[0] * remains
        if self._slopes:
            moved[1] += (reached[1] + reached[0] * elapsed_s) * remains
        return moved

    def _terms(self, phase: IntArray, elapsed_s: Array) -> tuple[Array, Array]:
        """Return what remains of modes after times in phases, and what they gain in these."""
        at: Array = elapsed_s
        same: IntArray | slice = slice(None)
        if len(self._powers) > _MOST_ONE_BY_ONE:
            # Rows at equal intervals are few different times apart.
            at, same = np.unique(elapsed_s, return_inverse=True)
        orders = np.flatnonzero(np.any(self._powers, axis=0))
        orders = orders[orders >= self._deforms].tolist()
        terms = respond(orders, self._rates, at, deforms=self._deforms, slopes=self._slopes)
        remains = np.exp(self._rates * at)[..., same]
        gained = np.zeros((1 + self._slopes, *remains.shape), remains.dtype)
        for order, term in zip(orders, terms, strict=True):
            gained += self._powers[phase, order] * term[..., same]
        return remains, gained


def _recursion(first: Array, factors: Array, terms: Array) -> Array:
    """Return x_0 ... x_n, x_(k+1) = factors_k x_k + terms_k; many steps are taken in blocks."""
    count = terms.shape[-1]
    block = int(np.sqrt(count)) if count > _MOST_ONE_BY_ONE else 1
    blocks = -(-count // block)
    padding = [(0, 0)] * (terms.ndim - 1) + [(0, blocks * block - count)]
    scale, within = (
        np.moveaxis(np.pad(of, padding).reshape(*of.shape[:-1], blocks, block), (-1, -2), (0, 1))
        for of in (factors, terms)
    )
    scale, within = np.ascontiguousarray(scale), np.ascontiguousarray(within)
    for k in range(1, block):
        within[k] += scale[k] * within[k - 1]
        scale[k] *= scale[k - 1]
    starts = np.empty((blocks + 1, *first.shape), first.dtype)
    starts[0] = first
    for k in range(blocks):
        starts[k + 1] = scale[-1, k] * starts[k] + within[-1, k]
    within += scale * starts[:-1]
    reached = np.moveaxis(within, (0, 1), (-1, -2)).reshape(*first.shape, blocks * block)
    return np.concatenate((first[..., None], reached[..., :count]), axis=-1)


def respond(
    orders: Sequence[int], rate: Array, elapsed_s: Array, *, deforms: bool, slopes: bool = False
) -> list[Array]:
    """Return responses of modes to t^n/n! after times, and derivatives by the rate, for each n.

    A load is controlled or, if that `deforms`, a deformation. Rates and times are broadcast; the
    derivatives are stacked below, if there are `slopes`.
    """
    z, most = rate * elapsed_s, max(orders, default=0)
    phis = phi_functions(most + 1, z) if most else []
    responses = []
    for order in orders:
        power = elapsed_s**order
        if order == 0:
            decay = np.exp(z) if deforms else np.expm1(z)
            both = decay, elapsed_s * (decay if deforms else decay + 1)
        elif deforms:
            both = power * phis[order], power * elapsed_s * (phis[order] - order * phis[order + 1])
        else:
            power = power * elapsed_s
            slope = power * (phis[order] - order * phis[order + 1])
            both = rate * power * phis[order + 1], slope
        responses.append(np.stack(both[: 1 + slopes]))
    return responses


def phi_functions(most: int, z: NDArray[Any]) -> list[NDArray[Any]]:
    """Compute phi_n(z) = (e^z - sum_{k<n} z^k/k!) / z^n for n = 0 ... most, at least 1.

    Near zero, where that would cancel, the last is a series, and the others follow from it (M.
    Hochbruck and A. Ostermann, Acta Numerica 19 (2010), 209-286).
    """
    small = np.abs(z) < 1.0
    near, far = np.where(small, z, 0), np.where(small, 1, z)
    series = np.zeros_like(near)
    for k in range(18, -1, -1):
        series = series * near + 1 / factorial(k + most)
    value = np.expm1(far) / far
    phis = [np.exp(z), value]
    for n in range(1, most):
        value = (value - 1 / factorial(n)) / far
        phis.append(value)
    for n in range(most, 0, -1):
        phis[n] = np.where(small, series, phis[n])
        series = series * near + 1 / factorial(n - 1)
    return phis
