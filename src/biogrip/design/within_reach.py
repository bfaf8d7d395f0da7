"""A design that asks for what can be told.

A camera that is slow beside what a damper does reads nothing of it, whatever the torque. Its bound
is then rounding, and the largest of all: a search for what makes it small would be one among
roundings. So what no torque tells is left out of what is asked, one parameter after the other. It
stays free, within a factor that nobody would call known, and the others' bounds allow for that.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from biogrip.design.criteria import inverted
from biogrip.design.experiment import NO_BOUND, Wanted, relative_bounds
from biogrip.design.schedule import Plan, planned
from biogrip.design.search import best_torques
from biogrip.errors import BiogripError


def planned_within_reach(
    wanted: Wanted,
    tried: int,
    rng: np.random.Generator,
    progress: Callable[[int, float], None],
) -> tuple[Wanted, Plan]:
    """Search for torques, and sample the best, asking only for what can be told.

    Parameters
    ----------
    wanted, tried, rng, progress
        As in `best_torques`.

    Returns
    -------
    wanted
        What is asked in the end.
    plan
        The experiment, in which everything that is asked has a bound.

    Raises
    ------
    BiogripError
        If no torque keeps contact, or none tells anything of what is asked.
    """
    while True:
        plan = planned(wanted, best_torques(wanted, tried, rng, progress))
        bounds = relative_bounds(plan.information)[:, wanted.criterion.asked]
        if bounds.max() <= NO_BOUND:
            return wanted, plan
        wanted = _without_worst(wanted, plan)


def _without_worst(wanted: Wanted, plan: Plan) -> Wanted:
    """Leave out the parameter that is told worst, asked for or not."""
    # What trades against it has no bound either, but moves less: k and c against a small c_p.
    variances = np.diagonal(inverted(plan.information), axis1=1, axis2=2).max(axis=0)
    variances[list(wanted.out_of_reach)] = 0.0
    worst = int(np.argmax(variances))
    asked = tuple(index for index in wanted.criterion.asked if index != worst)
    if not asked:
        names = ", ".join(wanted.model.names[index] for index in wanted.criterion.asked)
        raise BiogripError(
            f"design: found no torque of {', '.join(wanted.shapes)} with which readings at "
            f"{wanted.fastest_Hz:g} Hz tell {names}, even to a factor of e to the {NO_BOUND:g}; "
            "allowed are a faster camera (`fastest_Hz`), more torque or less noise, other `shapes` "
            "or other `quantities`."
        )
    known = np.zeros_like(plan.information[0])
    known[worst, worst] = NO_BOUND**-2
    return replace(
        wanted,
        criterion=replace(wanted.criterion, asked=asked),
        before=wanted.before + known,
        out_of_reach=(*wanted.out_of_reach, worst),
    )
