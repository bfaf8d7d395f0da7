"""What trains of steps, ramps and sinusoids tell of the samples of config/design.yaml.

``python -m tests.helpers.shapes_campaign`` takes half an hour of processor time, and writes the
table that docs/design.md takes its numbers from. The test suite makes a row with few torques.
"""

from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import cache

import pandas as pd

from biogrip.design.experiment import NO_BOUND, relative_bounds
from biogrip.design.schedule import sampled
from biogrip.design.shapes import STEPS
from biogrip.design.within_reach import plan_within_reach
from biogrip.experiment.random_streams import stream
from biogrip.identify.answer import silent
from biogrip.study.design_inputs import make_design_inputs
from biogrip.study.load import load_study, read_configs
from biogrip.study.study import Study
from tests.helpers.groups_campaign import write
from tests.helpers.places import CONFIG, ROOT

TABLE = ROOT / "results" / "published" / "shapes" / "tables" / "designed_shapes.csv"
CONFIGS = [CONFIG, ROOT / "config" / "design.yaml", ROOT / "config" / "designed.yaml"]
TRIED = 2000
"""Torques of other shapes."""

KINDS = (("steps", 10.0), ("ramps", 10.0), ("ramps", 0.1), ("sinusoids", 10.0))
"""Shapes, and the shortest of their parts in ms."""


def told(case_name: str, shape: str, shortest_ms: float, tried: int) -> pd.DataFrame:
    """Design with torques of one shape, and give what is told, a row a quantity.

    Trains of steps are the published ones.
    """
    study = _study()
    case = study.cases[case_name]
    wanted = make_design_inputs(case)
    if shape == STEPS:
        plan = sampled(wanted, case.phases)
    else:
        limits = replace(wanted.limits, shortest_s=1e-3 * shortest_ms)
        wanted = replace(wanted, shapes=(shape,), limits=limits)
        rng = stream(study.study_seed, case_name, 0, "design")
        _, plan = plan_within_reach(wanted, tried, rng, silent)
    bounds = relative_bounds(plan.information)[0]
    return pd.DataFrame(
        {
            "case": case_name,
            "shape": shape,
            "shortest_ms": shortest_ms,
            "quantity": wanted.model.names,
            "bound_percent": [100 * bound if bound < NO_BOUND else None for bound in bounds],
            "parts": len(plan.phases),
            "bursts": len(plan.bursts),
            "gap_percent": 100 * plan.gap,
        }
    )


def main(cases: Sequence[str]) -> None:
    """Write the table, and print it."""
    jobs = [(case, *kind, TRIED) for case in cases for kind in KINDS]
    with ProcessPoolExecutor() as processes:
        tables = list(processes.map(told, *zip(*jobs, strict=True)))
    found = pd.concat(tables)
    print(found.to_string(index=False))
    write(found, TABLE)


@cache
def _study() -> Study:
    return load_study(read_configs(CONFIGS), CONFIGS)


if __name__ == "__main__":
    main(list(_study().simulated))
