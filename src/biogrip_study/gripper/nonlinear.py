"""The corrected nonlinear model, eqs. (1)-(3), as a correction to the exact linear solution.

In the displacements u of the tips the sample stays linear; an arm is nonlinear only through its
rotation phi(u) and its lever b(phi) = l sin(hat-theta_2 - phi). Divided by the lever, an arm's
equation is (c phi' + k phi)/b + F = tau/b, and the linear model's (c u' + k u)/b_0^2 + F = tau/b_0.
So the nonlinear displacement is the linear one plus the linear response to the load

    g = tau (1/b - 1/b_0) - k (phi/b - u/b_0^2) - c u' (1/b^2 - 1/b_0^2)

which is small, of second order in the rotation. It is found by repeated substitution; each sweep is
an implicit collocation (Radau IIA, five stages [1]_) of uncoupled linear modes on a mesh graded
towards the torque's jumps, for all samples at once. Inertia acts on the linear part alone.

The force of the jaws is F_linear + g - (c u' + k u)/b_0^2, with u the correction: all of second
order, no large terms cancel.

References
----------
.. [1] E. Hairer and G. Wanner, Solving Ordinary Differential Equations II, Springer, 1996, IV.5.
"""

from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from biogrip.arrays import Array, BoolArray, IntArray
from biogrip.errors import BiogripError
from biogrip.physics.gripper import Arm, Gripper, rotation_of_tip
from biogrip.physics.protocol import Course, evaluate
from biogrip.physics.response import (
    LEFT,
    Arms,
    Grip,
    extreme_forces,
    linear_jaw_force,
    step_response,
    superpose,
)
from biogrip.physics.sample_model import Network

if TYPE_CHECKING:
    from scipy.interpolate import PPoly

_STAGES = 5

# Length of the first element after a jump of the torque, in s, and the ratio of each element's
# length to the one before: the error was below 1e-7 of the peak in all tests.
_FIRST_S, _GROWTH_OF_ELEMENTS = 1e-8, 1.3
# Largest change in the last sweep, relative to the peak, and limit of sweeps.
_LARGEST_CHANGE, _MOST_SWEEPS = 1e-13, 200


@dataclass(frozen=True)
class Correction:
    """Nonlinear minus linear rotation of n samples, as polynomials on a mesh."""

    rotation: "PPoly"
    """Of every arm in rad; at times it is (n_times, n, n_arms)."""
    force: "PPoly"
    """Jaw force in N, likewise, (n_times, n); after a jump, at the start."""
    converged: BoolArray
    """True if the sweeps converged, (n,)."""

    def checked(self) -> "Correction":
        """Return itself, or raise an error if the sweeps of some sample did not converge."""
        if not np.all(self.converged):
            raise BiogripError(
                "the nonlinear response could not be computed: the torque closes the arms so far "
                "that they lose their lever on the sample. Allowed are smaller torques."
            )
        return self

    def at(self, time_s: Array, arm: int = LEFT) -> Array:
        """Evaluate nonlinear minus linear rotation in rad at ascending times, (n, n_times)."""
        of_arms = self.rotation(np.maximum(time_s, 0.0))
        return np.asarray(of_arms[:, :, min(arm, of_arms.shape[2] - 1)].T)

    def force_at(self, time_s: Array) -> Array:
        """Evaluate nonlinear minus linear jaw force in N at ascending times, (n, n_times)."""
        return np.asarray(np.where(time_s < 0, 0.0, self.force(time_s).T))


def nonlinear_rotation(
    gripper: Gripper, network: Network, torque: Course, time_s: Array, arm: int = LEFT
) -> Array:
    """Compute the closing rotation of an arm by the nonlinear model.

    Parameters
    ----------
    gripper, network, torque
        Arms, n samples, and protocol of both arms.
    time_s
        Ascending, (n_times,).
    arm
        The left or the right arm.

    Returns
    -------
    Array
        Rotation in rad, (n, n_times).

    Raises
    ------
    BiogripError
        If the torque closes the arms beyond what the model describes.
    """
    beyond_linear = correction(gripper, network, torque).checked()
    linear = step_response(gripper, network)
    return superpose(linear, torque, time_s, arm) + beyond_linear.at(time_s, arm)


def jaw_force(
    gripper: Gripper,
    network: Network,
    course: Course,
    time_s: Array,
    *,
    nonlinear: bool,
    inertia: bool = True,
) -> Array:
    """Compute the jaws' force on the sample by either model.

    Parameters
    ----------
    gripper, network, course
        Arms, n samples, and protocol of both arms.
    time_s
        Ascending, (n_times,); at the instant of a step: what follows it.
    nonlinear
        By the nonlinear model, which has the errors of `nonlinear_rotation`.
    inertia
        With the inertia of the arms; without, the force may jump.

    Returns
    -------
    Array
        Force in N, positive while the jaws press, (n, n_times).
    """
    force = linear_jaw_force(gripper, network, course, time_s, inertia=inertia)
    if nonlinear:
        # Arms with inertia have not moved yet at the instant of a step.
        instants = np.nextafter(time_s, -np.inf) if inertia else time_s
        force += correction(gripper, network, course).checked().force_at(instants)
    return force


def target_grip(gripper: Gripper, network: Network, course: Course, *, nonlinear: bool) -> Grip:
    """Compute the extreme forces of the jaws on the first sample, without inertia."""
    given = gripper, network, course
    return extreme_forces(
        lambda time_s: jaw_force(*given, time_s, nonlinear=nonlinear, inertia=False)[0], course
    )


def correction(
    gripper: Gripper, network: Network, torque: Course, factors: Array | None = None
) -> Correction:
    """Compute nonlinear minus linear rotation and jaw force of samples.

    Parameters
    ----------
    gripper, network, torque
        Arms, n samples, and protocol of both arms.
    factors
        By which the torque on each sample is multiplied, (n,); by default 1.

    Returns
    -------
    Correction
        Where sweeps did not converge, it says so.
    """
    arms = [gripper.left] if gripper.left == gripper.right else [gripper.left, gripper.right]
    response = step_response(gripper, network, inertia=False)
    edges = _mesh(torque)
    modes = _MeshModes(response.rates, _weights_of_loads(gripper, network), np.diff(edges))
    # Collocation nodes, (n_elements, _STAGES).
    nodes = edges[:-1, None] + np.diff(edges)[:, None] * _radau()[0]
    nodes[:, -1] = edges[1:]
    before_jumps = np.minimum(nodes, np.nextafter(edges[1:, None], 0)).ravel()
    shape = (len(network.k_p), len(arms), *nodes.shape)
    b_0 = gripper.lever_m
    every, given = range(len(arms)), (response, torque)
    turned = [superpose(*given, nodes.ravel(), arm) for arm in every]
    rates = [superpose(*given, before_jumps, arm, rate=True) for arm in every]
    linear, linear_rate = (np.stack(of, axis=1).reshape(shape) for of in (turned, rates))
    tau = evaluate(torque, before_jumps).reshape(nodes.shape)
    times = np.ones(shape[0]) if factors is None else factors
    linear, linear_rate, tau = (
        times[:, None, None, None] * values for values in (linear, linear_rate, tau)
    )
    peak = np.abs(linear).max(axis=(1, 2, 3))
    extra, extra_rate, loads = np.zeros(shape), np.zeros(shape), np.zeros(shape)
    converged = np.zeros(shape[0], dtype=bool)
    # Converged samples stay, so that their number of sweeps does not depend on the others.
    left = np.arange(shape[0])
    for _ in range(_MOST_SWEEPS):
        u = b_0 * (linear[left] + extra[left])
        u_rate = b_0 * (linear_rate[left] + extra_rate[left])
        loads[left] = load = b_0 * _load_of(gripper, arms, tau[left], u, u_rate)
        # That of both arms, and what that of the left one exceeds that of the right one by.
        load[:, 1:] = load[:, :1] - load[:, 1:]
        new_extra, extra_rate[left] = modes.respond(load, left)
        change = np.abs(new_extra - extra[left]).max(axis=(1, 2, 3))
        extra[left] = new_extra
        converged[left] = change <= _LARGEST_CHANGE * peak[left]
        left = left[~converged[left] & np.isfinite(change)]
        if not len(left):
            break
    phi = rotation_of_tip(gripper, b_0 * (linear + extra))
    at_nodes = phi - linear
    values = np.concatenate((np.zeros((*shape[:3], 1)), at_nodes), axis=3)
    values[:, :, 1:, 0] = at_nodes[:, :, :-1, -1]
    held = gripper.left.stiffness_Nm_per_rad * extra + gripper.left.damping_Nms_per_rad * extra_rate
    force = (loads - held)[:, 0] / b_0
    c = _radau()[0]
    # After a jump of the torque, no polynomial of the force goes on from the one before.
    return Correction(
        _on_mesh(np.append(0.0, c), values, edges), _on_mesh(c, force, edges), converged
    )


def _weights_of_loads(gripper: Gripper, network: Network) -> Array:
    """Compute weights of the modes without inertia under steps of either arm's load.

    In rad per N m, (n, n_arms, n_loads, n_modes); loads are that of both arms and, where these
    differ, what that of the left arm exceeds that of the right one by: phi_2 = [Z_4/(Z_2 + Z_4)
    tau_2 + b^2 G/(Z_2 + Z_4) (tau_2 - tau_4)] / H. Of equal arms, only that of both, and one stands
    for both.
    """
    arms = Arms(gripper)
    impedance = arms.with_sample(network)
    zeros = impedance.zeros()
    of_right, of_left = arms.rotations(zeros)
    numerators = [[of_right]]
    if not arms.alike:
        through = -of_left * of_right
        numerators = [[of_right, through], [of_left, -of_left - through]]
    weights = -np.array(numerators) / impedance.steepness(zeros)
    return np.ascontiguousarray(np.moveaxis(weights, -1, 0))


def _on_mesh(points: Array, values: Array, edges_s: Array) -> "PPoly":
    """Return polynomials through values, (..., n_elements, n_points), at points of elements."""
    # Imported here, for only what is nonlinear needs it.
    from scipy.interpolate import PPoly

    on_unit_elements = values @ np.linalg.inv(np.vander(points)).T
    coefficients = on_unit_elements / np.diff(edges_s)[:, None] ** np.arange(len(points))[::-1]
    return PPoly(np.moveaxis(coefficients, (-1, -2), (0, 1)), edges_s)


def _mesh(torque: Course) -> Array:
    """Return element edges from 0 to the end, graded towards every change of torque."""
    edges = [0.0]
    for start, end in pairwise([*torque.time_s.tolist(), torque.end_s]):
        length, here = _FIRST_S, start
        # The last element takes a short remainder along.
        while here + 1.5 * length < end:
            here += length
            edges.append(here)
            length *= _GROWTH_OF_ELEMENTS
        edges.append(end)
    return np.array(edges)


def _load_of(gripper: Gripper, arms: list[Arm], tau: Array, u: Array, u_rate: Array) -> Array:
    """Compute the load g of every arm, shape (n, n_arms, n_elements, _STAGES)."""
    b_0 = gripper.lever_m
    phi = rotation_of_tip(gripper, u)
    b = gripper.arm_length_m * np.sin(np.radians(gripper.reference_angle_deg) - phi)
    load = np.empty_like(u)
    for i, arm in enumerate(arms):
        stiffness, damping = arm.stiffness_Nm_per_rad, arm.damping_Nms_per_rad
        load[:, i] = tau[:, 0] * (1 / b[:, i] - 1 / b_0)
        load[:, i] -= stiffness * (phi[:, i] / b[:, i] - u[:, i] / b_0**2)
        load[:, i] -= damping * u_rate[:, i] * (1 / b[:, i] ** 2 - 1 / b_0**2)
    return load


class _MeshModes:
    """Computes the response of linear modes to loads given at the nodes of a mesh."""

    def __init__(self, rates: Array, weights: Array, lengths_s: Array) -> None:
        a, ones = _radau()[1], np.ones(_STAGES)
        z = rates[:, :, None] * lengths_s
        inverse = np.linalg.inv(np.eye(_STAGES) - z[..., None, None] * a)
        self._carry = inverse @ ones
        self._gain = lengths_s[:, None, None] * (inverse @ a)
        self._rates = rates[:, None, :, None, None]
        self._residues = weights * rates[:, None, None, :]

    def respond(self, load: Array, which: IntArray) -> tuple[Array, Array]:
        """Compute rotations and rates, (n, n_arms, n_elements, _STAGES), under loads."""
        forced = np.einsum("nmeij,ndej->ndmei", self._gain[which], load)
        start = np.zeros(forced.shape[:4])
        carry = self._carry[which]
        for element in range(forced.shape[3] - 1):
            carried = carry[:, None, :, element, -1] * start[..., element]
            start[..., element + 1] = carried + forced[..., element, -1]
        q = carry[:, None] * start[..., None] + forced
        q_rate = self._rates[which] * q + load[:, :, None]
        residues = self._residues[which]
        return (
            np.einsum("nadm,ndmei->naei", residues, q),
            np.einsum("nadm,ndmei->naei", residues, q_rate),
        )


@cache
def _radau() -> tuple[Array, Array]:
    """Return nodes c and matrix A of the Radau IIA method with `_STAGES` stages."""
    legendre = np.polynomial.legendre
    ends = legendre.Legendre.basis(_STAGES) - legendre.Legendre.basis(_STAGES - 1)
    c = 0.5 * (np.sort(ends.roots().real) + 1)
    c[-1] = 1.0
    powers = np.arange(_STAGES)
    vandermonde = c[:, None] ** powers
    integrals = c[:, None] ** (powers + 1) / (powers + 1)
    return c, integrals @ np.linalg.inv(vandermonde)
