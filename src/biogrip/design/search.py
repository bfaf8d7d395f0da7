"""Global search for the best torque over families of torques, each with its best sampling.

References
----------
.. [1] R. Storn and K. Price, Differential evolution, Journal of Global Optimization 11 (1997),
   341-359.
"""

from collections.abc import Callable

import numpy as np

from biogrip.arrays import Array
from biogrip.design.experiment import DesignInputs
from biogrip.design.rating import LOST, Rater, Torque
from biogrip.design.shapes import SHAPES, Shape
from biogrip.design.waveform import Waveform
from biogrip.errors import BiogripError

# Torques in a round; a power of two, for the first are from a Sobol sequence.
_CROWD = 128


def best_torques(
    inputs: DesignInputs,
    tried: int,
    rng: np.random.Generator,
    progress: Callable[[int, float], None],
) -> list[Torque]:
    """Search for the torques with the lowest typical relative bounds; the best comes first.

    About as many are tried as asked for, equally many of each shape. The callback gets the number
    tried, and the lowest typical relative bound.

    Raises
    ------
    BiogripError
        If no torque was found that keeps contact.
    """
    from scipy.optimize import differential_evolution

    rounds = max(1, round(tried / len(inputs.shapes) / _CROWD))
    count, lowest = 0, np.inf
    rater = Rater(inputs)
    found: list[tuple[float, Waveform]] = []
    for name, shape in SHAPES.items():
        if name not in inputs.shapes:
            continue

        def objective(shares: Array, shape: Shape = shape) -> float:
            nonlocal count, lowest
            value = rater.rate(shape.waveform(shares, inputs.limits)).logarithm
            count, lowest = count + 1, min(lowest, value)
            if lowest < LOST:
                progress(count, float(np.exp(lowest)))
            return value

        last = differential_evolution(
            objective,
            [(0.0, 1.0)] * shape.shares,
            maxiter=rounds - 1,
            popsize=_CROWD / shape.shares,
            init="sobol",
            tol=1e-3,
            polish=False,
            rng=rng,
        )
        found += [
            (float(value), shape.waveform(shares, inputs.limits))
            for value, shares in zip(last.population_energies, last.population, strict=True)
            if value < LOST
        ]
    if not found:
        raise BiogripError(
            f"design: with none of {count} torques do the jaws press throughout; allowed are more "
            "(`candidates`), or samples that are less different."
        )
    found.sort(key=lambda each: each[0])
    return [rater.torque(waveform) for _, waveform in found]
