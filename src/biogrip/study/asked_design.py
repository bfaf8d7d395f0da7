"""Inputs of an experimental design, from the `design` block of a case."""

from typing import Any

import numpy as np

from biogrip.arrays import Array
from biogrip.design.criteria import Criterion
from biogrip.design.experiment import Wanted
from biogrip.design.settings import DesignSettings
from biogrip.design.told import Earlier
from biogrip.design.waveform import Limits
from biogrip.errors import BiogripError
from biogrip.instrument.actuator import torque
from biogrip.study.study import Case


def wanted_of(case: Case, earlier: Earlier | None = None) -> Wanted:
    """Return the inputs of an experimental design for a case.

    Parameters
    ----------
    case
        A case that has a block `design`.
    earlier
        Results of earlier traces; their posterior samples then replace the plausible parameters.

    Raises
    ------
    BiogripError
        If a parameter is zero, since design works with logarithms of parameters.
    """
    asked = case.block.design
    assert asked is not None
    model = case.problem.searched
    slots = round(asked.unit_s * asked.fastest_Hz)
    return Wanted(
        gripper=case.gripper,
        model=model,
        parameters=earlier.parameters if earlier else plausible(case, asked),
        noise_rad=asked.noise_rad,
        samples=asked.samples,
        fastest_Hz=asked.fastest_Hz,
        limits=Limits(
            asked.longest_s, slots / asked.fastest_Hz, asked.most_steps, 1 / asked.fastest_Hz
        ),
        shapes=asked.shapes,
        largest_Nm=_largest(case, asked),
        stroke_rad=case.stroke_rad,
        criterion=Criterion(
            asked.criterion,
            asked.over,
            tuple(model.names.index(name) for name in asked.quantities or model.names),
        ),
        before=earlier.information if earlier else np.zeros((1, *2 * (len(model.names),))),
    )


def plausible(case: Case, asked: DesignSettings) -> Array:
    """Return plausible parameters, (n, n_parameters): the case's own, or drawn from ranges.

    Raises
    ------
    BiogripError
        If a parameter is zero.
    """
    names = case.problem.searched.names
    ranges: dict[str, Any] = {name: (v, v) for name, v in case.parameters.items()}
    ranges |= asked.ranges or {}
    for name in names:
        if ranges[name][0] == 0:
            raise BiogripError(
                f"design: {case.name}: found {name} = 0, allowed is a range of it in "
                "design.ranges, or its value under `fixed`."
            )
    low, high = np.log([ranges[name] for name in names]).T
    if not asked.ranges:
        return np.exp(low)[None]
    # Imported lazily: no other command needs it, and it is slow to import.
    from scipy.stats import qmc

    spread = qmc.Halton(len(names), scramble=False).random(asked.drawn + 1)[1:]
    drawn: Array = np.exp(low + (high - low) * spread)
    return drawn


def plausible_ends(case: Case) -> tuple[Array, Array]:
    """Return log bounds of the parameters, (n_parameters,) each: the prior of a design.

    Ranges of the `design` block, or the search range of parameters without one.
    """
    asked, searched, ranges = case.block.design, case.problem.searched, case.ranges
    assert asked is not None
    ends: list[tuple[float, float]] = []
    for parameter in searched.parameters:
        genes = ranges[parameter.range_name]
        low, high = (asked.ranges or {}).get(parameter.name, (genes.low, genes.high))
        ends.append((max(low, genes.low), min(high, genes.high)))
    low, high = np.log(ends).T
    return low, high


def _largest(case: Case, asked: DesignSettings) -> float:
    if asked.largest_torque_Nm is not None:
        return asked.largest_torque_Nm
    return float(torque(case.actuator, asked.largest_voltage_V or 0.0))
