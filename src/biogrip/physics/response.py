"""The corrected linear model, eqs. (4)-(6), solved exactly for any protocol.

With Z_i(s) = I_i s^2 + c_i s + k_i the impedance of an arm, G(s) that of the sample, b = l
sin(hat-theta_2) the lever and tau the torque of both arms, the closing rotations are

    phi_2 = Z_4 tau / E    phi_4 = Z_2 tau / E    E = Z_2 Z_4 + b^2 G (Z_2 + Z_4)

and of equal arms, after Z cancels, phi = tau / (Z + 2 b^2 G). The jaws exert the force F = b G (Z_2
+ Z_4) tau / E on the sample, positive while they press. The arm's equation gives it too, b F = tau
- Z phi, but where a liquid has given way that is a difference of nearly equal torques; here the
constant and every mode are products of what is positive.

Without inertia the arms, seen from the sample, have the impedance Z = Z_2 Z_4 / (Z_2 + Z_4), which
is that of a spring, a damper and one Maxwell branch. So with the sample's

    H = Z + b^2 G = A + B s + sum_j K_j s / (s + r_j)

is a sum of poles, and the rates x of the modes interlace with the r_j (`biogrip.physics.roots`).
Where H is zero, b^2 G is -Z, so the numerators N of phi_2 = Z_4/(Z_2 + Z_4) tau / H, of phi_4 and
of F follow from the arms alone. A mode of N/H has the weight -N/S with S = A + sum_j K_j x^2/(x -
r_j)^2, a sum of positive terms. Equal arms need no branch of theirs: then 2 phi = tau/H.

With inertia, arms ring. E, or Z + 2 b^2 G, times the product of all s + r_j is a polynomial. The
iteration that finds its roots needs only its quotient with its derivative, a sum over the branches.
A root so near a branch's rate that digits of their distance are lost has a weight as small. Starts
are the rates without inertia, and the ringing of arms on a sample whose Maxwell dampers are rigid.

References
----------
.. [1] W. Squire and G. Trapp, SIAM Review 40 (1998), 110-112: derivatives by complex variables.
.. [2] J. R. R. A. Martins et al., ACM Transactions on Mathematical Software 29 (2003), 245-262.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from biogrip.arrays import Array, ComplexArray
from biogrip.physics.gripper import Gripper
from biogrip.physics.modes import sum_of_responses
from biogrip.physics.protocol import Course, evaluate
from biogrip.physics.roots import Zeros, find_zeros, interlaced_zeros, spread_starts
from biogrip.physics.sample_model import Network, SampleModel

LEFT, RIGHT = 0, 1

_COMPLEX_STEP = 1e-30
# Rate at which a bare damper forgets, in 1/s; its force is c times the rate of the deformation.
_RATE_OF_A_DAMPER = 1e30

# Least difference of the arms: the branch of equal arms has no effect, but a mode.
_LEAST_DIFFERENCE = 1e-30


@dataclass(frozen=True)
class StepResponse:
    """Response of n samples to a unit step of the load: exponentials beside a constant.

    A unit torque on both arms at time 0 turns arm a (`LEFT`, `RIGHT`) by
    ``sum_j weights[:, a, j] (exp(rates[:, j] t) - 1)``.
    """

    rates: NDArray[Any]
    """Exponents in 1/s, (n, n_modes), real without inertia, complex with it."""
    weights: NDArray[Any]
    """In rad per N m, (n, n_arms, n_modes)."""


def step_response(
    gripper: Gripper, network: Network, *, inertia: bool = True, force: bool = False
) -> StepResponse:
    """Solve the linear model for n samples at once (corrected eqs. 4-6).

    With `inertia`, arms ring for milliseconds. Without, all rates are real and negative, and a
    parallel damper makes the force jump with the torque. The jaw `force`, in N per N m, takes the
    place of an arm. An infinitesimal imaginary part of elements is carried through.
    """
    arms = Arms(gripper)
    impedance = arms.with_sample(network)
    zeros = impedance.zeros()
    if inertia:
        ringing = Ringing(gripper, network, zeros)
        rates: NDArray[Any] = ringing.rates
        weights: NDArray[Any] = ringing.weights(force=force)
    else:
        rates = -zeros.values.T
        numerators = arms.force(zeros) if force else arms.rotations(zeros)
        weights = -numerators / impedance.steepness(zeros)
    return StepResponse(*map(np.ascontiguousarray, (rates, np.moveaxis(weights, -1, 0))))


def superpose(
    response: StepResponse, course: Course, time_s: Array, arm: int = LEFT, *, rate: bool = False
) -> Array:
    """Compute the response to a protocol, or its rate, (n, n_times), at ascending times.

    Of a gripper, it is the closing rotation of an arm in rad. At the very instant of a step the
    rate is what precedes it.
    """
    rates, weights = response.rates, response.weights[:, [arm]]
    if rate:
        weights, course = rates[:, None] * weights, replace(course, deforms=True)
    return sum_of_responses(rates, weights, course, time_s)[:, 0]


def linear_jaw_force(
    gripper: Gripper, network: Network, course: Course, time_s: Array, *, inertia: bool
) -> Array:
    """Compute the jaw force of samples in N, (n, n_times); at a step, what follows it."""
    response = step_response(gripper, network, inertia=inertia, force=True)
    at_rest = Arms(gripper).force_at_rest(network)[:, None] * evaluate(course, time_s)
    as_deformation, after = replace(course, deforms=True), np.nextafter(time_s, np.inf)
    given = response.rates, response.weights, as_deformation, after
    return at_rest + sum_of_responses(*given)[:, 0]


def simulated_response(gripper: Gripper, network: Network, course: Course, time_s: Array) -> Array:
    """Simulate what is read at ascending times, (n, n_times), with inertia, by corrected (4)-(6).

    Of a gripper that is the closing rotation of the left arm in rad.
    """
    if course.deforms:
        rates, weights = elements_of(network)
        return sum_of_responses(rates, weights[:, None], course, time_s)[:, 0]
    return superpose(step_response(gripper, network, inertia=gripper.has_inertia), course, time_s)


class Modes(NamedTuple):
    """Step responses of n samples, and their derivatives by the log-parameters."""

    rates: Array
    """In 1/s, (n, n_modes), negative."""
    weights: Array
    """(n, n_modes): the reading over what is controlled."""
    rate_slopes: Array
    """(n, n_parameters, n_modes)."""
    weight_slopes: Array
    """(n, n_parameters, n_modes)."""


def compute_modes(
    gripper: Gripper,
    model: SampleModel,
    course: Course,
    parameters: Array,
    *,
    slopes: bool = True,
) -> Modes:
    """Compute the modes of samples, all positive, (n, n_parameters), and their derivatives.

    A parameter with a relative imaginary part of 1e-30 carries its derivative through the
    arithmetic without changing the real part: the complex step [1]_, [2]_.
    """
    count = parameters.shape[1] if slopes else 0
    if slopes:
        # After the samples, copies with each of their parameters tilted into the complex plane.
        factors = np.ones((count + 1, 1, count), dtype=np.complex128)
        factors[1:, 0].imag = _COMPLEX_STEP * np.eye(count)
        parameters = (parameters * factors).reshape(-1, count)
    network = model.network(parameters)
    if course.deforms:
        rates, weights = elements_of(network)
    else:
        response = step_response(gripper, network, inertia=False)
        rates, weights = response.rates, response.weights[:, LEFT]
    both = [of.reshape(count + 1, -1, of.shape[1]) for of in (rates, weights)]
    of_samples = (np.ascontiguousarray(of[0].real) for of in both)
    of_slopes = (of[1:].imag.swapaxes(0, 1) / _COMPLEX_STEP for of in both)
    return Modes(*of_samples, *map(np.ascontiguousarray, of_slopes))


def sum_of_modes(modes: Modes, course: Course, time_s: Array) -> Array:
    """Return what samples show by all their modes, see `linear_responses`."""
    # Sums of responses of modes, w g, and their derivatives, d(w g) = dw g + w dr dg/dr.
    by_response = np.concatenate((modes.weights[:, None], modes.weight_slopes), axis=1)
    by_slope = np.zeros_like(by_response)
    by_slope[:, 1:] = modes.weights[:, None] * modes.rate_slopes
    mixing = np.concatenate((by_response, by_slope), axis=2)
    return sum_of_responses(modes.rates, mixing, course, time_s)


def linear_responses(
    gripper: Gripper, model: SampleModel, course: Course, time_s: Array, parameters: Array
) -> Array:
    """Compute what is read in the linear model, corrected eqs. (4)-(6), and d/d log p of it.

    Times, (n_times,), ascend; parameters, (n, n_parameters), are positive. Returns readings and
    their derivatives, (n, 1 + n_parameters, n_times).
    """
    return sum_of_modes(compute_modes(gripper, model, course, parameters), course, time_s)


def elements_of(network: Network) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return rates and stiffnesses of elements side by side, (n, n_modes); of bare ones last."""
    bare = np.stack((network.k_p, _RATE_OF_A_DAMPER * network.c_p), axis=1)
    fixed = np.broadcast_to([0.0, -_RATE_OF_A_DAMPER], bare.shape)
    # A branch so weak that its numbers underflow is none.
    there = network.c.real > 0
    rates = -network.k / np.where(there, network.c, 1.0)
    weights = np.where(there, network.k, 0.0)
    return np.concatenate((rates, fixed), axis=1), np.concatenate((weights, bare), axis=1)


@dataclass(frozen=True)
class Impedance:
    """Impedance H = Z + b^2 G of n samples between the arms."""

    weights: NDArray[Any]
    """A and the K_j, (1 + n_rates, n); complex if the samples' elements are."""
    rates: NDArray[Any]
    """Zero and the r_j, ascending, (1 + n_rates, n)."""
    level: NDArray[Any]
    """B, (n,)."""

    def zeros(self) -> Zeros:
        """Return the rates of modes without inertia."""
        return interlaced_zeros(self.weights, self.rates, self.level)

    def steepness(self, zeros: Zeros) -> NDArray[Any]:
        """Return S at rates of modes, (n_modes, n)."""
        x = zeros.values
        steepness = np.zeros_like(x)
        for weight, rate in zip(self.weights, self.rates, strict=True):
            steepness += weight * (x / zeros.from_pole(rate)) ** 2
        return steepness


class Arms:
    """Impedance of both arms as seen from the sample between them."""

    def __init__(self, gripper: Gripper) -> None:
        self._lever_m = gripper.lever_m
        self.alike = gripper.left == gripper.right
        arms = gripper.left, gripper.right
        self._c = np.array([arm.damping_Nms_per_rad for arm in arms])
        self._k = np.array([arm.stiffness_Nm_per_rad for arm in arms])
        (c_2, c_4), (k_2, k_4) = self._c, self._k
        self._rate = (k_2 + k_4) / (c_2 + c_4)
        # At a distance d from that rate Z_2 = -chi - c_2 d and Z_4 = chi - c_4 d.
        difference, least = k_4 * c_2 - k_2 * c_4, _LEAST_DIFFERENCE * k_4 * c_2
        self._chi = (difference if abs(difference) > least else least) / (c_2 + c_4)

    def with_sample(self, network: Network) -> Impedance:
        """Return the impedance with a sample between the arms."""
        b_2, c = self._lever_m**2, self._c
        springs, rates = ascending_branches(network)
        weights = b_2 * springs
        nothing = np.zeros((1, weights.shape[1]))
        if not self.alike:
            weights = np.concatenate((weights, nothing + self._chi**2 / self._k.sum()))
            rates = np.concatenate((rates, nothing + self._rate))
            weights, rates = ascending(weights, rates)
        return Impedance(
            np.concatenate((self._spring(network)[None], weights)),
            np.concatenate((nothing, rates)),
            c.prod() / c.sum() + b_2 * network.c_p,
        )

    def rotations(self, zeros: Zeros) -> NDArray[Any]:
        """Return N of the rotations of modes, (n_arms, n_modes, n)."""
        if self.alike:
            return np.full((2, *zeros.pole.shape), 0.5)
        left, right = self._c / self._c.sum()
        share = self._chi / self._c.sum() / zeros.from_pole(np.asarray(self._rate))
        return np.array([right - share, left + share])

    def force(self, zeros: Zeros) -> NDArray[Any]:
        """Return N of the jaw force of modes, (1, n_modes, n)."""
        (c_2, c_4), b = self._c, self._lever_m
        if self.alike:
            return 0.5 / b * (c_2 * zeros.values - self._k[0])[None]
        away = zeros.from_pole(np.asarray(self._rate))
        z_2, z_4 = -self._chi - c_2 * away, self._chi - c_4 * away
        return (z_2 * z_4 / ((c_2 + c_4) * away) / b)[None]

    def force_at_rest(self, network: Network) -> Array:
        """Return the final jaw force under a unit torque, (n,)."""
        return self._lever_m * network.k_p / self._spring(network)

    def _spring(self, network: Network) -> NDArray[Any]:
        """Return A, (n,)."""
        return self._k.prod() / self._k.sum() + self._lever_m**2 * network.k_p


# Factor that moves starts off the real axis, which no iteration from a real start would leave.
_OFF_REAL_AXIS = 1 + 1e-3j
# Relative distance to which equal rates of branches are moved apart; the response changes by as
# much.
_LEAST_GAP_OF_RATES = 1e-10
# Share of a branch's rate within which a root is lost in rounding; its mode has no weight.
_LEAST_GAP_OF_ROOTS = 1e-16


def ascending_branches(network: Network) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return springs and rates of Maxwell branches, (n_branches, n); see `ascending`."""
    return ascending(network.k.T, (network.k / network.c).T)


def ascending(weights: NDArray[Any], rates: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return branches, (n_branches, n), ordered by their rates, equal rates moved apart."""
    if len(rates) < 2:
        return weights, rates
    order = np.argsort(rates.real, axis=0, kind="stable")
    weights, rates = (np.take_along_axis(of, order, axis=0) for of in (weights, rates))
    for slower, rate in pairwise(rates):
        rate += np.maximum((1 + _LEAST_GAP_OF_RATES) * slower.real - rate.real, 0)
    return weights, rates


class Ringing:
    """Modes of arms with inertia on n samples with any number of branches.

    The zeros are the rates without inertia.
    """

    def __init__(self, gripper: Gripper, network: Network, zeros: Zeros) -> None:
        self._lever_m, self._b_2 = gripper.lever_m, gripper.lever_m**2
        self._alike = gripper.left == gripper.right
        self._arms = [
            np.polynomial.Polynomial(
                (arm.stiffness_Nm_per_rad, arm.damping_Nms_per_rad, arm.inertia_kgm2)
            )
            for arm in (gripper.left, gripper.right)
        ]
        left, right = self._arms
        # E is the first and, times b^2 G, the second.
        self._of_arms = (left, 0 * left + 2) if self._alike else (left * right, left + right)
        self._k_p, self._c_p = network.k_p[:, None], network.c_p[:, None]
        self._k, self._rates = (of.T[:, None] for of in ascending_branches(network))
        slow = -zeros.values[: self._k.shape[2]].T * _OFF_REAL_AXIS
        starts = np.concatenate((slow, spread_starts(self._with_rigid_dampers())), axis=1)
        self.rates = s = find_zeros(starts, self._newton_step)
        """Roots of E in 1/s, (n, n_modes)."""
        self._sample, _, inverse = self._of_sample(s)
        # dE/ds: the polynomial's, a product over root distances, over all s + r_j. Of roots that
        # nearly coincide it fits their distance.
        factors = s[..., None] - s[:, None]
        factors[:, np.arange(s.shape[1]), np.arange(s.shape[1])] = 1
        factors[..., : inverse.shape[2]] *= inverse
        self._slope = self._of_arms[0].coef[-1] * factors.prod(axis=2)

    def weights(self, *, force: bool) -> ComplexArray:
        """Return weights, (n_arms, n_modes, n), of rotations or the force in N, per N m."""
        left, right = [np.ones_like(self.rates)] * 2
        if not self._alike:
            left, right = (arm(self.rates) for arm in self._arms)
        pressing = [self._lever_m * self._sample * (left + right)] if force else [right, left]
        weights: ComplexArray = np.array(pressing) / (self.rates * self._slope)
        return weights.swapaxes(1, 2)

    def _with_rigid_dampers(self) -> Array:
        """Return E with a spring and a damper as sample, ascending powers, (n, terms)."""
        springs = self._b_2 * (self._k_p + self._k.sum(axis=2))
        arms, factor = (np.asarray(of.coef, dtype=float) for of in self._of_arms)
        terms = np.tile(arms, (len(springs), 1))
        for power, of_power in enumerate(factor[: len(arms) - 1]):
            terms[:, power] += of_power * springs[:, 0]
            terms[:, power + 1] += of_power * self._b_2 * self._c_p[:, 0]
        return terms

    def _of_sample(self, s: ComplexArray) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """Return G and dG/ds at points, (n, n_points), and all 1/(s + r_j)."""
        away = s[..., None] + self._rates
        least = _LEAST_GAP_OF_ROOTS * self._rates
        inverse: NDArray[Any] = 1 / np.where(np.abs(away) < least, least, away)
        value = self._k_p + self._c_p * s + (self._k * inverse).sum(axis=2) * s
        slope = self._c_p + (self._k * self._rates * inverse**2).sum(axis=2)
        return value, slope, inverse

    def _newton_step(self, s: ComplexArray) -> ComplexArray:
        """Return the polynomial, E times all s + r_j, divided by its derivative."""
        sample, sample_slope, inverse = self._of_sample(s)
        arms, factor = self._of_arms
        value = arms(s) + self._b_2 * factor(s) * sample
        of_factor = factor.deriv()(s) * sample + factor(s) * sample_slope
        slope = arms.deriv()(s) + self._b_2 * of_factor
        return value / (slope + value * inverse.sum(axis=2))


# Forces below this share of the largest one are rounding errors.
_LEAST_FORCE = 1e-9
_TIMES_OF_PHASE, _MOST_TIMES = 200, 20_000


@dataclass(frozen=True)
class Grip:
    """The force of the jaws on a sample that they hold throughout a protocol."""

    largest_N: float
    """Largest force with which the jaws press."""
    lowest_N: float
    """Lowest force, negative if the jaws pull, else after the largest one."""
    lowest_at_s: float
    """Time of the lowest force."""
    pulls_from_s: float | None
    """Time from which the jaws would have to pull; None if they press throughout."""

    def words(self) -> str | None:
        """Describe from when and how hard the jaws would have to pull, if they would."""
        if self.pulls_from_s is None:
            return None
        return (
            f"the jaws would have to pull the sample from {self.pulls_from_s:.4g} s on "
            f"(with {-1e6 * self.lowest_N:.2g} µN at {self.lowest_at_s:.4g} s, where they press "
            f"with {1e6 * self.largest_N:.2g} µN at most)"
        )


def compute_grip(gripper: Gripper, network: Network, course: Course) -> Grip:
    """Compute the extreme forces of the jaws on the first sample, without inertia."""
    given = gripper, network, course
    return extreme_forces(lambda time_s: linear_jaw_force(*given, time_s, inertia=False)[0], course)


def extreme_forces(force_at: Callable[[Array], Array], course: Course) -> Grip:
    """Find the extreme forces of the jaws, a function of ascending times, over a course."""
    # Dense after every change of the load.
    lengths = np.diff(course.time_s, append=course.end_s)
    count = max(3, min(_TIMES_OF_PHASE, _MOST_TIMES // len(lengths)))
    after = np.outer(lengths, np.geomspace(1e-9, 1.0, count)[:-1])
    time_s = np.unique(np.append(course.time_s[:, None] + after, course.end_s))
    force = force_at(time_s)
    least_shown = _LEAST_FORCE * float(np.abs(force).max()) or 1.0
    shown = np.round(force / least_shown)
    most, negative = int(np.argmax(shown)), np.flatnonzero(shown < 0)
    first = 0 if len(negative) else most
    least = first + int(np.argmin(shown[first:]))
    return Grip(
        float(shown[most] * least_shown),
        float(shown[least] * least_shown),
        float(time_s[least]),
        float(time_s[negative[0]]) if len(negative) else None,
    )


# A ring of exp(-36) is lost in rounding.
_EFOLDS_OF_RING = 36.0


@dataclass(frozen=True)
class Ring:
    """Ringing of the arms that shows in a trace."""

    largest: float
    """Largest change of a reading by inertia, in standard deviations of the noise."""
    lasts_s: float
    """Time after a change of the torque of the last reading that would have to be left out."""


def ringing_s(gripper: Gripper) -> float:
    """Return the time in s after which the ringing of the arms has decayed below rounding.

    An arm loses energy to its own damper, whatever else it moves: the envelope of its ringing
    falls at least like exp(-c t / (2 I)).
    """
    arms = gripper.left, gripper.right
    return _EFOLDS_OF_RING * max(2 * arm.inertia_kgm2 / arm.damping_Nms_per_rad for arm in arms)


def elapsed_s(course: Course, time_s: Array) -> Array:
    """Return the times since the last change of the torque, (n_times,)."""
    last = np.maximum(course.changes_s.searchsorted(time_s, side="right") - 1, 0)
    return time_s - course.changes_s[last]


def ring(gripper: Gripper, network: Network, course: Course, time_s: Array) -> Array:
    """Compute the change of the left arm's rotation by inertia, (n, n_times) in rad."""
    responses = (step_response(gripper, network, inertia=inertia) for inertia in (True, False))
    with_it, without = (superpose(response, course, time_s) for response in responses)
    return with_it - without
