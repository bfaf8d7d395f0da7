"""The algorithm under every reading of section 4: which can have printed the paper's tables.

One table has, of each reading, how many of the printed values its genes hold and how likely it
makes them; the other what it finds in each sample.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from biogrip.arrays import Array
from biogrip.config.source import overlaid
from biogrip.keys import built
from biogrip_study.config.case_blocks import CaseBlock
from biogrip_study.config.study import Study
from biogrip_study.methods.genome import encodable_values
from biogrip_study.records.identifications import (
    near_noise,
    near_noise_words,
    read_readings,
    share_with_limits,
)
from biogrip_study.stages.job import job_study, logged, paths
from biogrip_study.tables.cases import interval_of, value_in_case
from biogrip_study.tables.layout import Column, Row, ShownTable, titled, write

if TYPE_CHECKING:
    snakemake: Any

# Widths of the kernels, of logarithms of quantities in the paper's tables: about the bounds of
# what a trace determines (sampling_evidence), half an e-fold or less of what it does not.
_WIDTHS: Mapping[int, Mapping[str, float]] = {
    5: {"k": 0.05, "k_p": 0.005, "c": 0.015},
    6: {"k": 0.3, "c_p": 0.5, "c + c_p": 0.006},
    7: {"k": 0.05, "c_p": 0.5, "c + c_p": 0.006},
}
_GENERATIONS = 5.0
"""Width of the kernel about the generation of a printed fit."""
_FLOOR = 1e-12
"""Means of kernels below this are taken for it, for none of the runs comes near."""
_LOSES = -0.5
"""Difference of log10 below which, at every width, a reading is excluded: a third as likely."""
_ERRORS = 1.96
"""Standard errors of the simulation that are granted it."""

Found = Mapping[str, pd.DataFrame]
"""Rows of every reading, by case; parameters stand by name in the place of their columns."""


def read(study: Study, files: list[Path]) -> Found:
    """Read what all readings found of each case, CSV, with sums of dampers."""
    found = {}
    for case, path in zip(study.cases.values(), files, strict=True):
        rows = read_readings(path, case)
        found[case.name] = rows.assign(**{"c + c_p": rows["c"] + rows["c_p"]})
    return found


def printable(study: Study, reading: str) -> dict[str, int]:
    """Count the paper's identified values that a reading's genes hold.

    They hold them `exactly`, another number that is `rounded` to them, or one that has the printed
    error, too (`with_error`).
    """
    counts = dict.fromkeys(("values", "exactly", "rounded", "with_error"), 0)
    for case in study.cases.values():
        changes = study.config.readings[reading].changes
        ranges = built(CaseBlock, overlaid(case.plain, changes)).search_range
        for name, printed in case.published.identified.items():
            held = encodable_values(getattr(ranges, name))
            ends = {"exactly": (printed, printed), "rounded": interval_of(printed, None, None)}
            ends["with_error"] = (value_in_case(case, [name]) or ends["rounded"])[-2:]
            counts["values"] += 1
            for how, (low, high) in ends.items():
                # Doubles of decimal numbers.
                inside = (held >= low * (1 - 1e-9)) & (held <= high * (1 + 1e-9))
                counts[how] += bool(inside.any())
    return counts


def able(study: Study) -> str:
    """Return the first reading that can print the most of the paper's values with their errors."""
    return max(study.config.readings, key=lambda name: printable(study, name)["with_error"])


def log_likelihood(study: Study, found: Found, reading: str, wide: float) -> tuple[float, float]:
    """Return log10 of the likelihood of the printed values, and its standard error by simulation.

    It is the product over tables of the mean over runs of a Gaussian kernel about the printed
    values; `wide` multiplies its widths.
    """
    return _summed(
        np.prod(
            [
                _kernel(np.log(np.maximum(rows[name], 1e-300) / told[0]), wide * width)
                for name, width in _WIDTHS[case.published.table].items()
                if (told := value_in_case(case, name.split(" + ")))
            ],
            axis=0,
        )
        for case, rows in _of(study, found, reading)
    )


def log_likelihood_of_generations(study: Study, found: Found, reading: str) -> tuple[float, float]:
    """Return the same of the generations of the printed fits, as those of the last improvement."""
    return _summed(
        _kernel(rows["last_improvement"] - case.published.generation, _GENERATIONS)
        for case, rows in _of(study, found, reading)
        if case.published.generation
    )


def _of(study: Study, found: Found, reading: str) -> Any:
    """Yield the cases of the paper's tables with the rows of a reading."""
    for name, case in study.cases.items():
        if case.published.table in _WIDTHS:
            yield case, found[name][found[name]["reading"] == reading]


def _kernel(away: Any, width: float) -> Array:
    kernel: Array = np.exp(-0.5 * (np.asarray(away) / width) ** 2)
    return kernel


def _summed(kernels: Any) -> tuple[float, float]:
    total, variance = 0.0, 0.0
    for each in kernels:
        mean = max(float(each.mean()), _FLOOR)
        total += np.log10(mean)
        variance += float(each.var(ddof=1)) / len(each) / mean**2
    return float(total), float(np.sqrt(variance) / np.log(10))


def readings(study: Study, found: Found) -> ShownTable:
    """Compare what the readings can print, and how likely they make what the paper prints."""
    base, rows = able(study), []
    widths = {"half": 0.5, "": 1.0, "twice": 2.0}
    for name, reading in study.config.readings.items():
        row: Row = {"reading": reading.title, **printable(study, name)}
        highest = []
        for label, wide in widths.items():
            mine, its = (log_likelihood(study, found, each, wide) for each in (name, base))
            error = np.hypot(mine[1], its[1]) if name != base else 0.0
            end = f"_{label}" if label else ""
            row |= {f"likelihood{end}": mine[0] - its[0], f"likelihood_error{end}": error}
            highest.append(mine[0] - its[0] + _ERRORS * error)
        of_generations = [log_likelihood_of_generations(study, found, it) for it in (name, base)]
        row |= {"generations": of_generations[0][0] - of_generations[1][0]}
        for case, mine_of_case in _of(study, found, name):
            column = f"last_improvement_{case.published.table}"
            row[column] = mine_of_case["last_improvement"].median()
        row["verdict"] = "excluded" if max(highest) < _LOSES else "not told apart"
        rows.append(row)
    columns = (
        Column("reading", "Reading"),
        Column("values", "Printed values"),
        Column("exactly", "held exactly"),
        Column("rounded", "rounded"),
        Column("with_error", "with their errors"),
        Column("likelihood", "log₁₀ likelihood", 2),
        Column("likelihood_error", "its error", 1),
        Column("likelihood_half", "half the width", 2),
        Column("likelihood_error_half", "its error", 1),
        Column("likelihood_twice", "twice the width", 2),
        Column("likelihood_error_twice", "its error", 1),
        Column("generations", "of the generations", 2),
        *(Column(f"last_improvement_{n}", f"Last improvement, Table {n}") for n in _WIDTHS),
        Column("verdict", "By its likelihood"),
    )
    caption = (
        "Which reading of section 4 can have printed Tables 5 to 7. How many of their identified "
        "values the genes hold: exactly; as another number that is printed so, rounded or cut off; "
        "or as one that has the printed error, too. Likelihood of the values: the product over "
        "tables of the mean over runs of a Gaussian kernel about the printed values, of the width "
        "that noise allows, of half and of twice that; log₁₀ less that of "
        f"“{study.config.readings[base].title}”, with the standard error of the simulation. "
        f"Excluded: below {_LOSES:g} at every width, {_ERRORS:g} such errors granted. Generations: "
        "the same of the paper's 70 and 61, as those of the last improvement, whose medians follow."
    )
    return ShownTable(caption, columns, rows)


def found_by_readings(study: Study, found: Found) -> ShownTable:
    """Compare what the readings find in each sample."""
    rows: list[Row] = []
    for reading, block in study.config.readings.items():
        for case, mine in _of(study, found, reading):
            near = near_noise(mine, study.near_noise_tolerance)
            row: Row = {"case": case.name, "reading": block.title, "seeds": len(mine)}
            row |= zip(_SHARES, share_with_limits(int(near.sum()), len(mine)), strict=True)
            close = np.ones(len(mine), dtype=bool)
            for name in _WIDTHS[case.published.table]:
                target = sum(case.parameters[part] for part in name.split(" + "))
                error = 100 * np.abs(mine[name] / target - 1)
                row[f"error_percent {name}"] = error.median()
                told = value_in_case(case, name.split(" + "))
                if told and name != "c_p":
                    close &= error <= max(100 * abs(end / target - 1) for end in told) * (1 + 1e-9)
            row |= {"as_close_share": close.mean(), "stop": mine["generations"].median()}
            rows.append(row | {"last_improvement": mine["last_improvement"].median()})
    names = dict.fromkeys(name for each in _WIDTHS.values() for name in each if name != "c_p")
    rows = [{k: v for k, v in row.items() if k != "error_percent c_p"} for row in rows]
    words = near_noise_words(study.near_noise_tolerance)
    columns = (
        *titled("case", "reading", "seeds"),
        *map(Column, _SHARES, (f"Share {words}", "95 % from", "to"), (2, 2, 2)),
        Column("as_close_share", "Share as close as the paper", 2),
        *(Column(f"error_percent {name}", f"Error {name} %", 2) for name in names),
        Column("last_improvement", "Last improvement"),
        Column("stop", "Stop"),
    )
    caption = (
        "What the genetic algorithm finds under each reading. As close as the paper: errors of "
        "k, k_p and c (of Tables 6 and 7 of k and c + c_p) at most the largest that the printed "
        "value and error allow. Errors: medians over runs of the absolute error. Last improvement "
        "and stop: median generations."
    )
    return ShownTable(caption, columns, rows)


_SHARES = "near_noise_share", "near_noise_from", "near_noise_to"

if __name__ == "__main__":
    with logged(snakemake):
        of_paper = job_study(snakemake)
        files = paths(snakemake.input.found)
        of_paper = of_paper.of(file.stem for file in files)
        all_found = read(of_paper, files)
        write(readings(of_paper, all_found), Path(snakemake.output.readings))
        write(found_by_readings(of_paper, all_found), Path(snakemake.output.found))
