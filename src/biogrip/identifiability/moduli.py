"""Moduli over frequency as quantities that a trace may determine, with limits by profiles.

Fits whose parameters differ may have the same moduli where the experiment sees the sample.
Rheologists compare these [1]_; their profile likelihoods say how far a trace determines them,
whatever the parameters [2]_.

References
----------
.. [1] J. D. Ferry, Viscoelastic Properties of Polymers, 3rd ed., Wiley, 1980.
.. [2] C. Kreutz, A. Raue and J. Timmer, Likelihood based observability analysis and confidence
   intervals for predictions of dynamic models, BMC Systems Biology 6 (2012), 120.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from biogrip.arrays import Array, BoolArray, IntArray
from biogrip.experiment.network import complex_modulus
from biogrip.experiment.sample_model import SampleModel
from biogrip.identifiability.constrained_fits import ConstrainedFits
from biogrip.identifiability.likelihood import Likelihood
from biogrip.identifiability.profiles import Profile, compute_profiles
from biogrip.identifiability.quantities import Quantity
from biogrip.identify.levenberg_marquardt import Normal
from biogrip.identify.local_fits import FAIR

STORAGE, LOSS = "storage", "loss"
"""The real and the imaginary part of the complex modulus, G' and G''."""

# Stiffness in standard deviations of the quantity, of which one becomes sqrt(1 + 1/30^2).
_STIFF = 30.0
_COMPLEX_STEP = 1e-30
# Logarithms of what is no number on any instrument; keeps a vanishing modulus finite.
_LEAST = 1e-100


@dataclass(frozen=True, kw_only=True)
class Modulus(Quantity):
    """A storage or a loss modulus of a model at a frequency."""

    model: SampleModel
    """Its parameters are the log-parameters of fits."""
    part: str
    """`STORAGE` or `LOSS`."""
    omega: float
    """Angular frequency in rad/s."""

    def logs(self, log_parameters: Array) -> Array:
        """Return its logarithms, (n,), from log-parameters of shape (n, n_parameters)."""
        return _logs([self], np.zeros(len(log_parameters), dtype=np.int64), log_parameters)

    def log(self, log_parameters: Array) -> float:
        """Return its logarithm, from log-parameters of shape (n_parameters,)."""
        return float(self.logs(log_parameters[None])[0])

    def gradient(self, log_parameters: Array) -> Array:
        """Return the derivatives of its logarithm by the log-parameters, (n_parameters,)."""
        return _gradients([self], np.zeros(1, dtype=np.int64), log_parameters[None])[0]

    def range(self, low: Array, high: Array) -> tuple[float, float]:
        """Return the lowest and highest logarithm that corners of the search range have."""
        found = self.logs(np.array(list(product(*zip(low, high, strict=True)))))
        return float(np.min(found)), float(np.max(found))


def _logs(moduli: Sequence[Modulus], which: IntArray, x: Array) -> Array:
    """Return the logarithm of one modulus of each point, (n,), from points (n, n_parameters)."""
    return np.log(np.maximum(_values(moduli, which, np.exp(x)), _LEAST))


def _gradients(moduli: Sequence[Modulus], which: IntArray, x: Array) -> Array:
    """Return the derivatives of these logarithms by the log-parameters, (n, n_parameters)."""
    count = x.shape[1]
    shifted = np.exp(x[:, None] + 1j * _COMPLEX_STEP * np.eye(count)).reshape(-1, count)
    values = _values(moduli, np.repeat(which, count), shifted).reshape(-1, count)
    return np.imag(values) / _COMPLEX_STEP / np.maximum(np.real(values), _LEAST)


def _values(moduli: Sequence[Modulus], which: IntArray, parameters: Array) -> Array:
    omega = np.array([each.omega for each in moduli])[which]
    is_loss = np.array([each.part == LOSS for each in moduli])[which]
    storage, loss = complex_modulus(moduli[0].model.network(parameters), omega[:, None])
    return np.where(is_loss, loss[:, 0], storage[:, 0])


class Springs:
    """Penalties that pull a quantity of each fit to a value, as stiff springs.

    Where they come to rest, chi^2 is the lowest for the value that the quantity has there, which
    is close to the one that was aimed at.

    Parameters
    ----------
    moduli
        Quantities of one model.
    which, targets, weights : (n,)
        Index of the quantity of each fit, the logarithm that it is pulled to, and one over the
        standard deviation of the penalty.
    """

    def __init__(
        self, moduli: Sequence[Modulus], which: IntArray, targets: Array, weights: Array
    ) -> None:
        self._moduli, self._which, self._targets, self._weights = moduli, which, targets, weights

    def started(self, x: Array) -> Array:
        """Return the points: nothing is held exactly."""
        return x

    def added(self, normal: Normal, x: Array, fit: IntArray) -> Normal:
        """Return the normal equations with the penalties."""
        weights, which = self._weights[fit], self._which[fit]
        residuals = weights * (_logs(self._moduli, which, x) - self._targets[fit])
        slopes = weights[:, None] * _gradients(self._moduli, which, x)
        return replace(
            normal,
            square_sum=normal.square_sum + residuals**2,
            gradient=normal.gradient + residuals[:, None] * slopes,
            information=normal.information + slopes[:, :, None] * slopes[:, None, :],
        )

    def price(self, x: Array) -> Array:
        """Return the penalties, (n,)."""
        return (self._weights * (_logs(self._moduli, self._which, x) - self._targets)) ** 2

    def eliminated(self, normal: Normal, x: Array, fit: IntArray) -> tuple[Normal, BoolArray]:
        """Eliminate nothing."""
        return normal, np.zeros(x.shape, dtype=bool)

    def restored(self, x: Array, fit: IntArray, eliminated: BoolArray) -> Array:
        """Return the points."""
        return x


class ModulusFits(ConstrainedFits):
    """Fits in which moduli are held by springs: none of a model's parameters can be eliminated.

    A modulus may hardly change with an element that others outweigh. Basins are therefore the fits
    with each parameter at either end of its range, as far as the trace does not exclude them.
    """

    def __init__(self, likelihoods: Sequence[Likelihood], quantities: Sequence[Quantity]) -> None:
        super().__init__(likelihoods, quantities)
        n_parameters = self.best.shape[1]
        single = [Quantity("", "", "", (index,)) for index in range(n_parameters)]
        ends = ConstrainedFits(likelihoods, single)
        profile = np.arange(len(likelihoods) * n_parameters)
        found = []
        for side in ends.ranges():
            increases, x = ends.at(profile, side, ends.best, FAIR)
            found.append(np.where((increases < ends.certainty)[:, None], x, ends.best))
        by_trace = np.stack(found).reshape(2, len(likelihoods), n_parameters, -1)
        self.basins = np.concatenate(by_trace.swapaxes(1, 2))

    def constraint(
        self, trace: IntArray, which: IntArray, targets: Array, low: Array, high: Array
    ) -> Springs:
        """Return springs that are stiff beside what the trace says of the quantity."""
        deviations = self.deviations().reshape(len(self.likelihoods), -1)[trace, which]
        weights = _STIFF / (deviations * np.sqrt(self.ratio[trace]))
        moduli = [quantity for quantity in self.quantities if isinstance(quantity, Modulus)]
        return Springs(moduli, which, targets, weights)


def moduli_at(model: SampleModel, omega: Array) -> list[Modulus]:
    """Return storage and loss moduli at angular frequencies, one after the other."""
    members = tuple(range(len(model.parameters)))
    return [
        Modulus(
            f"{part} modulus at {each:.3g} rad/s",
            f"${symbol}$",
            model.stiffness_unit,
            members,
            model=model,
            part=part,
            omega=float(each),
        )
        for each in omega
        for part, symbol in ((STORAGE, "G'"), (LOSS, "G''"))
    ]


def profile_moduli(likelihood: Likelihood, moduli: Sequence[Modulus]) -> list[Profile]:
    """Compute the profile likelihoods of moduli, and their confidence limits."""
    return compute_profiles([likelihood], moduli, smooth=False, kind=ModulusFits)[0]
