"""What plausible samples show under many torques: sensitivities, rotation and jaw force.

Their modes do not depend on the torque (`biogrip.response.ringing`). From step to step a mode is
carried on as in `biogrip.response.mode_growth`, and within a step everything is a product of what
it has done before and of functions of the time since, which are known before any torque is.
The left arm's equation gives the force: b F = tau - I phi'' - c phi' - k phi.
"""

from dataclasses import dataclass

import numpy as np

from biogrip.arrays import Array, ComplexArray
from biogrip.design.steps import Steps
from biogrip.experiment.sample import SampleModel
from biogrip.instrument.gripper import Gripper
from biogrip.response.modes import Modes
from biogrip.response.ringing import ringing_modes


@dataclass(frozen=True)
class View:
    """What is seen under a torque whose largest is 1 N m.

    Parameters
    ----------
    sensitivity : (n, n_parameters, n_steps, n_times)
        d phi / d log p in rad.
    rotation : (n, n_steps, n_times)
        In rad.
    force : (n, n_steps, n_times)
        Jaw force in N.
    last_rotation, last_force : (n, n_steps)
        At the end of each step.
    """

    sensitivity: Array
    rotation: Array
    force: Array
    last_rotation: Array
    last_force: Array


class Views:
    """Views of plausible samples at given times after each step.

    Parameters
    ----------
    gripper, model
        What is simulated, with inertia, both arms driven alike.
    parameters : (n, n_parameters)
        Of the plausible samples.
    elapsed_s : (n_times,)
        Times after a step.
    """

    def __init__(
        self, gripper: Gripper, model: SampleModel, parameters: Array, elapsed_s: Array
    ) -> None:
        arm, self._lever_m = gripper.left, gripper.lever_m
        self._stiffness = arm.stiffness_Nm_per_rad
        rates, weights, rate_slopes, weight_slopes = _side_by_side(gripper, model, parameters)
        self._rates, self._weights = rates, weights
        # By which what a mode does, and how that changes with its rate, is seen: (n, p, m).
        self._by_growth, self._by_slope = weight_slopes, weights[:, None] * rate_slopes
        self._inert = weights * (arm.inertia_kgm2 * rates**2 + arm.damping_Nms_per_rad * rates)
        z = rates[..., None] * elapsed_s
        decay = np.exp(z)
        functions = np.concatenate((np.expm1(z), decay, elapsed_s * decay), axis=1)
        self._functions = np.concatenate((functions.real, -functions.imag), axis=1)

    def under(self, steps: Steps) -> View:
        """See the samples under steps."""
        growing = np.expm1(self._rates * steps.durations_s[:, None, None])
        reached, slanted = _carried(steps, growing)
        amplitude = reached + steps.levels[:, None, None]
        last = amplitude * growing
        last_rotation = np.sum(self._weights * (reached + last), axis=2).real
        inert = np.sum(self._inert * (amplitude + last), axis=2).real
        pushing = steps.levels[:, None] - inert - self._stiffness * last_rotation
        last_force = pushing.T / self._lever_m
        # (n, rows, n_steps, 3 m): of e^(r e) - 1, e^(r e) and e e^(r e).
        n, p, m = self._by_growth.shape
        count = len(steps.levels)
        mixing = np.zeros((n, p + 2, count, 3 * m), dtype=complex)
        rest = np.empty((n, p + 2, count))
        amplitude, reached, slanted = (
            part.swapaxes(0, 1)[:, None] for part in (amplitude, reached, slanted)
        )
        by_growth, by_slope = self._by_growth[:, :, None], self._by_slope[:, :, None]
        mixing[:, :p, :, :m] = by_growth * amplitude
        mixing[:, :p, :, m : 2 * m] = by_slope * slanted
        mixing[:, :p, :, 2 * m :] = by_slope * amplitude
        rest[:, :p] = np.sum(by_growth * reached, axis=-1).real
        turned = self._weights[:, None] * amplitude[:, 0]
        mixing[:, p, :, :m] = turned
        rest[:, p] = np.sum(self._weights[:, None] * reached[:, 0], axis=-1).real
        mixing[:, p + 1, :, :m] = -self._stiffness / self._lever_m * turned
        mixing[:, p + 1, :, m : 2 * m] = -self._inert[:, None] / self._lever_m * amplitude[:, 0]
        rest[:, p + 1] = (steps.levels - self._stiffness * rest[:, p]) / self._lever_m
        parts = np.concatenate((mixing.real, mixing.imag), axis=-1)
        rows = parts.reshape(n, -1, 6 * m) @ self._functions
        seen = rows.reshape(n, p + 2, count, -1) + rest[..., None]
        return View(seen[:, :p], seen[:, p], seen[:, p + 1], last_rotation.T, last_force)


def _carried(steps: Steps, growing: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
    """What modes have done when a step comes, and its derivative, (n_steps, n, n_modes)."""
    reached = np.zeros(growing.shape, dtype=complex)
    slanted = np.zeros_like(reached)
    before = zip(steps.durations_s[:-1].tolist(), steps.levels[:-1].tolist(), strict=True)
    for k, (duration_s, level) in enumerate(before):
        amplitude = reached[k] + level
        reached[k + 1] = reached[k] + amplitude * growing[k]
        slanted[k + 1] = (slanted[k] + amplitude * duration_s) * (1 + growing[k])
    return reached, slanted


def _side_by_side(
    gripper: Gripper, model: SampleModel, parameters: Array
) -> tuple[ComplexArray, ComplexArray, ComplexArray, ComplexArray]:
    """Modes of all samples, with as many that do nothing as some have fewer."""
    each: list[list[Modes]] = [[] for _ in parameters]
    for rows, modes in ringing_modes(gripper, model, parameters, symmetric=True):
        for place, row in enumerate(rows):
            one = slice(place, place + 1)
            each[row] = [
                Modes(
                    part.rates[one],
                    part.weights[one, 0],
                    part.rate_slopes[one],
                    part.weight_slopes[one, :, 0],
                )
                for part in modes
            ]
    most = max(sum(part.rates.shape[1] for part in parts) for parts in each)
    n, p = parameters.shape
    rates = np.full((n, most), -1.0, dtype=complex)
    weights = np.zeros((n, most), dtype=complex)
    rate_slopes, weight_slopes = np.zeros((2, n, p, most), dtype=complex)
    for row, parts in enumerate(each):
        last = 0
        for part in parts:
            here = slice(last, last := last + part.rates.shape[1])
            rates[row, here], weights[row, here] = part.rates[0], part.weights[0]
            rate_slopes[row, :, here] = part.rate_slopes[0]
            weight_slopes[row, :, here] = part.weight_slopes[0]
    return rates, weights, rate_slopes, weight_slopes
