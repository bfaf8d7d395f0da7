"""What several experiments with each cell cost by config/price.yaml, and whether they tell.

``python -m tests.helpers.price_campaign`` takes some ten minutes, and writes the table and the
figure of docs/design.md. With cells that are drawn anew, the chosen set is simulated, and all
traces of a cell are fitted together. The test suite has a few.
"""

from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import cache, partial
from math import sqrt

import numpy as np
import pandas as pd

from biogrip.design.schedule import Plan
from biogrip.design.several import Several
from biogrip.experiment.random_streams import stream
from biogrip.groups.replicates import compute_common_noise, joint_problem
from biogrip.identifiability.likelihood import make_likelihood
from biogrip.identifiability.limits import find_limits
from biogrip.identifiability.quantities import parameters_and_sum
from biogrip.identify.case_problem import CaseProblem
from biogrip.identify.multi_start import fit_from
from biogrip.own_design.at_a_price import WAYS, costs, points, several_of
from biogrip.own_design.drawings import draw_price
from biogrip.products.designed_cases import WELL
from biogrip.products.figures.style import save_png, styled
from biogrip.response.simulation import simulated_rotation
from biogrip.study.design_inputs import make_design_inputs, plausible_ends
from biogrip.study.load import load_study, read_configs
from biogrip.study.study import Case, Study
from tests.helpers.groups_campaign import write
from tests.helpers.places import CONFIG, ROOT

FOLDER = ROOT / "results" / "published" / "price"
FIGURE = FOLDER / "figures" / "price.png"
TABLE = FOLDER / "tables" / "price.csv"
SEQUENTIAL = ROOT / "results" / "published" / "sequential" / "tables" / "sequential.csv"
ASKED = [CONFIG, ROOT / "config" / "price.yaml"]
CELL, CELLS = "endothelial_cell", 500
DESIGNED_AFTER = "each designed after those before"


def known_to(plans: list[Plan], counts: list[int], number: int) -> bool:
    """Simulate experiments with a cell, and tell whether all parameters have narrow intervals.

    The mean of repeated traces has all that they tell.
    """
    case = _case()
    rng = stream(_study().study_seed, CELL, number, "price, simulated")
    truth = rng.uniform(*plausible_ends(case))
    problems, noises = [], []
    for plan, count in zip(plans, counts, strict=True):
        problem = _problem(case, plan)
        network = problem.searched.network(np.exp(truth)[None])
        clean = simulated_rotation(
            problem.gripper, network, problem.torque, plan.time_s, nonlinear=False
        )
        noises.append(case.design.noise_level / sqrt(count))
        trace = clean[0] + noises[-1] * rng.standard_normal(len(plan.time_s))
        problems.append(problem.of(plan.time_s, trace, noise_rad=noises[-1]))
    joint = joint_problem(problems, noises)
    common = compute_common_noise([len(plan.time_s) for plan in plans], noises)
    best = fit_from([joint], truth)
    likelihood = make_likelihood(
        joint,
        best.x[0],
        float(best.misfit_rad[0]),
        confidence=case.confidence,
        noise_rad=common,
    )
    quantities = parameters_and_sum(case.problem.searched)[: len(truth)]
    low, high = np.array(find_limits([likelihood], quantities)[0][0]).T
    return bool(np.all(np.nan_to_num(0.5 * (high - low), nan=np.inf) <= np.log1p(WELL)))


def front_of(several: Several) -> pd.DataFrame:
    """Give what each way costs, a row a point of its front, and for some shares at least."""
    rows = [
        {"way": way, "cost": cost, "share_percent": 100 * share}
        for way, each in zip(WAYS, points(several), strict=True)
        for cost, share in each
    ]
    rows += [
        {"way": way, "cost": cost, "least_percent": 100 * share}
        for share, row in costs(several)
        for way, cost in zip(WAYS, row, strict=True)
        if cost is not None
    ]
    return pd.DataFrame(rows)


def chosen_of(several: Several, simulated_percent: float) -> pd.DataFrame:
    """Give the chosen set, a row an experiment."""
    chosen = several.chosen
    assert chosen is not None
    plans, counts = several.plans_of(chosen), chosen.counts[chosen.counts > 0]
    return pd.DataFrame(
        {
            "way": "chosen",
            "cost": chosen.cost,
            "share_percent": 100 * chosen.share,
            "cells": len(chosen.known),
            "experiments": chosen.counts.sum(),
            "simulated": CELLS,
            "simulated_percent": simulated_percent,
            "times": counts,
            "seconds": [plan.torque.end_s for plan in plans],
            "readings": [len(plan.time_s) for plan in plans],
            "changes": [len(plan.phases) for plan in plans],
        }
    )


def designed_after() -> pd.DataFrame:
    """Give what the published experiments designed after those before cost, at most.

    The first is the paper's; the others have no more changes than the config allows.
    """
    case = _case()
    block = case.design
    assert block.price is not None
    history = case.problem.torque
    readings = len(case.sampling.over(history.end_s))
    first = block.price.cost(history.end_s, readings, len(case.phases))
    further = block.price.cost(block.longest_s, block.readings, block.most_steps)
    found = pd.read_csv(SEQUENTIAL)
    found = found[(found["way"] == DESIGNED_AFTER) & (found["quantity"] == "all")]
    cost = first + further * (found["experiments"] - 1)
    return pd.DataFrame(
        {
            "way": DESIGNED_AFTER,
            "cost": cost,
            "share_percent": found["determined_percent"],
            "experiments": found["experiments"],
        }
    )


def main() -> None:
    """Write the table and the figure, and print the table."""
    case = _case()
    inputs = make_design_inputs(case)
    several = several_of(case, inputs, _study().study_seed, lambda *_: None)
    assert several is not None
    assert several.chosen is not None
    plans = several.plans_of(several.chosen)
    counts = several.chosen.counts[several.chosen.counts > 0].tolist()
    with ProcessPoolExecutor() as processes:
        known = list(processes.map(partial(known_to, plans, counts), range(CELLS)))
    parts = [front_of(several), designed_after(), chosen_of(several, 100 * float(np.mean(known)))]
    found = pd.concat(parts)
    print(found.to_string(index=False))
    write(found, TABLE)
    FIGURE.parent.mkdir(parents=True, exist_ok=True)
    with styled():
        save_png(draw_price(several), FIGURE)


def _problem(case: Case, plan: Plan) -> CaseProblem:
    return replace(case.problem, noise_rad=case.design.noise_level, phases=plan.phases)


def _case() -> Case:
    return _study().cases[CELL]


@cache
def _study() -> Study:
    return load_study(read_configs(ASKED), ASKED)


if __name__ == "__main__":
    main()
