"""Simulated readings of samples, and the force of the jaws on them, by the linear model.

Targets have the arms' inertia, fits leave it out: after a change of the torque, arms ring for
milliseconds, and later changes are negligible (docs/model.md, "Without inertia").
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from biogrip.arrays import Array
from biogrip.physics.gripper import Gripper
from biogrip.physics.modes import elements_of, mode_responses
from biogrip.physics.protocol import Course
from biogrip.physics.response import LEFT, linear_jaw_force, step_response, superpose
from biogrip.physics.sample_model import Network

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

    def force_at(time_s: Array) -> Array:
        return linear_jaw_force(gripper, network, course, time_s, inertia=False)[0]

    return extreme_forces(force_at, course)


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


def simulated_response(gripper: Gripper, network: Network, course: Course, time_s: Array) -> Array:
    """Simulate what is read at ascending times, (n, n_times), with inertia, by corrected (4)-(6).

    Of a gripper that is the closing rotation of the left arm in rad.
    """
    if course.deforms:
        rates, weights = elements_of(network)
    else:
        response = step_response(gripper, network, inertia=gripper.has_inertia)
        if gripper.has_inertia:
            return superpose(response, course, time_s)
        rates, weights = response.rates, response.weights[:, LEFT]
    return (weights[:, None] @ mode_responses(rates, course, time_s))[:, 0]


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
