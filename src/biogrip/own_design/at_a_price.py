"""Several experiments with each cell of a case at a price, and what was chosen in words."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from biogrip.design.experiment import DesignInputs
from biogrip.design.price import PriceSettings
from biogrip.design.sets import ExperimentSet
from biogrip.design.several import Several, choose_several
from biogrip.digits import counted
from biogrip.experiment.random_streams import stream
from biogrip.study.design_inputs import plausible, plausible_ends
from biogrip.study.study import Case

WAYS = ("designed at once", "one repeated", "one after the other, mean")
"""Ways of choosing, in print."""

# Shares of cells in print, beside the one asked for.
_SHARES = (0.5, 0.8, 0.9)
# Cells that sets are judged by, and torques that are tried of each duration and number of steps,
# for each that the config asks for.
_OTHERS, _TRIED = 4, 5


def several_of(
    case: Case, inputs: DesignInputs, study_seed: int, progress: Callable[[int, int], None]
) -> Several | None:
    """Choose experiments of a case whose block `design` has a price; else return nothing.

    The inputs are those of a design, without parameters that no torque determines. The callback
    gets the numbers of experiments designed and to be designed.

    Raises
    ------
    BiogripError
        If no experiment is found.
    """
    # Imported lazily: no other command needs it.
    from scipy.special import ndtri

    block = case.block.design
    assert block is not None
    if block.price is None:
        return None
    count = block.price.cells
    population = plausible(case, replace(block, plausible_samples=(1 + _OTHERS) * count))
    return choose_several(
        inputs,
        block.price,
        population[:count],
        population[count:],
        plausible_ends(case),
        float(np.log1p(block.price.within) / ndtri(0.5 + case.confidence / 2)),
        _TRIED * block.candidates,
        stream(study_seed, case.name, 0, "price"),
        progress,
    )


def aim(case: Case, several: Several) -> str:
    """Return what is asked for, in words."""
    settings = several.settings
    *first, last = (case.searched.names[index] for index in several.targets)
    listed = f"{', '.join(first)} and {last}" if first else last
    return (
        f"{listed} within {100 * settings.within:g} % ({100 * case.confidence:g} % intervals) in "
        f"{100 * settings.share:g} % of the cells of the ranges"
    )


def judged_in_words(several: Several) -> str:
    """Return which cells sets are chosen for, and which judge them."""
    return f"(chosen for {several.cells} cells, judged by {several.others} others)"


def points(several: Several) -> list[list[tuple[float, float]]]:
    """Return costs and shares of cells, of each of `WAYS`."""
    sets = [[(one.cost, one.share) for one in way] for way in (several.at_once, several.repeated)]
    return [*sets, [(one.cost, one.share) for one in several.one_by_one]]


def costs(several: Several) -> list[tuple[float, list[float | None]]]:
    """Return shares of cells, and what each of `WAYS` costs to reach them, if it does."""
    return [
        (share, [_least_cost(way, share) for way in points(several)])
        for share in sorted({*_SHARES, several.settings.share})
    ]


def _least_cost(way: list[tuple[float, float]], share: float) -> float | None:
    return min((cost for cost, reached in way if reached >= share - 1e-9), default=None)


def in_lines(several: Several, aimed_at: str) -> list[str]:
    """Return a table of costs, and the chosen experiments, as lines of text."""
    lines = [f"cost of {aimed_at}, and of fewer or more {judged_in_words(several)}:"]
    lines.append("  % of cells | " + " | ".join(WAYS))
    for share, row in costs(several):
        shown = [f"{in_print(cost):>{len(way)}}" for way, cost in zip(WAYS, row, strict=True)]
        lines.append(f"  {100 * share:>10g} | " + " | ".join(shown))
    if several.chosen is None:
        most = several.settings.experiments
        best = several.at_once[-1].share if several.at_once else 0.0
        lines.append(
            f"no set of up to {counted(most, 'experiment')} that was tried is enough for that, but "
            f"for {100 * best:.3g} % of cells; more `experiments`, readings or torque may be."
        )
    else:
        listed = "; ".join(set_in_words(several, several.chosen))
        lines.append(f"cheapest, for {in_print(several.chosen.cost)}: {listed}")
    return lines


def set_in_words(several: Several, chosen: ExperimentSet) -> list[str]:
    """Return each experiment of a set in words."""
    times = chosen.counts[chosen.counts > 0]
    return [
        f"{often} × {plan.torque.end_s:g} s with {counted(len(plan.time_s), 'reading')} and "
        f"{counted(len(plan.phases), 'change')}"
        for often, plan in zip(times, several.plans_of(chosen), strict=True)
    ]


def price_in_words(settings: PriceSettings) -> str:
    """Return what experiments cost as a sentence."""
    prices = {
        "an experiment": settings.per_experiment,
        "a second": settings.per_second,
        "a reading": settings.per_reading,
        "a change": settings.per_change,
    }
    return "Costs: " + ", ".join(f"{cost:g} {of}" for of, cost in prices.items() if cost) + "."


def in_print(cost: float | None) -> str:
    """Return a cost as text."""
    return "none" if cost is None else f"{cost:.4g}"
