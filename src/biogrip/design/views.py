"""Fast responses of plausible samples to many torques: sensitivities, rotation and jaw force.

Modes do not depend on the torque (`biogrip.response.ringing`). From step to step a mode is
carried on as in `biogrip.response.mode_growth`. Within a step, its response is a product of its
state at the step and of functions of the time since, which are the same for all torques. With r
a rate, v, s and a the torque, its slope and its amplitude at a step, w the angular frequency,
e the time since, G the mode's response at the step, and q = r / (r^2 + w^2), the response is

    g = G + (G + v) (e^(r e) - 1) + s [(e^(r e) - 1) / r - e]
          + a q [w e^(r e) - r sin(w e) - w cos(w e)]

The left arm's equation gives the force: b F = tau - I phi'' - c phi' - k phi, where a mode's
phi' is r times its weight, g and the torque together; the torque's own slope drops out, for arms
with inertia do not start to turn at once.

Readings are means of g over an exposure T, no longer than the time since the step. Those of the
functions of e are again of the same kind, such as e^(r (e - T)) (e^(r T) - 1) / (r T).

Without a gripper modes are those of the sample (`biogrip.response.protocol_modes`). Where the
protocol is a deformation x, a mode's load is h = g + x (`biogrip.response.mode_decay`). With h for
G + v, the response is

    h e^(r e) + s (e^(r e) - 1) / r + a q [w e^(r e) + w^2/r sin(w e) - w cos(w e)]

which is what the torque and g make together above.
"""

from dataclasses import dataclass

import numpy as np

from biogrip.arrays import Array, ComplexArray, IntArray
from biogrip.design.waveform import Waveform
from biogrip.experiment.protocol import hold as hold_load
from biogrip.experiment.protocol import torque_history
from biogrip.experiment.sample import SampleModel
from biogrip.instrument.gripper import NO_ARMS, Gripper
from biogrip.instrument.instrument import Instrument
from biogrip.response.modes import Modes
from biogrip.response.protocol_modes import compute_protocol_modes
from biogrip.response.ringing import ringing_modes

# Share of a mode that decays within the longest time, at least; twice the rounding error over it
# is lost under ramps.
_SLOWEST = 1e-7
# Magnitude up to which a series is exact, to 1e-12.
_SMALL = 0.02


@dataclass(frozen=True)
class View:
    """Responses after some steps of a torque whose largest is 1 N m."""

    sensitivity: Array
    """d phi / d log p in rad, (n, n_parameters, n_steps, n_times)."""
    rotation: Array
    """In rad, (n, n_steps, n_times)."""
    force: Array
    """Jaw force in N, (n, n_steps, n_times)."""


@dataclass(frozen=True)
class _Factors:
    """Coefficients of functions of the time e since a step, (n_steps, n, n_modes).

    Those of e^(r e) - 1, e^(r e), e e^(r e), 1, e, sin(w e) and cos(w e).
    """

    growing: ComplexArray
    decaying: ComplexArray
    lasting: ComplexArray
    resting: ComplexArray
    linear: ComplexArray
    sine: ComplexArray
    cosine: ComplexArray


class Views:
    """Modes of plausible samples, prepared for responses to many torques.

    Arms have inertia, and are driven alike. Responses are computed at times after a step, by
    default those given here, (n_times,). Sensitivities are means over the exposure before them.
    """

    def __init__(
        self,
        gripper: Gripper,
        model: SampleModel,
        parameters: Array,
        elapsed_s: Array,
        instrument: Instrument,
        exposure_s: float = 0.0,
    ) -> None:
        arm, self.lever_m = gripper.left, gripper.lever_m
        self.instrument = instrument
        self.stiffness = arm.stiffness_Nm_per_rad
        self.rates, self.weights, rate_slopes, weight_slopes = (
            _side_by_side(gripper, model, parameters)
            if instrument.has_jaws
            else _without_arms(model, parameters, instrument, float(elapsed_s[-1]))
        )
        # Factors of a mode's response, and of its derivative by the rate: (n, p, m).
        self.by_growth, self.by_slope = weight_slopes, self.weights[:, None] * rate_slopes
        self.inert = self.weights * (
            arm.inertia_kgm2 * self.rates**2 + arm.damping_Nms_per_rad * self.rates
        )
        self.exposure_s = exposure_s
        self.elapsed_s = elapsed_s
        self.functions = self.functions_at(elapsed_s)
        self.averaged = self.averaged_at(elapsed_s) if exposure_s else self.functions

    def functions_at(self, elapsed_s: Array) -> Array:
        """Return e^(r e) - 1, e^(r e), e e^(r e), real then imaginary parts, (n, 6 m, n_times)."""
        z = self.rates[..., None] * elapsed_s
        decay: ComplexArray = np.exp(z)
        return _in_parts(np.expm1(z), decay, elapsed_s * decay)

    def averaged_at(self, elapsed_s: Array) -> Array:
        """Return the means of `functions_at` over the exposure before each time."""
        before_s = np.maximum(elapsed_s - self.exposure_s, 0.0)
        z = self.rates[..., None] * self.exposure_s
        mean, slope = np.expm1(z) / z, _mean_slope(z)
        earlier = self.rates[..., None] * before_s
        decay: ComplexArray = np.exp(earlier)
        slanted: ComplexArray = decay * (before_s * mean + self.exposure_s * slope)
        return _in_parts(np.expm1(earlier) * mean + (mean - 1), decay * mean, slanted)

    def under(self, waveform: Waveform) -> "Moving":
        """Return the responses of the samples to a torque."""
        return Moving(self, waveform)


class Moving:
    """Responses of samples to a torque in N m."""

    def __init__(self, views: Views, waveform: Waveform) -> None:
        self._views, self._waveform = views, waveform
        r = views.rates
        deforms = views.instrument.deforms
        steps = waveform.jumps if deforms else waveform.levels
        v, s, a = (part[:, None, None] for part in (steps, waveform.slopes, waveform.amplitudes))
        self._omega = 2 * np.pi / waveform.periods_s
        w, d = self._omega[:, None, None], waveform.durations_s[:, None, None]
        squares = r**2 + w**2
        q, q_slope = r / squares, (w**2 - r**2) / squares**2
        # The same, which of a bare damper would leave rounding errors only.
        lagging = w**2 / squares if deforms else 1 - q * r
        growing = np.expm1(r * d)
        sine, cosine = np.sin(w * d), np.cos(w * d)
        # Response to a step's own slope and sinusoid, whatever came before.
        swung = a * (q * w * (1 + growing) - q * r * sine - q * w * cosine)
        added = s * (growing / r - d) + swung
        ramped = s * growing / r
        swayed = a * (q * w * (1 + growing) + lagging * sine - q * w * cosine)
        added_slope = s * (d * (1 + growing) / r - growing / r**2) + a * (
            (q_slope + q * d) * w * (1 + growing) - (q_slope * r + q) * sine - q_slope * w * cosine
        )
        before, slope_before = _carried(
            waveform.durations_s,
            steps,
            growing,
            ramped + swayed if deforms else added,
            added_slope,
            deforms=deforms,
        )
        amplitude = before + v
        zero = np.zeros_like(amplitude)
        self._growth = _Factors(
            amplitude + s / r, a * q * w + zero, zero, before, zero - s, -a * q * r, -a * q * w
        )
        self._slope = _Factors(
            -s / r**2,
            slope_before + a * q_slope * w,
            amplitude + s / r + a * q * w,
            zero,
            zero,
            -a * (q_slope * r + q),
            -a * q_slope * w,
        )
        self._pushed = _Factors(
            s / r, amplitude + a * q * w, zero, zero, zero, a * lagging, -a * q * w
        )
        last = before + amplitude * growing + added
        pushed = amplitude * (1 + growing) + ramped + swayed
        if deforms:
            self._growth, last = self._pushed, pushed
        rotation = np.sum(views.weights * last, axis=2).real
        torque = (v + s * d + a * sine)[..., 0]
        force = torque - np.sum(views.inert * pushed, axis=2).real - views.stiffness * rotation
        self.last_rotation: Array = rotation.T
        """Rotation at the end of each step, (n, n_steps)."""
        self.last_force: Array = force.T / views.lever_m
        """Jaw force at the end of each step, (n, n_steps)."""

    def respond(self, steps: IntArray, elapsed_s: Array | None = None) -> View:
        """Compute the responses after steps of some indices, at times since each.

        The times are of all these steps, (n_times,), or of each, (n_steps, n_times). By default
        they are those of all views.
        """
        views = self._views
        functions, averaged = views.functions, views.averaged
        if elapsed_s is None:
            elapsed_s = views.elapsed_s
        else:
            functions = averaged = views.functions_at(elapsed_s.ravel())
            if views.exposure_s:
                averaged = views.averaged_at(elapsed_s.ravel())
        growth, slope, pushed = (
            _Factors(*(part[steps].swapaxes(0, 1)[:, None] for part in vars(factors).values()))
            for factors in (self._growth, self._slope, self._pushed)
        )
        n, p, m = views.by_growth.shape
        by_growth, by_slope = views.by_growth[:, :, None], views.by_slope[:, :, None]
        weights, inert = views.weights[:, None, None], views.inert[:, None, None] / views.lever_m
        pulling = views.stiffness / views.lever_m * weights

        def rows(name: str) -> ComplexArray:
            g, by_rate, moved = (getattr(factors, name) for factors in (growth, slope, pushed))
            sensitivity = by_growth * g + by_slope * by_rate
            return np.concatenate((sensitivity, weights * g, -pulling * g - inert * moved), axis=1)

        # (n, rows, n_seen, 3 m): of e^(r e) - 1, e^(r e) and e e^(r e).
        mixing = np.concatenate([rows(name) for name in ("growing", "decaying", "lasting")], axis=3)
        parts = np.concatenate((mixing.real, mixing.imag), axis=-1)
        count, times = len(steps), elapsed_s.shape[-1]

        def mixed(part: Array, by: Array) -> Array:
            if elapsed_s.ndim == 1:
                return (part.reshape(n, -1, 6 * m) @ by).reshape(n, -1, count, times)
            of_each = by.reshape(n, 6 * m, count, times).swapaxes(1, 2)
            return (part.swapaxes(1, 2) @ of_each).swapaxes(1, 2)

        read, now = mixed(parts[:, :p], averaged), mixed(parts[:, p:], functions)

        def add(name: str, mean: Array, function: Array) -> None:
            scale = rows(name).sum(axis=-1).real[..., None]
            read[...] += scale[:, :p] * mean
            now[...] += scale[:, p:] * function

        waveform = self._waveform
        levels, slopes = waveform.levels[steps, None], waveform.slopes[steps, None]
        add("resting", np.ones(1), np.ones(1))
        now[:, 1] += levels / views.lever_m
        if slopes.any():
            add("linear", elapsed_s - views.exposure_s / 2, elapsed_s)
            now[:, 1] += slopes * elapsed_s / views.lever_m
        if waveform.amplitudes[steps].any():
            angle = self._omega[steps, None] * elapsed_s
            half = self._omega[steps, None] * views.exposure_s / 2
            mean = np.sinc(half / np.pi)
            add("sine", mean * np.sin(angle - half), np.sin(angle))
            add("cosine", mean * np.cos(angle - half), np.cos(angle))
            now[:, 1] += waveform.amplitudes[steps, None] * np.sin(angle) / views.lever_m
        return View(read, now[:, 0], now[:, 1])


def _in_parts(*functions: ComplexArray) -> Array:
    """Return functions of all modes, real then imaginary parts, (n, 6 m, n_times)."""
    all_modes = np.concatenate(functions, axis=1)
    return np.concatenate((all_modes.real, -all_modes.imag), axis=1)


def _mean_slope(z: ComplexArray) -> ComplexArray:
    """Return the derivative of (e^z - 1) / z."""
    series = 0.5 + z * (1 / 3 + z * (1 / 8 + z * (1 / 30 + z * (1 / 144 + z / 840))))
    small = np.abs(z) < _SMALL
    by = np.where(small, 1.0, z)
    found: ComplexArray = np.where(small, series, (np.exp(by) * (by - 1) + 1) / by**2)
    return found


def _carried(
    durations_s: Array,
    steps: Array,
    growing: ComplexArray,
    added: ComplexArray,
    added_slope: ComplexArray,
    *,
    deforms: bool,
) -> tuple[ComplexArray, ComplexArray]:
    """Return responses of modes at each step, and derivatives, (n_steps, n, n_modes).

    Steps are levels or, of what deforms, jumps.
    """
    reached = np.zeros(growing.shape, dtype=complex)
    slanted = np.zeros_like(reached)
    before = zip(durations_s[:-1].tolist(), steps[:-1].tolist(), strict=True)
    for k, (duration_s, step) in enumerate(before):
        amplitude = reached[k] + step
        reached[k + 1] = (amplitude if deforms else reached[k]) + amplitude * growing[k] + added[k]
        slanted[k + 1] = (slanted[k] + amplitude * duration_s) * (1 + growing[k]) + added_slope[k]
    return reached, slanted


def _without_arms(
    model: SampleModel, parameters: Array, instrument: Instrument, longest_s: float
) -> list[ComplexArray]:
    """Return the modes of all samples under a load or a deformation.

    A mode that hardly changes within the longest time gets a rate with which that is `_SLOWEST`, so
    that little is lost in rounding. Of creep its flow, weight times rate, remains.
    """
    protocol = torque_history((hold_load(1.0, 1.0),), deforms=instrument.deforms)
    rates, weights, rate_slopes, weight_slopes = compute_protocol_modes(
        NO_ARMS, model, protocol, parameters
    )
    weights, weight_slopes = weights[:, 0], weight_slopes[:, :, 0]
    slowed = np.minimum(rates, -_SLOWEST / longest_s)
    if not instrument.deforms:
        share = rates / slowed
        slow = (share < 1)[:, None]
        flows = weight_slopes * share[:, None] + (weights / slowed)[:, None] * rate_slopes
        weight_slopes, weights = np.where(slow, flows, weight_slopes), weights * share
        rate_slopes = np.where(slow, 0.0, rate_slopes)
    return [part.astype(complex) for part in (slowed, weights, rate_slopes, weight_slopes)]


def _side_by_side(
    gripper: Gripper, model: SampleModel, parameters: Array
) -> tuple[ComplexArray, ComplexArray, ComplexArray, ComplexArray]:
    """Return the modes of all samples, padded with modes of zero weight to equal numbers."""
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
