"""Inputs of an experimental design, from the `design` block of a case."""

from typing import Any

import numpy as np

from biogrip.arrays import Array
from biogrip.design.criteria import Criterion
from biogrip.design.earlier_traces import Earlier
from biogrip.design.experiment import DesignInputs
from biogrip.design.noise import WHITE
from biogrip.design.settings import DesignSettings
from biogrip.design.waveform import Limits
from biogrip.errors import BiogripError
from biogrip.instrument.actuator import torque
from biogrip.study.study import Case


def make_design_inputs(case: Case, earlier: Earlier | None = None) -> DesignInputs:
    """Return the inputs of an experimental design for a case that has a block `design`.

    Posterior samples of earlier traces replace the plausible parameters.

    Raises
    ------
    BiogripError
        If a parameter is zero, since design works with logarithms of parameters.
    """
    block = case.block.design
    assert block is not None
    model = case.problem.searched
    slots = round(block.unit_s * block.fastest_Hz)
    return DesignInputs(
        gripper=case.gripper,
        model=model,
        parameters=earlier.parameters if earlier else plausible(case, block),
        noise_rad=block.noise_level,
        samples=block.readings,
        fastest_Hz=block.fastest_Hz,
        limits=Limits(
            block.longest_s, slots / block.fastest_Hz, block.most_steps, 1 / block.fastest_Hz
        ),
        shapes=block.shapes,
        largest_Nm=_largest(case, block),
        stroke_rad=case.stroke_rad if case.instrument.has_jaws else np.inf,
        criterion=Criterion(
            block.criterion,
            block.over,
            tuple(model.names.index(name) for name in block.quantities or model.names),
        ),
        before=earlier.information if earlier else np.zeros((1, *2 * (len(model.names),))),
        instrument=case.instrument,
        noise=block.noise or WHITE,
    )


def plausible(case: Case, block: DesignSettings) -> Array:
    """Return plausible parameters, (n, n_parameters): the case's own, or drawn from ranges.

    Raises
    ------
    BiogripError
        If a parameter is zero.
    """
    names = case.problem.searched.names
    ranges: dict[str, Any] = {name: (v, v) for name, v in case.parameters.items()}
    ranges |= block.ranges or {}
    for name in names:
        if ranges[name][0] == 0:
            raise BiogripError(
                f"design: {case.name}: found {name} = 0, allowed is a range of it in "
                "design.ranges, or its value under `fixed`."
            )
    low, high = np.log([ranges[name] for name in names]).T
    if not block.ranges:
        return np.exp(low)[None]
    # Imported lazily: no other command needs it, and it is slow to import.
    from scipy.stats import qmc

    spread = qmc.Halton(len(names), scramble=False).random(block.plausible_samples + 1)[1:]
    return np.exp(low + (high - low) * spread)


def plausible_ends(case: Case) -> tuple[Array, Array]:
    """Return log bounds of the parameters, (n_parameters,) each: the prior of a design.

    Ranges of the `design` block, or the search range of parameters without one.
    """
    block, searched, ranges = case.block.design, case.problem.searched, case.ranges
    assert block is not None
    ends: list[tuple[float, float]] = []
    for parameter in searched.parameters:
        genes = ranges[parameter.range_name]
        low, high = (block.ranges or {}).get(parameter.name, (genes.low, genes.high))
        ends.append((max(low, genes.low), min(high, genes.high)))
    low, high = np.log(ends).T
    return low, high


def _largest(case: Case, block: DesignSettings) -> float:
    largest = block.largest(case.instrument)
    if largest is not None:
        return largest
    return float(torque(case.actuator, block.largest_voltage_V or 0.0))
