"""Single numbers that a trace may determine: parameters, and combinations of them.

All are positive, and known through their logarithm as a function of the
logarithms of the parameters.
"""

from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from biogrip.arrays import Array
from biogrip.experiment.sample import Parameter, SampleModel


@dataclass(frozen=True)
class Quantity:
    """A combination of a model's parameters.

    Parameters
    ----------
    label, symbol, unit
        In tables; as mathtext; in SI.
    members
        Indices of the parameters that it is made of.
    sign : (n_members,)
        Powers, of a product (times of relaxation are quotients).
    form
        ``"product"`` of powers; ``"sum"``; ``"series"``, one over the sum of
        reciprocals.
    branches
        Spring and damper, by index, of branches that have to relax within the
        experiment for the quantity to mean anything: the damper of a branch too
        weak and slow to be seen could be of any size.
    """

    label: str
    symbol: str
    unit: str
    members: tuple[int, ...]
    form: str = "product"
    sign: tuple[int, ...] = (1,)
    branches: tuple[tuple[int, int], ...] = ()

    def log(self, log_parameters: Array) -> float:
        """Logarithm of the quantity, from log-parameters of shape (n_parameters,)."""
        x = log_parameters[list(self.members)]
        if self.form == "product":
            return float(np.dot(self.sign, x))
        return float(self._sense * np.logaddexp.reduce(self._sense * x))

    def gradient(self, log_parameters: Array) -> Array:
        """Its derivatives by the log-parameters, (n_parameters,)."""
        x = log_parameters[list(self.members)]
        slope = np.zeros_like(log_parameters)
        if self.form == "product":
            slope[list(self.members)] = self.sign
        else:
            share = np.exp(self._sense * x - np.logaddexp.reduce(self._sense * x))
            slope[list(self.members)] = share
        return slope

    def moved(self, log_parameters: Array, target: float) -> Array:
        """Log-parameters with all members moved alike, until the quantity has a given logarithm."""
        by = target - self.log(log_parameters)
        moved = log_parameters.copy()
        shares = np.divide(self.sign, len(self.members)) if self.form == "product" else 1.0
        moved[list(self.members)] += by * shares
        return moved

    def range(self, low: Array, high: Array) -> tuple[float, float]:
        """Logarithms between which it can lie if the log-parameters lie within bounds."""
        if self.form == "product":
            first = [
                low[i] if s > 0 else -high[i] for i, s in zip(self.members, self.sign, strict=True)
            ]
            last = [
                high[i] if s > 0 else -low[i] for i, s in zip(self.members, self.sign, strict=True)
            ]
            return float(sum(first)), float(sum(last))
        return self.log(low), self.log(high)

    @property
    def _sense(self) -> int:
        return 1 if self.form == "sum" else -1


def parameters_and_sum(model: SampleModel) -> list[Quantity]:
    """Every parameter, and the sum of those that the model calls exchangeable."""
    single = [
        Quantity(p.name, p.symbol, p.unit, (index,)) for index, p in enumerate(model.parameters)
    ]
    together = tuple(
        index for index, p in enumerate(model.parameters) if p.name in model.exchangeable
    )
    if len(together) < 2:
        return single
    places = {p.name: index for index, p in enumerate(model.parameters)}
    branches = tuple(
        (places[spring], places[damper])
        for spring, damper in model.branches
        if spring in places and damper in places
    )
    return [*single, replace(_sum(model, together), branches=branches)]


def combinations_of(model: SampleModel, members: list[int]) -> list[Quantity]:
    """What two parameters may determine together where neither is determined alone.

    Of two springs or two dampers the sum (side by side) and the series
    combination; of a damper and a spring their time c/k.
    """
    found = []
    for a, b in combinations(members, 2):
        first, second = model.parameters[a], model.parameters[b]
        if first.kind == second.kind:
            found += [_sum(model, (a, b)), _series(model, (a, b))]
        else:
            damper, spring = (a, b) if first.kind == "damping" else (b, a)
            found.append(_time(model, damper, spring))
    return found


def _sum(model: SampleModel, members: tuple[int, ...]) -> Quantity:
    chosen = _chosen(model, members)
    label, symbol = (" + ".join(names) for names in zip(*_names(chosen), strict=True))
    return Quantity(label, symbol, chosen[0].unit, members, "sum")


def _series(model: SampleModel, members: tuple[int, ...]) -> Quantity:
    chosen = _chosen(model, members)
    label, symbol = zip(*_names(chosen), strict=True)
    text = f"1/({' + '.join(f'1/{name}' for name in label)})"
    shown = f"$1/($ {' + '.join(f'1/{name}' for name in symbol)} $)$"
    return Quantity(text, shown, chosen[0].unit, members, "series")


def _time(model: SampleModel, damper: int, spring: int) -> Quantity:
    (label, symbol), (under, under_symbol) = _names(_chosen(model, (damper, spring)))
    return Quantity(
        f"{label}/{under}", f"{symbol}/{under_symbol}", "s", (damper, spring), sign=(1, -1)
    )


def _chosen(model: SampleModel, members: tuple[int, ...]) -> list[Parameter]:
    return [model.parameters[index] for index in members]


def _names(parameters: list[Parameter]) -> list[tuple[str, str]]:
    return [(p.name, p.symbol) for p in parameters]
