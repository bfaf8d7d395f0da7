"""Comparison of interpretations of section 4: success rate, errors and last improvement."""

from pathlib import Path

import numpy as np
import pandas as pd

from biogrip.experiment.sample import SINGLE_BRANCH
from biogrip.experiment.truth import Truth
from biogrip.fit.success import near_noise, near_noise_words
from biogrip.records.interpretations import INTERPRETATIONS
from biogrip.study.study import Study
from biogrip.tables.closeness import COMPARED, as_small, compared_parameters
from biogrip.tables.layout import Cell, Column, Table


def interpretations(study: Study, found: list[Path]) -> Table:
    """Compare the interpretations from the rows of each case, CSV."""
    rows = [
        row
        for path, (name, case) in zip(found, study.cases.items(), strict=True)
        for row in _rows(study, name, case.truth, INTERPRETATIONS.read(path))
    ]
    words = near_noise_words(study.near_noise_tolerance)
    columns = (
        Column("case", "Case"),
        Column("interpretation", "Interpretation"),
        Column("seeds", "Seeds"),
        Column("near_noise_share", f"Share {words}", 2),
        Column("as_close_share", f"Share as close as the paper in {', '.join(COMPARED)}", 2),
        *(Column(f"error_percent {p.name}", f"Error {p.name} %", 2) for p in SINGLE_BRANCH),
        Column("last_improvement", "Last improvement", 3),
    )
    caption = (
        "The genetic algorithm under other interpretations of section 4, on the same traces. "
        "Errors: median over seeds of the absolute error. Last improvement: median generation in "
        "which the best misfit fell for the last time; the paper shows its fits of Tables 5 and 7 "
        "at generations 70 and 61."
    )
    return Table(caption, columns, rows)


def _rows(study: Study, case: str, truth: Truth, found: pd.DataFrame) -> list[tuple[Cell, ...]]:
    rows: list[tuple[Cell, ...]] = []
    for name, title in study.interpretation_titles.items():
        mine = found[found["interpretation"] == name]
        errors = {
            p.name: 100 * np.abs(mine[p.column].to_numpy(float) / truth.parameters[p.name] - 1)
            for p in SINGLE_BRANCH
            if truth.parameters.get(p.name)
        }
        compared = compared_parameters(truth)
        rows.append(
            (
                case,
                title,
                len(mine),
                float(near_noise(mine, study.near_noise_tolerance).mean()),
                float(as_small(truth, mine).mean()) if compared else None,
                *(_median(errors.get(p.name)) for p in SINGLE_BRANCH),
                float(mine["last_improvement"].median()),
            )
        )
    return rows


def _median(errors: "np.ndarray | None") -> float | None:
    return None if errors is None else float(np.median(errors))
