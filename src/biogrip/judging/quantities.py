"""Quantities that a trace may determine: parameters, and combinations of parameters.

All are positive, and are represented by their logarithm as a function of the
log-parameters.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import combinations, pairwise

import numpy as np

from biogrip.arrays import Array, BoolArray
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
    return [*single, replace(_sum_of(model, exchangeable), penalties=within)]


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
        pair, of_branch = (
            (damper, model.names.index(spring)),
            "".join(f"_{{{digit}}}" for digit in index),
        )
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
            combined += [_sum_of(model, (a, b)), _series_combination(model, (a, b))]
        else:
            pair = (a, b) if first.kind == "damping" else (b, a)
            names, symbols, _ = _names_of(model, pair)
            combined.append(Quantity("/".join(names), "/".join(symbols), "s", pair, sign=(1, -1)))
    return [replace(quantity, penalties=ordered) for quantity in combined]


def _ordered(model: SampleModel) -> tuple[BranchPenalty, ...]:
    pairs = pairwise(model.free_branches)
    return tuple(BranchPenalty(branch, later, model.branch_power) for branch, later in pairs)


def _sum_of(model: SampleModel, members: tuple[int, ...]) -> Quantity:
    names, symbols, unit = _names_of(model, members)
    return Quantity(" + ".join(names), " + ".join(symbols), unit, members, 1)


def _series_combination(model: SampleModel, members: tuple[int, ...]) -> Quantity:
    names, symbols, unit = _names_of(model, members)
    label, symbol = (" + ".join(f"1/{text}" for text in texts) for texts in (names, symbols))
    return Quantity(f"1/({label})", f"$1/($ {symbol} $)$", unit, members, -1)


def _names_of(model: SampleModel, members: tuple[int, ...]) -> tuple[list[str], list[str], str]:
    """Return the names and symbols of parameters, and the unit of the first."""
    chosen = [model.parameters[index] for index in members]
    return [p.name for p in chosen], [p.symbol for p in chosen], chosen[0].unit


def quantity_value(quantity: str, parameters: Mapping[str, float]) -> float | None:
    """Return the value of a parameter or a sum by its name, None if a parameter is not given."""
    names = quantity.split(" + ")
    return sum(parameters[name] for name in names) if set(names) <= set(parameters) else None
