"""Where a tip touches its sample, fitted along with the sample, or doubted.

A depth that counts from a wrong zero is off by one length throughout, d -> d + d0. A scan with what
any linear sample may do finds d0 roughly; least squares of sample and d0 then find both. Limits of
the sample allow for any d0, to first order (`biogrip.fit.trace_fit.contact_function`), and d0 has
limits of first order.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from scipy.special import chdtri, stdtrit

import biogrip.levels as levels
from biogrip.arrays import Array
from biogrip.digits import plain
from biogrip.fit.experiment import Experiment
from biogrip.fit.least_squares import identify_many
from biogrip.fit.problem import silent
from biogrip.fit.trace_fit import contact_function
from biogrip.fit.trace_noise import absorbed
from biogrip.identify.load_noise import left_by_any
from biogrip.judging.diagnosis import Diagnosis
from biogrip.judging.doubts import DOUBT, REJECTED, REJECTION, Note
from biogrip.physics.noise import without
from biogrip.traces.reader import Recording

# Contacts that are tried, up to this share of the largest depth off; most steps.
_DEPTHS_TRIED, _FURTHEST, _MOST_EVALUATIONS = 41, 0.5, 50


def with_contact(experiment: Experiment, recording: Recording) -> Experiment:
    """Return an experiment whose tip is as deep as fits best, of a trace with times from 0."""
    assert experiment.record is not None
    assert experiment.tip_power is not None
    time_s, readings = recording.time_s, recording.readings
    deepest = float(experiment.record[:, 1].max()) ** (1 / experiment.tip_power)
    tried = deepest * np.linspace(-_FURTHEST, _FURTHEST, _DEPTHS_TRIED)
    guesses = [replace(experiment, deeper=deeper) for deeper in tried.tolist()]
    guess = guesses[int(np.argmin(left_by_any(guesses, time_s, readings)))]
    return replace(experiment, deeper=_fitted(guess, time_s, readings))


def _fitted(guess: Experiment, time_s: Array, readings: Array) -> float:
    """Fit depth and sample, beginning with a guess of the depth."""
    # Imported here: loading it takes longer than a short job.
    from scipy.optimize import least_squares

    exact = guess.to_identify()
    problem = exact.of(time_s, readings)
    (found,) = identify_many([problem], exact.least_squares, [np.random.default_rng(0)], silent)
    depth, noise = abs(guess.deeper) + 1e-3, problem.residuals.noise_scale

    def at(x: Array) -> tuple[Experiment, Array, Array]:
        moved = replace(exact, deeper=guess.deeper + depth * x[-1])
        residuals = replace(problem.residuals, course=moved.torque)
        return moved, *residuals(x[:-1])

    def slopes(x: Array) -> Array:
        moved, _, rows = at(x)
        by_depth = contact_function(moved, time_s, np.exp(x[:-1]))
        cleared = problem.residuals.trace.condensed.cleared(depth * by_depth)
        return np.vstack((rows, cleared)).T / noise

    start = np.append(np.log(found.parameters), 0.0)
    ends = np.append(problem.low, -np.inf), np.append(problem.high, np.inf)
    fit = least_squares(lambda x: at(x)[1] / noise, start, slopes, ends, max_nfev=_MOST_EVALUATIONS)
    return guess.deeper + depth * float(fit.x[-1])


def depth_off(diagnosis: Diagnosis) -> tuple[float, float, float]:
    """Return by how much a tip would be deeper than it was taken to be, to first order.

    It is that which what the fit leaves, in white noise, tells beside the sample's parameters. Also
    returned are how much a unit of it shows, as a norm, and the misfit with it over the scatter.
    """
    recording, experiment = diagnosis.identified
    likelihood, exact = diagnosis.likelihood, experiment.to_identify()
    residuals = exact.of(recording.time_s, recording.readings).residuals
    left, slopes = residuals(likelihood.best)
    if experiment.tip_power is None:
        # A depth that is read is less by what the tip is deeper.
        read = recording.read.instrument.read
        change = -read.slope(np.abs(residuals.response(likelihood.best)) ** (1 / read.power))
    else:
        change = contact_function(exact, recording.time_s, np.exp(likelihood.best))
    change = residuals.trace.condensed.cleared(change)
    basis = absorbed(np.vstack((slopes, residuals.trace.condensed.taken)))
    alone = without(basis, change)
    told = float(alone @ alone)
    if told <= levels.CONSTANT_OF_PEAK**2 * float(change @ change):
        return 0.0, 0.0, np.inf
    deeper = -float(alone @ left) / told
    rest = float(np.std(left + deeper * alone)) / residuals.noise_scale
    return deeper, float(np.sqrt(told)), rest


def depth_limits(diagnosis: Diagnosis) -> tuple[float, float, float]:
    """Return by how much a tip is deeper than recorded, in m, and its limits."""
    recording, experiment = diagnosis.identified
    likelihood, (_, shown, _) = diagnosis.likelihood, depth_off(diagnosis)
    sds = float(stdtrit(min(likelihood.freedom, 1e9), 0.5 + likelihood.confidence / 2))
    room = np.divide(likelihood.noise_sd, shown) * sds
    unit, middle = recording.read.instrument.controlled.units["m"], experiment.deeper
    return middle / unit, (middle - room) / unit, (middle + room) / unit


def notes_on_contact(diagnosis: Diagnosis) -> Iterator[Note]:
    """Yield a doubt if what a fit leaves follows the derivative by the contact, which was given."""
    recording, experiment = diagnosis.identified
    instrument, how = recording.read.instrument, "say --contact fit"
    depth = instrument.controlled
    if experiment.tip_power is None:
        depth, how = instrument.read, "count its depths from there"
    if depth.power == 1 or experiment.fit_contact:
        return
    deeper, shown, rest = depth_off(diagnosis)
    noise_sd = diagnosis.likelihood.noise_sd
    if rest < levels.WHITE:
        # All that is no noise is of the contact.
        noise_sd = min(noise_sd, rest * diagnosis.likelihood.problem.residuals.noise_scale)
    if (deeper * shown / noise_sd) ** 2 < chdtri(1, levels.FALSE_ALARM):
        return
    size_nm = 1e9 * abs(deeper) / depth.units["m"]
    side = "before" if deeper > 0 else "after"
    text = f"The tip seems to touch about {plain(size_nm, 2)} nm {side} the zero of its depth"
    rejected = diagnosis.status == REJECTED
    yield Note(REJECTION if rejected else DOUBT, f"{text}: {how}.")
