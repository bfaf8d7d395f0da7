"""Whether any other train of steps beats the designs of config/designed.yaml, within their limits.

``python -m tests.helpers.designs_campaign`` takes ten minutes on two cores, and writes
the table that docs/design.md takes its numbers from. The test suite tries fewer.
"""

import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import cache, partial

import numpy as np
import pandas as pd

from biogrip.design.experiment import DesignInputs
from biogrip.design.neighbours import Train, drawn_neighbour, random_train, train_of
from biogrip.design.rating import Rated, Rater
from biogrip.design.schedule import presses, sampled
from biogrip.design.set_values import set_values, torque_of
from biogrip.experiment.random_streams import stream
from biogrip.study.design_inputs import make_design_inputs
from biogrip.study.load import load_study, read_configs
from biogrip.study.study import Case, Study
from tests.helpers.groups_campaign import write
from tests.helpers.places import CONFIG, ROOT

TABLE = ROOT / "results" / "published" / "design_others" / "tables" / "design_others.csv"
CONFIGS = [CONFIG, ROOT / "config" / "design.yaml", ROOT / "config" / "designed.yaml"]
TRIED = 5000
KINDS = ("random", "neighbour")

GAP = 1e-4
"""Gap of ratings: bounds that differ by a smaller share are not told apart."""

# Most fillings of a rating; trains tried by a job.
_FILLINGS, _AT_ONCE = 100, 250


@dataclass(frozen=True)
class Published:
    """A published design."""

    case: Case
    """Case with its protocol and sampling."""
    inputs: DesignInputs
    """Limits and criterion."""
    rater: Rater
    """Rating without a margin of contact."""
    train: Train
    """Its steps."""
    rated: Rated
    """The best sampling of its torque."""
    bound: float
    """Typical relative bound of its readings, as printed."""


def try_others(case_name: str, kind: str, part: int, tried: int) -> pd.DataFrame:
    """Rate other trains with which contact is kept, a row each.

    A train that is rated better is rounded to what can be set. It counts if the jaws press, with
    the bound of its readings listed as in print.
    """
    published = published_design(case_name)
    inputs, rater = published.inputs, published.rater
    to_beat = float(np.exp(published.rated.logarithm))
    rng = stream(_study().study_seed, f"{case_name} {kind}", part, "others")
    rows: list[tuple[str, str, float]] = []
    while len(rows) < tried:
        start = None
        if kind == "random":
            train = random_train(inputs.limits, rng)
        else:
            other = drawn_neighbour(published.train, inputs.limits, rng)
            assert other is not None
            train, start = other.train, partial(published.rated.carried, other.origins)
        waveform = train.waveform(inputs.limits)
        found = rater.rate(waveform, gap=GAP, most=_FILLINGS, start=start, to_beat=to_beat)
        if found.best is None:
            continue
        ratio = float(np.exp(found.logarithm - published.rated.logarithm))
        if ratio < 1 - GAP:
            phases = set_values(inputs, rater.torque(waveform))
            if not presses(inputs, phases):
                continue
            bound = inputs.typical_bound(sampled(inputs, phases).information)
            ratio = bound / published.bound
        rows.append((case_name, kind, ratio))
    return pd.DataFrame(rows, columns=["case", "kind", "ratio"])


@cache
def published_design(case_name: str) -> Published:
    """Return a published design."""
    case = _study().cases[case_name]
    inputs = make_design_inputs(case)
    rater = Rater(inputs, margin=0.0)
    torque = torque_of(inputs, case.phases)
    assert torque is not None
    history = inputs.history(case.phases)
    information = inputs.information(history, case.sampling.over(history.end_s))
    rated = rater.rate(torque.waveform, gap=GAP, most=_FILLINGS)
    train = train_of(torque.waveform, inputs.limits)
    return Published(case, inputs, rater, train, rated, inputs.typical_bound(information))


def summarize(others: pd.DataFrame) -> pd.DataFrame:
    """Give how many were tried, how many are better, and the best, a row a case and kind.

    Of the best, by how much its bound is larger than that of the published design.
    """
    found = others.groupby(["case", "kind"], sort=False)["ratio"].agg(
        tried="count", better=lambda ratio: (ratio < 1 - GAP).sum(), best="min"
    )
    found["best_excess_percent"] = 100 * (found.pop("best") - 1)
    return found.reset_index()


def main(tried: int) -> None:
    """Write the table, and print it."""
    jobs = [
        (case, kind, part, min(_AT_ONCE, tried - first))
        for case in _study().simulated
        for kind in KINDS
        for part, first in enumerate(range(0, tried, _AT_ONCE))
    ]
    with ProcessPoolExecutor() as processes:
        others = pd.concat(processes.map(try_others, *zip(*jobs, strict=True)))
    found = summarize(others)
    print(found.to_string(index=False))
    write(found, TABLE)


@cache
def _study() -> Study:
    return load_study(read_configs(CONFIGS), CONFIGS)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else TRIED)
