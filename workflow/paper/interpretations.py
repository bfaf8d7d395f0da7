"""The algorithm under every interpretation of section 4: what each finds, and how probable it is.

One table has success rate, errors and last improvement of each interpretation; the other how
probable the paper's tables are together, all parameters of a table at once.
"""

from collections.abc import Iterator
from functools import reduce
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from scipy.special import betaincinv
from scipy.stats import qmc

from biogrip.arrays import Array, BoolArray
from biogrip.physics.sample_model import SINGLE_BRANCH
from biogrip.records.identifications import INTERPRETATIONS
from biogrip.records.success import near_noise, near_noise_words
from biogrip.stages.job import job_study, logged, paths
from biogrip.study.study import Case, Study
from biogrip.tables.layout import Column, Row, ShownTable, write

if TYPE_CHECKING:
    snakemake: Any

_COMPARED = ("k", "k_p", "c")
"""Parameters compared with the paper's at once; of c_p it says only that it errs by over 100 %."""
_ROUNDING = 0.005
"""Relative error by which the paper's values may be rounded."""
_HALF_A_DECADE = 10**0.5
_RESOLVED = 0.01
"""What two digits resolve at best; smaller errors are of this order."""
_AS_SMALL, _SAME_ORDER = "as small", "of the same order"


def _compared(case: Case) -> list[str]:
    """Return the parameters that are compared, of those that the paper identifies."""
    published = case.published.identified
    return [name for name in _COMPARED if name in published and case.parameters.get(name)]


def _relative_errors(case: Case, found: pd.DataFrame) -> Array:
    """Return absolute relative errors of every seed, shape (n_parameters, n_seeds)."""
    columns = {p.name: p.column for p in SINGLE_BRANCH}
    return np.abs(
        [found[columns[n]].to_numpy(float) / case.parameters[n] - 1 for n in _compared(case)]
    )


def _is_close(case: Case, found: pd.DataFrame, criterion: str) -> BoolArray:
    """Return True for each seed whose errors are all as small as the paper's, or of its order."""
    published = case.published.identified
    printed = np.array([abs(published[n] / case.parameters[n] - 1) for n in _compared(case)])
    of_order = _HALF_A_DECADE * np.maximum(printed, _RESOLVED)
    allowed = printed + _ROUNDING if criterion == _AS_SMALL else of_order
    return np.all(_relative_errors(case, found) <= allowed[:, None], axis=0)


def interpretations(study: Study, found: list[Path]) -> ShownTable:
    """Compare the interpretations from the rows of each case, CSV."""
    rows: list[Row] = []
    for path, case in zip(found, study.cases.values(), strict=True):
        of_case = INTERPRETATIONS.read(path)
        for name, reading in study.config.interpretations.items():
            mine = of_case[of_case["interpretation"] == name]
            row = {
                "case": case.name,
                "interpretation": reading.title,
                "seeds": len(mine),
                "near_noise_share": near_noise(mine, study.near_noise_tolerance).mean(),
                "last_improvement": mine["last_improvement"].median(),
            }
            if _compared(case):
                row["as_close_share"] = _is_close(case, mine, _AS_SMALL).mean()
            for p in SINGLE_BRANCH:
                if target := case.parameters.get(p.name):
                    error = 100 * np.abs(mine[p.column].to_numpy(float) / target - 1)
                    row[f"error_percent {p.name}"] = np.median(error)
            rows.append(row)
    words = near_noise_words(study.near_noise_tolerance)
    columns = (
        Column("case", "Case"),
        Column("interpretation", "Interpretation"),
        Column("seeds", "Seeds"),
        Column("near_noise_share", f"Share {words}", 2),
        Column("as_close_share", f"Share as close as the paper in {', '.join(_COMPARED)}", 2),
        *(Column(f"error_percent {p.name}", f"Error {p.name} %", 2) for p in SINGLE_BRANCH),
        Column("last_improvement", "Last improvement", 3),
    )
    caption = (
        "The genetic algorithm under other interpretations of section 4, on the same traces. "
        "Errors: median over seeds of the absolute error. Last improvement: median generation in "
        "which the best misfit fell for the last time; the paper shows its fits of Tables 5 and 7 "
        "at generations 70 and 61."
    )
    return ShownTable(caption, columns, rows)


_JOINT_COLUMNS = (
    Column("interpretation", "Interpretation"),
    Column("errors", "Errors beside the printed ones"),
    Column("table", "Table of the paper"),
    Column("seeds", "Seeds"),
    Column("as_close", "As close"),
    Column("probability", "Probability", 2),
    Column("low", "from", 2),
    Column("high", "to", 2),
    Column("as_improbable", "As improbable", 2),
    Column("as_improbable_low", "from", 2),
    Column("as_improbable_high", "to", 2),
)
_TAILS = 0.025, 0.975
_LOG2_DRAWS = 14
_EQUAL = 1e-9
"""Products of shares that differ by less are equal."""


def interpretations_jointly(study: Study, found: list[Path]) -> ShownTable:
    """Compute the probabilities from the rows of each case, CSV."""
    caption = (
        f"How probable the errors of the paper's tables are: share of seeds whose errors of "
        f"{', '.join(_COMPARED)} are all as small as those that follow from the printed values "
        "(with half a percent for rounding), or at most half a decade larger (errors below 1 %, "
        "which two digits do not resolve, taken as 1 %), with 95 % limits by Jeffreys. The tables "
        "are independent runs: the probability of all is the product, its limits those of products "
        "of draws. As any product of three is small, as improbable is the share of combinations of "
        "seeds for which, taken in the place of the paper's runs, it is not larger."
    )
    cases = [
        (case, INTERPRETATIONS.read(path))
        for path, case in zip(found, study.cases.values(), strict=True)
        if _compared(case)
    ]
    rows = [
        {"interpretation": reading.title, **row}
        for name, reading in study.config.interpretations.items()
        for row in _joint_rows(
            [(case, rows[rows["interpretation"] == name]) for case, rows in cases]
        )
    ]
    return ShownTable(caption, _JOINT_COLUMNS, rows)


def _joint_rows(cases: list[tuple[Case, pd.DataFrame]]) -> Iterator[Row]:
    """Yield by each criterion a row for every table of the paper, and one for all of them."""
    own = [own_shares(_relative_errors(case, found)) for case, found in cases]
    for criterion in (_AS_SMALL, _SAME_ORDER):
        counts = [
            (int(_is_close(case, found, criterion).sum()), len(found)) for case, found in cases
        ]
        for (case, _), (count, seeds) in zip(cases, counts, strict=True):
            low, high = limits([(count, seeds)])
            row: Row = {"errors": criterion, "table": case.published.table, "seeds": seeds}
            row |= {"as_close": count, "probability": count / seeds, "low": low, "high": high}
            yield row
        product = float(np.prod([count / seeds for count, seeds in counts]))
        low, high = limits(counts)
        row = {"errors": criterion, "table": "all"}
        row |= {"probability": product, "low": low, "high": high}
        if criterion == _AS_SMALL:
            ends = {"": product, "_low": low, "_high": high}
            row |= {f"as_improbable{end}": share_not_larger(own, p) for end, p in ends.items()}
        yield row


def limits(counts: list[tuple[int, int]]) -> tuple[float, float]:
    """Return 95 % limits of the product of probabilities, given successes and trials of each.

    Their posteriors under Jeffreys' prior are drawn from with a Sobol sequence, so that the limits
    are the same wherever they are computed.
    """
    points = qmc.Sobol(len(counts), scramble=False).random_base2(_LOG2_DRAWS)
    draws = [
        betaincinv(count + 0.5, trials - count + 0.5, points[:, column])
        for column, (count, trials) in enumerate(counts)
    ]
    low, high = np.quantile(np.prod(draws, axis=0), _TAILS)
    # As usual with Jeffreys' limits, what never or always happened leaves that side open.
    none = any(count == 0 for count, _ in counts)
    always = all(count == trials for count, trials in counts)
    return 0.0 if none else float(low), 1.0 if always else float(high)


def own_shares(errors: Array) -> Array:
    """Return the share of seeds, itself among them, whose errors are all as small as each seed's.

    Errors have the shape (n_parameters, n_seeds).
    """
    within = np.all(errors[:, :, None] <= errors[:, None, :], axis=0)
    return np.asarray(within.mean(axis=0))


def share_not_larger(shares: list[Array], product: float) -> float:
    """Return the share of combinations, one of each array, whose product is at most `product`."""
    *others, last = shares
    of_others = reduce(np.multiply.outer, others, np.ones(())).ravel()
    allowed = product * (1 + _EQUAL) / of_others
    ranks = np.searchsorted(np.sort(last), allowed, side="right")
    return float(ranks.mean() / len(last))


if __name__ == "__main__":
    with logged(snakemake):
        files = paths(snakemake.input.found)
        of_paper = job_study(snakemake).of(file.stem for file in files)
        write(interpretations(of_paper, files), Path(snakemake.output.apart))
        write(interpretations_jointly(of_paper, files), Path(snakemake.output.jointly))
