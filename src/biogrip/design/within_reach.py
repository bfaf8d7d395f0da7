"""Designs that only ask for parameters that some torque can determine.

A camera that is slow compared with a damper gives no information on it, whatever the torque. Its
bound would be a rounding error, and the largest of all, so that a search would minimize rounding
errors. Such parameters are removed from the criterion one after the other. They stay free, with a
very wide prior (`NO_BOUND`), and the others' bounds account for that.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from biogrip.design.climb import climb
from biogrip.design.criteria import inverted
from biogrip.design.experiment import NO_BOUND, DesignInputs, relative_bounds
from biogrip.design.polish import best_of
from biogrip.design.schedule import Plan, planned
from biogrip.design.search import best_torques
from biogrip.design.set_values import torque_of
from biogrip.design.shapes import STEPS
from biogrip.errors import BiogripError
from biogrip.experiment.protocol import Phase


def plan_within_reach(
    inputs: DesignInputs,
    tried: int,
    rng: np.random.Generator,
    progress: Callable[[int, float], None],
    *,
    neighbours: int = 0,
    configured: Sequence[Phase] = (),
) -> tuple[DesignInputs, Plan]:
    """Design an experiment, removing parameters from the criterion that no torque determines.

    From what the search finds it climbs, as many neighbours of trains of steps being rated as asked
    for. A train that is `configured` is a start, too: the design is no worse. The other arguments
    are those of `best_torques`.

    Returns the design problem with the remaining parameters, and the experiment, in which all
    parameters asked for have a bound.

    Raises
    ------
    BiogripError
        If no torque keeps contact, or none determines any parameter asked for.
    """
    while True:
        torques = best_torques(inputs, tried, rng, progress)
        plan = planned(inputs, torques)
        bounds = relative_bounds(plan.information)[:, inputs.criterion.targets]
        if bounds.max() <= NO_BOUND:
            break
        inputs = _without_worst(inputs, plan)
    if neighbours and STEPS in inputs.shapes:
        trains = [each for each in torques if each.waveform.only_steps]

        def count_on(count: int, lowest: float) -> None:
            progress(tried + count, lowest)

        known = [torque for torque in [torque_of(inputs, configured)] if torque]
        pressing = best_of(inputs, known, 1)
        climbed = climb(inputs, trains, neighbours, rng, count_on, pressing)
        plans = [planned(inputs, torques) for torques in (climbed, pressing) if torques]
        plan = min([plan, *plans], key=lambda each: inputs.typical_bound(each.information))
    return inputs, plan


def _without_worst(inputs: DesignInputs, plan: Plan) -> DesignInputs:
    """Remove the worst determined parameter from the criterion, whether asked for or not."""
    # Parameters that trade off against it have no bound either, but vary less.
    variances = np.diagonal(inverted(plan.information), axis1=1, axis2=2).max(axis=0)
    variances[list(inputs.out_of_reach)] = 0.0
    worst = int(np.argmax(variances))
    targets = tuple(index for index in inputs.criterion.targets if index != worst)
    if not targets:
        controlled = inputs.instrument.controlled.name
        names = ", ".join(inputs.model.names[index] for index in inputs.criterion.targets)
        raise BiogripError(
            f"design: found no {controlled} of {', '.join(inputs.shapes)} with which readings at "
            f"{inputs.fastest_Hz:g} Hz tell {names}, even to a factor of e to the {NO_BOUND:g}; "
            f"allowed are faster readings (`fastest_Hz`), more {controlled} or less noise, other "
            "`shapes` or other `quantities`."
        )
    known = np.zeros_like(plan.information[0])
    known[worst, worst] = NO_BOUND**-2
    return replace(
        inputs,
        criterion=replace(inputs.criterion, targets=targets),
        before=inputs.before + known,
        out_of_reach=(*inputs.out_of_reach, worst),
    )
