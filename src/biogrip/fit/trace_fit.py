"""Identification of one trace with its noise model, an uncertain gripper, and uncertain steps.

If the noise is white and all else known, this is one global fit. Otherwise outliers are struck.
Then the best fit, the autocorrelation of its residuals and the effects of what is uncertain are
computed in turn, until none of them changes.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

import biogrip.levels as levels
from biogrip.arrays import Array, BoolArray, IntArray
from biogrip.digits import counted, rounded
from biogrip.fit.experiment import Experiment, pose
from biogrip.fit.least_squares import identify_many, refit
from biogrip.fit.nested_fits import deepen
from biogrip.fit.problem import Fit, ReportProgress, TraceProblem, silent
from biogrip.fit.trace_noise import (
    NoiseModel,
    NoiseModelLikelihood,
    absorbed,
    growth_left,
    outliers_of,
)
from biogrip.physics.protocol import Phase, join_phases
from biogrip.physics.response import simulated_response

# Square of three standard uncertainties.
_SECOND_ORDER = 9.0


def gripper_functions(experiment: Experiment, time_s: Array, parameters: Array) -> Array:
    """Compute the changes of a reading by the uncertainties of the gripper and of the protocol.

    To the first order it is half the difference between responses with the property a standard
    uncertainty above and below its value, as is recommended for nonlinear models (JCGM 100:2008,
    section 5.1.3, note 2). The mean of both, less the rotation itself, is its second order: it
    grows with the square of the error, and has the amplitude of an error of three standard
    uncertainties. Without it limits would be too narrow where the noise is far below the square.

    Rows are changes at ascending times, (2 n_properties, n_times), those of first order of each
    uncertain property, then those of second.
    """
    network = experiment.searched.network(parameters)
    errors_s = experiment.uncertainty.get("steps", {})

    def rotation(part: str = "", key: str = "", error: float = 0.0) -> Array:
        gripper, torque = experiment.gripper, experiment.torque
        if part == "torque":
            torque = torque.times(1 + error)
        elif part == "steps":
            later_s = np.array([error if key == number else 0.0 for number in errors_s])
            torque = experiment.with_steps_later(later_s).torque
        elif part == "all steps":
            torque = experiment.with_steps_later(error * np.array([*errors_s.values()])).torque
        elif part == "gripper":
            gripper = replace(gripper, **{key: getattr(gripper, key) + error})
        elif part:
            arm = getattr(gripper, part)
            arm = replace(arm, **{key: getattr(arm, key) + error})
            gripper = replace(gripper, **{part: arm})
        return simulated_response(gripper, network, torque, time_s)[0]

    if not experiment.uncertain:
        return np.zeros((0, len(time_s)))
    above, below = (
        np.array([rotation(part, key, sign * error) for part, key, error in experiment.uncertain])
        for sign in (1, -1)
    )
    second = 0.5 * (above + below) - rotation()
    return np.vstack((0.5 * (above - below), _SECOND_ORDER * second))


def contact_function(experiment: Experiment, time_s: Array, parameters: Array) -> Array:
    """Compute the change of a reading by the depth of a tip, over that, (n_times,)."""
    assert experiment.record is not None
    assert experiment.tip_power is not None
    network = experiment.searched.network(parameters)
    step = _OF_DEPTH * float(np.abs(experiment.record[:, 1]).max()) ** (1 / experiment.tip_power)
    ends = [
        simulated_response(experiment.gripper, network, moved.torque, time_s)[0]
        for moved in (replace(experiment, deeper=experiment.deeper + by) for by in (step, -step))
    ]
    return (ends[0] - ends[1]) / (2 * step)


def load_functions(
    experiment: Experiment, time_s: Array, parameters: Array, sensitivity: Array
) -> Array:
    """Compute what errors of a smoothed load add to readings, (n_functions, n_times).

    Those that show most have functions of their own. Of the others that is told by which they move
    parameters, with slopes (n_parameters, n_times): they hardly differ from noise otherwise.
    """
    if experiment.load_errors is None:
        return sensitivity[:0]
    shown = _shown_of_errors(experiment, time_s, parameters)
    shown = shown[np.argsort(-np.linalg.norm(shown, axis=1), kind="stable")]
    most, rest = np.split(shown, [_MOST_NUMBERS // len(time_s)])
    basis = absorbed(sensitivity)
    return np.vstack((most, np.linalg.qr(rest @ basis.T, mode="r") @ basis))


def noise_beside(residual: Array, functions: Array, free: int) -> float:
    """Return the noise beside functions of random amplitude, (n_functions, n_samples).

    With its standard deviation, chi^2 of the residual, (n_samples,), is its degrees of freedom.
    """
    from scipy.optimize import brentq

    _, sizes, directions = np.linalg.svd(functions, full_matrices=False)
    within = (directions @ residual) ** 2
    rest = max(float(residual @ residual - within.sum()), 0.0)

    def excess(log_sd: float) -> float:
        variance = float(np.exp(2 * log_sd))
        return float(np.sum(within / (variance + sizes**2))) + rest / variance - free

    most = 0.5 * float(np.log(residual @ residual / free))
    return float(np.exp(brentq(excess, most - _EFOLDS, most)))


def _shown_of_errors(experiment: Experiment, time_s: Array, parameters: Array) -> Array:
    """Return responses to the errors of a record, (n_directions, n_times).

    Each is a sum of ramps from row to row, whose response is interpolated between lags.
    """
    assert experiment.record is not None
    assert experiment.load_errors is not None
    rows = _thinned(len(experiment.record))
    row_s, errors = experiment.record[rows, 0], experiment.load_errors[:, rows]
    # Nothing is there before the first row, and a step is a steep ramp.
    least_s = _STEEP * float(np.median(np.diff(row_s)))
    row_s = np.insert(row_s, 0, row_s[0] - least_s)
    errors, lasts_s = np.pad(errors, ((0, 0), (1, 0))), np.maximum(np.diff(row_s), least_s)
    slopes = np.diff(errors) / lasts_s
    some_s = time_s[_thinned(len(time_s))]
    longest_s = max(float(some_s[-1] - row_s[0]), float(lasts_s.sum()))
    lags_s = np.append(0.0, np.geomspace(least_s, longest_s, _LAGS))
    phases = (Phase(2 * longest_s, 0.0, 1.0),)
    course = join_phases(phases, deforms=experiment.instrument.deforms)
    network = experiment.searched.network(parameters)
    given = experiment.gripper, network, course, lags_s
    of_ramp = simulated_response(*given)[0]
    began, ended = (
        np.interp(np.subtract.outer(some_s, at_s), lags_s, of_ramp)
        for at_s in (row_s[:-1], row_s[:-1] + lasts_s)
    )
    shown = (began - ended) @ slopes.T
    return np.array([np.interp(time_s, some_s, each) for each in shown.T])


def _thinned(count: int) -> IntArray:
    """Return places of at most so many rows, spread evenly."""
    return np.unique(np.linspace(0, count - 1, min(count, _ROWS_SHOWN)).astype(np.int64))


_MOST_ROUNDS = 5
# Numbers in the functions of errors of a load that have their own; rows and readings that are
# looked at; lags of the response to a ramp; how long a step lasts, over the time from row to row.
_MOST_NUMBERS, _ROWS_SHOWN, _LAGS, _STEEP = 3_000_000, 3000, 1000, 1e-6
# Step of differences, as a share of the largest depth; size of a free function over the noise.
_OF_DEPTH, _FREE_OVER_NOISE = 1e-3, 1e5
# Most e-folds by which noise is smaller beside them.
_EFOLDS = 12.0
# Changes of noise shares and times below this change no confidence limit in its third digit.
_NOISE_SETTLED = 1e-2
# The same of a fit that moves by less, in standard deviations.
_FIT_SETTLED = 0.03


@dataclass(frozen=True)
class TraceFit:
    """The identification of one trace, with its noise model and outliers."""

    problem: TraceProblem
    """The trace without outliers; its residuals are white."""
    found: Fit
    """Its global optimum."""
    noise_model: NoiseModel | None
    """Autocorrelation model of the noise; None if the noise was assumed to be white."""
    outliers: BoolArray
    """True for readings that were left out, (n_samples,)."""
    errors: tuple[float, float] = (0.0, 0.0)
    """Standard deviations of logarithms of the noise model: of its time, and of its walk's odds."""

    def noise_data(self) -> dict[str, float | None] | None:
        """Return the estimated noise model as plain data; None if noise was assumed white."""
        if self.noise_model is None:
            return None
        shares = {"white": self.noise_model.white, **vars(self.noise_model)}
        shares |= {"degrees_of_freedom": self.problem.residuals.freedom}
        outliers = int(np.count_nonzero(self.outliers))
        return {**{name: rounded(number) for name, number in shares.items()}, "outliers": outliers}

    def notes(self) -> list[str]:
        """Describe the estimated noise model in sentences."""
        if self.noise_model is None:
            return []
        noise_model, left_out = self.noise_model, int(np.count_nonzero(self.outliers))
        read = self.problem.residuals.instrument.read.name
        shares = {
            "white": noise_model.white,
            f"correlated over some {noise_model.time_s:.2g} s": noise_model.ar1,
            "1/f": noise_model.flicker,
            "a random walk": noise_model.walk,
            f"that grows with the {read}": noise_model.proportional,
        }
        parts = [
            f"{100 * share:.0f} % {what}"
            for what, share in shares.items()
            if what == "white" or share >= levels.WORTH_SAYING
        ]
        said = (
            f"Noise model: of the variance {', '.join(parts)}; the intervals allow for all of it."
        )
        struck = f"Left out as outliers: {counted(left_out, 'sample')} of {len(self.outliers)}."
        return [said, struck] if left_out else [said]


def fit_least_squares(
    experiments: Sequence[Experiment],
    traces: Sequence[tuple[Array, Array]],
    rngs: Sequence[np.random.Generator],
    progress: ReportProgress = silent,
) -> list[TraceFit]:
    """Fit each of several traces by least squares and, if wanted, estimate the model of its noise.

    Traces of plain noise are fitted together. With a coloured noise model, outliers are removed,
    and the noise is a sum of white, Ornstein-Uhlenbeck and 1/f noise and a random walk. If it grows
    with the rotation, so does a part of the white noise. The effect of the gripper's uncertainty is
    one more component. A trace is its ascending times and readings, (n_samples,), and has
    assumptions and random numbers of its own.
    """

    def find(problems: Sequence[TraceProblem], which: Sequence[int]) -> list[Fit]:
        of_traces = [rngs[trace] for trace in which]
        fits = identify_many(problems, experiments[0].least_squares, of_traces, progress)
        return deepen(problems, fits)

    plain = [trace for trace, experiment in enumerate(experiments) if experiment.plain]
    problems = pose([experiments[trace] for trace in plain], [traces[trace] for trace in plain])
    optima = find(problems, plain) if plain else []
    fits_by_trace = {
        trace: TraceFit(problem, optimum, None, np.zeros(len(traces[trace][0]), dtype=bool))
        for trace, problem, optimum in zip(plain, problems, optima, strict=True)
    }
    for trace, experiment in enumerate(experiments):
        if trace not in fits_by_trace:
            alone = partial(find, which=[trace])
            fits_by_trace[trace] = _fit_in_noise(experiment, *traces[trace], alone)
    return [fits_by_trace[trace] for trace in range(len(traces))]


def _fit_in_noise(
    experiment: Experiment,
    time_s: Array,
    readings: Array,
    find: Callable[[Sequence[TraceProblem]], list[Fit]],
) -> TraceFit:
    """Fit a trace whose noise is not plain, by a function that finds global optima of problems."""
    kept = np.ones(len(time_s), dtype=bool)
    for rounds_left in reversed(range(_MOST_ROUNDS)):
        # Outliers are struck, if the noise may have any, until there are no more.
        plain = experiment.of(time_s[kept], readings[kept])
        (best_fit,) = find([plain])
        best, residuals = np.log(best_fit.parameters), plain.residuals
        growth = growth_left(residuals, best) if experiment.coloured else np.ones(1)
        struck = outliers_of(residuals.left(best) / growth, residuals.trace.rounding)
        if not (experiment.coloured and rounds_left and struck.any()):
            break
        kept[np.flatnonzero(kept)[struck]] = False
    fit = _in_turn(experiment, time_s[kept], plain, best_fit, grows=bool(np.ptp(growth)))
    # Slow deviations now weigh less, so that another basin may be the deepest.
    (other,) = find([fit.problem])
    deeper = np.float32(other.misfit) < np.float32(fit.found.misfit)
    return replace(fit, found=other if deeper else fit.found, outliers=~kept)


def _in_turn(
    experiment: Experiment, time_s: Array, plain: TraceProblem, best_fit: Fit, *, grows: bool
) -> TraceFit:
    """Estimate the noise from the residuals and fit again with it, until the fit converges."""
    readings, nuisance = plain.residuals.trace.readings, experiment.nuisance(time_s)
    fit = TraceFit(plain, best_fit, None, np.zeros(len(time_s), dtype=bool))
    for _ in range(_MOST_ROUNDS):
        before, start = fit, np.log(fit.found.parameters)
        residual, sensitivity = plain.residuals(start)
        of_load = load_functions(experiment, time_s, fit.found.parameters, sensitivity)
        uncertain = gripper_functions(experiment, time_s, fit.found.parameters)
        uncertain = np.vstack((uncertain, of_load))
        if experiment.fit_contact:
            of_contact = contact_function(experiment, time_s, fit.found.parameters)
            free = _FREE_OVER_NOISE * np.linalg.norm(residual) / np.linalg.norm(of_contact)
            uncertain = np.vstack((uncertain, free * of_contact))
        left = fit.problem.residuals.free - len(start)
        noise_sd = experiment.noise_sd or fit.found.misfit * np.sqrt(len(time_s) / left)
        if len(of_load) and experiment.noise_sd is None:
            noise_sd = noise_beside(residual, of_load, left)
        noise_model, growing = None, plain.residuals.response(start) if grows else None
        if experiment.coloured:
            directions = np.vstack((sensitivity, nuisance, uncertain))
            likelihood = NoiseModelLikelihood(time_s, residual, directions, growing)
            noise_model = likelihood.best(near=fit.noise_model)
        condensed = experiment.in_noise(time_s, noise_model, uncertain / noise_sd, growing=growing)
        problem = experiment.of(time_s, readings, condensed=condensed)
        fit = TraceFit(problem, refit(fit.found, problem, start), noise_model, fit.outliers)
        end = np.log(fit.found.parameters)
        slopes = problem.residuals.condensed_responses(end[None])[0, 1:]
        moved = np.linalg.norm((end - start) @ slopes) / noise_sd
        if moved < _FIT_SETTLED and _has_settled(before.noise_model, noise_model):
            break
    if noise_model is None:
        return fit
    freedom = likelihood.freedom(noise_model, sensitivity / noise_sd, nuisance)
    problem = replace(problem, residuals=replace(problem.residuals, freedom=freedom))
    return replace(fit, problem=problem, errors=likelihood.errors(noise_model))


def _has_settled(one: NoiseModel | None, other: NoiseModel | None) -> bool:
    if one is None or other is None:
        return one is other
    names = ("ar1", "flicker", "proportional", "walk")
    shares = sum(abs(getattr(one, name) - getattr(other, name)) for name in names)
    times = min(one.ar1, other.ar1) * abs(np.log(one.time_s / other.time_s))
    return bool(shares + times < _NOISE_SETTLED)
