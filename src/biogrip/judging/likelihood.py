"""Quantities that a trace may determine, its likelihood, and its Fisher information.

Quantities are parameters, and combinations of parameters. All are positive, and are represented by
their logarithm as a function of the log-parameters.

The increase of chi^2 is that of the sum of squares over its minimum, in units of the noise's
variance. A quantity has a confidence limit where the increase equals a threshold: a quantile of
chi-squared with one degree of freedom if the noise is known, of F if it is estimated [1]_. It has
none unless the increase at the end of the search range reaches the quantile at `CERTAIN`.

Fisher information gives the Cramér-Rao bounds of the parameters of a trace [2]_, [3]_.

References
----------
.. [1] D. M. Bates and D. G. Watts, Nonlinear Regression Analysis, Wiley, 1988: profiles.
.. [2] H. Cramér, Mathematical Methods of Statistics, Princeton University Press, 1946.
.. [3] C. R. Rao, Bulletin of the Calcutta Mathematical Society 37 (1945).
.. [4] H. White, Econometrica 48 (1980), 817-838: noise that changes along the trace.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import combinations, pairwise
from math import inf

import numpy as np

import biogrip.levels as levels
from biogrip.arrays import Array, BoolArray
from biogrip.fit.experiment import Experiment
from biogrip.fit.problem import TraceProblem
from biogrip.physics.response import linear_responses
from biogrip.physics.sample_model import SampleModel

# Slopes of hinges: a relaxation time of twice the experiment increases chi^2 by some 50, and one
# a hundredth above that of the next branch by 1.
_SLOPE_WITHIN, _SLOPE_IN_ORDER = 10.0, 100.0
# E-folds from an end of a range at which a parameter counts as at it.
_AT_END_OF_MEMBER = 1e-6

PROVIDED = "provided that the branch, k and c in series, relaxes within the experiment"
"""Condition of a sum of dampers, in the sentences of tables and pages."""


@dataclass(frozen=True)
class BranchPenalty:
    """A penalty residual that is zero while a branch relaxes early enough."""

    branch: tuple[int, int]
    """Indices of its spring and damper."""
    before: tuple[int, int] | None = None
    """Those of the branch that must relax later; None: this relaxes within the experiment."""
    power: int = 1
    """`SampleModel.branch_power`: 0 for springpots, in the order of their exponents."""

    @property
    def stiffness(self) -> float:
        """Slope of the residual, in standard deviations per e-fold."""
        return _SLOPE_WITHIN if self.before is None else _SLOPE_IN_ORDER

    def form(self, n_parameters: int) -> Array:
        """Return the coefficients, (n_parameters,), of its log (relative) relaxation time."""
        coefficients = np.zeros(n_parameters)
        for branch, sign in ((self.branch, 1.0), (self.before, -1.0)):
            if branch is not None:
                spring, damper = branch
                coefficients[damper], coefficients[spring] = sign, -sign * self.power
        return coefficients

    def allowed(self, longest_s: float) -> float:
        """Return the largest such log time without penalty, for the length of an experiment."""
        return float(np.log(longest_s)) if self.before is None else 0.0


@dataclass(frozen=True)
class Quantity:
    """A parameter of a model, or a combination of its parameters."""

    label: str
    """Name in tables."""
    symbol: str
    """Name as mathtext."""
    unit: str
    """SI unit."""
    members: tuple[int, ...]
    """Indices of the parameters in it."""
    sense: int = 0
    """Power of the members in a sum: 1; -1 in series; 0 in a product of powers."""
    sign: tuple[int, ...] = (1,)
    """Powers in a product (relaxation times are quotients), (n_members,)."""
    penalties: tuple[BranchPenalty, ...] = ()
    """Conditions. In a sum the damper of a branch too weak and slow to be seen could have any size;
    of several branches, names could be exchanged."""

    @property
    def provided(self) -> str | None:
        """Assumption about the sample, in words, if there is one."""
        count = sum(penalty.before is None for penalty in self.penalties)
        if not count:
            return None
        return f"the {'branch relaxes' if count == 1 else 'branches relax'} within the experiment"

    def log(self, log_parameters: Array) -> float:
        """Return its logarithm, from log-parameters of shape (n_parameters,)."""
        x = log_parameters[list(self.members)]
        if not self.sense:
            return float(np.sum(x * np.array(self.sign)))
        return float(self.sense * np.logaddexp.reduce(self.sense * x))

    def gradient(self, log_parameters: Array) -> Array:
        """Return the derivatives of its logarithm by the log-parameters, (n_parameters,)."""
        slope = np.zeros_like(log_parameters)
        if not self.sense:
            slope[list(self.members)] = self.sign
        else:
            of_sum = self.sense * log_parameters[list(self.members)]
            slope[list(self.members)] = np.exp(of_sum - np.logaddexp.reduce(of_sum))
        return slope

    def at_end(self, log_parameters: Array, low: Array, high: Array, above: BoolArray) -> BoolArray:
        """Tell where, (n,), a ratio would be further from its best value but for a range's end.

        Log-parameters are (n, n_parameters), their ranges' ends (n_parameters,); the ratio is above
        its best value or below, (n,).
        """
        members = list(self.members)
        rises = above[:, None] == (np.array(self.sign) > 0)
        ends = np.where(rises, high[members], low[members])
        at_end = np.abs(log_parameters[:, members] - ends) < _AT_END_OF_MEMBER
        return np.any(at_end, axis=1) & (len(self.sign) > 1)

    def range(self, low: Array, high: Array) -> tuple[float, float]:
        """Return its lowest and highest logarithm for log-parameters within bounds.

        The upper end of a sum, and the lower end of a series combination, is what one member can
        reach whatever the others are: beyond it, the ends of the ranges would bound the quantity.
        """
        members = list(self.members)
        if not self.sense:
            ends = np.multiply(self.sign, (low[members], high[members]))
            return float(np.sum(np.min(ends, axis=0))), float(np.sum(np.max(ends, axis=0)))
        if self.sense > 0:
            return self.log(low), float(np.max(high[members]))
        return float(np.min(low[members])), self.log(high)


def parameters_and_sum(model: SampleModel) -> list[Quantity]:
    """Return every parameter, and the sum of those that the model calls exchangeable."""
    ordered = _ordered(model)
    single = [
        Quantity(p.name, p.symbol, p.unit, (index,), penalties=ordered)
        for index, p in enumerate(model.parameters)
    ]
    exchangeable = tuple(
        index for index, p in enumerate(model.parameters) if p.name in model.exchangeable
    )
    if len(exchangeable) < 2:
        return single
    within = tuple(BranchPenalty(branch) for branch in model.free_branches)
    return [*single, replace(_combined(model, exchangeable), penalties=within)]


def characteristic_times(model: SampleModel) -> list[Quantity]:
    """Return the relaxation or retardation time tau = c/k of each element with a spring and damper.

    These are Maxwell branches and Kelvin-Voigt elements of which both parameters are searched. A
    spring and a damper that are parallel to a branch have no time of their own.
    """
    times = []
    for damper, (letter, *index) in enumerate(name.split("_") for name in model.names):
        spring = "_".join(["k", *index])
        parallel = index == ["p"] and model.name != "kelvin_voigt"
        if letter != "c" or spring not in model.names or parallel or model.power_law:
            continue
        pair = damper, model.names.index(spring)
        of_branch = "".join(f"_{{{digit}}}" for digit in index)
        label, symbol = "_".join(["tau", *index]), rf"$\tau{of_branch}$"
        times.append(Quantity(label, symbol, "s", pair, sign=(1, -1), penalties=_ordered(model)))
    return times


def find_combinations(model: SampleModel, members: list[int]) -> list[Quantity]:
    """Return combinations of two parameters that may be determined if neither is alone.

    Two springs or two dampers have their sum and their series combination, a damper and a spring
    their relaxation time c/k. A springpot has none, as its exponent decides what it trades off
    against.
    """
    combined = []
    ordered = _ordered(model)
    for a, b in combinations(members, 2):
        first, second = model.parameters[a], model.parameters[b]
        if not {first.kind, second.kind} <= {"stiffness", "damping"}:
            continue
        if first.kind == second.kind:
            combined += [_combined(model, (a, b)), _combined(model, (a, b), -1)]
        else:
            c, k = (first, second) if first.kind == "damping" else (second, first)
            pair = (a, b) if c is first else (b, a)
            label, symbol = f"{c.name}/{k.name}", f"{c.symbol}/{k.symbol}"
            combined.append(Quantity(label, symbol, "s", pair, sign=(1, -1)))
    return [replace(quantity, penalties=ordered) for quantity in combined]


def _ordered(model: SampleModel) -> tuple[BranchPenalty, ...]:
    pairs = pairwise(model.free_branches)
    return tuple(BranchPenalty(branch, later, model.branch_power) for branch, later in pairs)


def _combined(model: SampleModel, members: tuple[int, ...], sense: int = 1) -> Quantity:
    """Return the sum of parameters, or with a sense of -1 what they are in series."""
    chosen = [model.parameters[index] for index in members]
    inverse = "1/" if sense < 0 else ""
    label, symbol = (
        " + ".join(f"{inverse}{name}" for name in names)
        for names in ([p.name for p in chosen], [p.symbol for p in chosen])
    )
    if sense < 0:
        label, symbol = f"1/({label})", f"$1/($ {symbol} $)$"
    return Quantity(label, symbol, chosen[0].unit, members, sense)


def quantity_value(quantity: str, parameters: Mapping[str, float]) -> float | None:
    """Return the value of a parameter or a sum by its name, None if a parameter is not given."""
    names = quantity.split(" + ")
    return sum(parameters[name] for name in names) if set(names) <= set(parameters) else None


# Error of sums of squares, as a share of those of the largest reading or response.
_ERROR_OF_SUMS = 1e-12


@dataclass(frozen=True)
class Likelihood:
    """Optimum, noise and thresholds that define the profile likelihoods of one trace."""

    problem: TraceProblem
    """The trace and the model."""
    best: Array
    """Log-parameters of the global optimum, (n_parameters,)."""
    misfit: float
    """Misfit there."""
    noise_sd: float
    """Standard deviation of the noise, known or estimated from the residual."""
    threshold: float
    """Increase of chi^2 at the limits of an interval: a single limit holds with more confidence."""
    certainty: float
    """Increase that a profile must reach at an end of the range to have a limit on that side."""
    freedom: float = inf
    """Degrees of freedom of the noise's estimated variance; infinite if the noise is known."""
    confidence: float = 0.95
    """Of the limits."""
    independent: float = inf
    """How many residuals count as independent, if what the fit leaves is misfit."""

    def as_misfit(self, independent: float, freedom: float) -> "Likelihood":
        """Return the likelihood if what the fit leaves is misfit, not noise.

        All residuals count as so many independent ones, and their variance has this freedom: see
        `biogrip.judging.whiteness.as_correlated`.
        """
        noise_sd = self.misfit * math.sqrt(self.problem.residuals.samples / independent)
        threshold, _ = find_thresholds(self.confidence, freedom)
        # What few degrees of freedom say of one misfit in a thousand is not known.
        known, certain = find_thresholds(self.confidence, inf)
        return replace(
            self,
            noise_sd=noise_sd,
            threshold=threshold,
            certainty=threshold * certain / known,
            freedom=freedom,
            independent=independent,
        )

    def increase(self, misfit: float) -> float:
        """Return the increase of chi^2 over the optimum."""
        excess = misfit**2 - self.misfit**2
        return float(self.problem.residuals.samples * excess / self.noise_sd**2)

    def deviation(self, quantity: Quantity) -> float:
        """Return the first-order standard deviation of a quantity's logarithm.

        Every parameter has a prior of one e-fold, beyond which the linear approximation fails.
        Unlike in a `least_sd`, no parameter is left out for want of information.
        """
        rows = self.problem.residuals.condensed_responses(self.best[None])[0]
        relative = rows[1:] / self.noise_sd
        slope = quantity.gradient(self.best)
        information = relative @ relative.T + np.eye(len(slope))
        # Without noise the trace may outweigh the prior by more than numbers have digits.
        solved = np.linalg.lstsq(information, slope)[0]
        return float(np.sqrt(np.maximum(slope @ solved, 0.0)))


def make_likelihood(
    problem: TraceProblem,
    best: Array,
    misfit: float,
    *,
    confidence: float,
    noise_sd: float | None = None,
) -> Likelihood:
    """Compute noise, by default from the misfit, and thresholds for the profiles of a trace."""
    freedom = inf
    if noise_sd is None:
        left = problem.residuals.free - len(best)
        noise_sd = misfit * float(np.sqrt(problem.residuals.samples / left))
        freedom = float(min(left, problem.residuals.freedom))
    threshold, certainty = find_thresholds(confidence, freedom)
    return Likelihood(problem, best, misfit, noise_sd, threshold, certainty, freedom, confidence)


def check_rows(likelihood: Likelihood) -> None:
    """Raise an `ArithmeticError` if rows, as profiles see them, have not the readings' misfit."""
    residuals, best = likelihood.problem.residuals, likelihood.best
    of_rows = float(residuals.misfit(np.exp(best)[None])[0])
    of_readings = float(np.sqrt(np.mean(residuals.left(best) ** 2)))
    # A spring beside an offset may be as stiff as its range allows.
    both = residuals.trace.readings, residuals.response(best)
    largest = max(float(np.max(np.abs(readings))) for readings in both)
    rounding = _ERROR_OF_SUMS * residuals.samples * (largest / likelihood.noise_sd) ** 2
    apart = likelihood.increase(of_rows) - likelihood.increase(of_readings)
    if abs(apart) > levels.MISSED + rounding:
        text = f"rows with a misfit of {of_rows:.6g} stand for readings with {of_readings:.6g}"
        raise ArithmeticError(text)


def find_thresholds(confidence: float, freedom: float) -> tuple[float, float]:
    """Return increases of chi^2 at limits and at `CERTAIN`: see `increase_at`."""
    return increase_at(confidence, freedom), increase_at(levels.CERTAIN, freedom)


def increase_at(confidence: float, freedom: float, told: int = 1) -> float:
    """Return a quantile of chi-squared of what is told, or as many times one of F(told, freedom).

    It is of chi-squared if the freedom, with which the noise is known, is infinite.
    """
    # Imported here: what only names quantities loads no SciPy.
    from scipy.special import chdtri, fdtri

    if freedom == inf:
        return float(chdtri(told, 1 - confidence))
    return told * float(fdtri(told, freedom, confidence))


def compute_fall(samples: int, before: float, after: float, noise_sd: float | None = None) -> float:
    """Compute the decrease of chi^2, twice the increase of log-likelihood, between RMS residuals.

    If the standard deviation of the noise is not known, each fit's misfit estimates it; no noise is
    less than what the better fit leaves.
    """
    if noise_sd is not None:
        return samples * (before**2 - after**2) / max(noise_sd, after) ** 2
    return 2 * samples * float(np.log(before / after))


# Members with a smaller share in a sum are neglected, whatever their uncertainty; so is a smaller
# part of a gradient, scaled by information, along what the response does not show.
_NEGLIGIBLE = 1e-2
# Share of the largest information that is rounding.
_NO_INFORMATION = 1e-12


def covariance(
    sensitivity: Array, noise_sd: float | Array, gradients: Array | None = None
) -> Array:
    """Compute the first-order covariance of quantities estimated by least squares.

    With the same Gaussian noise everywhere, it is the inverse of the Fisher information J J^T /
    sigma^2: the Cramér-Rao bound, which no unbiased estimator undercuts. With noise that changes
    along the trace, it is that of unweighted least squares [4]_, A J diag(sigma^2) J^T A with A =
    (J J^T)^-1, and no longer a bound. A parameter whose standard deviation exceeds one e-fold even
    with all others known carries no information, and is fixed for the others' covariance: near zero
    on a logarithmic scale, the linear approximation fails.

    J is d response / d log parameter, (n_parameters, n_samples), sigma a number or (n_samples,).
    Gradients are d quantity / d log parameter, (n_quantities, n_parameters), by default of the
    log-parameters. The covariance, (n_quantities, n_quantities), is infinite on the diagonal for
    what the response does not show, and zero without noise.
    """
    slopes = np.eye(len(sensitivity)) if gradients is None else gradients
    sigma = np.broadcast_to(noise_sd, sensitivity.shape[1])
    scale = float(np.sqrt(np.mean(sigma**2)))
    if not scale:
        return np.zeros((len(slopes), len(slopes)))
    relative = sensitivity / scale
    informed = np.sum(relative**2, axis=1) > 1
    unknown = np.any(np.abs(slopes[:, ~informed]) > _NEGLIGIBLE, axis=1)
    unknown |= ~np.any(np.abs(slopes) > _NEGLIGIBLE, axis=1)
    j = relative[informed]
    # Rows of length one, for parameters may differ by decades in their information.
    length = np.sqrt(np.sum(j**2, axis=1))
    j = j / length[:, None]
    within = slopes[:, informed] / length
    sizes, directions = np.linalg.eigh(j @ j.T)
    none = sizes <= _NO_INFORMATION * sizes.max(initial=0.0)
    parts = within @ directions
    longest = np.sqrt(np.sum(parts**2, axis=1, keepdims=True))
    unknown |= np.any(np.abs(parts[:, none]) > _NEGLIGIBLE * longest, axis=1)
    inverse = parts[:, ~none] / sizes[~none] @ directions[:, ~none].T
    scattered = inverse @ (j * (sigma / scale))
    matrix: Array = scattered @ scattered.T
    matrix[unknown] = matrix[:, unknown] = 0.0
    matrix[unknown, unknown] = inf
    return matrix


def least_sd(
    sensitivity: Array, noise_sd: float | Array, log_parameters: Array, q: Quantity
) -> float:
    """Return the first-order standard deviation of a quantity's logarithm, by `covariance`."""
    gradient = q.gradient(log_parameters)
    return float(np.sqrt(covariance(sensitivity, noise_sd, gradient[None])[0, 0]))


def bounds_percent(
    problem: Experiment, noise_sd: Array, parameters: Mapping[str, float], time_s: Array
) -> list[tuple[Quantity, float]]:
    """Compute the Cramér-Rao bounds of all quantities that an experiment identifies.

    They are 100 times the standard deviation of a quantity's logarithm, NaN without noise, at
    parameters in SI units. That of the noise, and sampling times, are (n_samples,); a parameter of
    zero is undetermined.
    """
    model = problem.searched
    quantities = parameters_and_sum(model)
    if not np.any(noise_sd):
        return [(q, math.nan) for q in quantities]
    values = np.array([parameters[name] for name in model.names])
    given = problem.gripper, model, problem.torque, time_s, values[None]
    sensitivity = linear_responses(*given)[0, 1:]
    with np.errstate(divide="ignore"):
        logarithms = np.log(values)
    return [(q, 100 * least_sd(sensitivity, noise_sd, logarithms, q)) for q in quantities]
