"""The algorithm under every reading of section 4: which can have printed the paper's tables.

One table has, of each reading, how many of the printed values its genes hold and how likely it
makes them; another what it finds in each sample; and a figure sets the likelihoods beside what the
readings make of the paper's claims.

The likelihood of what is printed, by simulation, is a product of factors, each of which needs a
hundred runs:

1. In each table, the share of runs in the basin of the printed values: all quantities that noise
   lets a trace determine are within half an e-fold of them.
2. Of each of these quantities, the density of its logarithm in these runs, by Gaussian kernels.
   They are as wide as Scott's rule has it for these runs, widened by what the printed digits leave.
3. Of each quantity that no trace determines, the same in all runs, by kernels of half an e-fold:
   these depend on where a search happens to stop, and spread over decades.

That quantities of a table are correlated within the basin is left out. D. W. Scott, Multivariate
Density Estimation, Wiley 1992.
"""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from biogrip.arrays import Array
from biogrip.config.source import overlaid
from biogrip.figures.style import (
    BLACK,
    BLUE,
    GREY,
    PAGE_IN,
    SHADE,
    figure,
    panel,
    save,
    styled,
)
from biogrip.keys import built
from biogrip_study.config.study import Case, Study
from biogrip_study.config.study_blocks import CaseBlock
from biogrip_study.methods.genome import encodable_values
from biogrip_study.records.identifications import (
    near_noise,
    near_noise_words,
    read_readings,
    share_with_limits,
)
from biogrip_study.stages.job import job_study, logged, paths
from biogrip_study.tables.cases import value_in_case
from biogrip_study.tables.layout import Column, Row, ShownTable, titled, write

if TYPE_CHECKING:
    snakemake: Any

_DETERMINED: Mapping[int, Sequence[str]] = {
    5: ("k", "k_p", "c"),
    6: ("c + c_p",),
    7: ("k", "c + c_p"),
}
"""Quantities in the paper's tables that a trace determines; the sum stands for c."""
_SCATTERED: Mapping[int, Sequence[str]] = {5: (), 6: ("k", "k_p", "c_p"), 7: ("k_p", "c_p")}
"""Others; c_p of Table 5 is printed by its order alone."""
_BASIN = _WIDTH = 0.5
"""E-folds from the printed values to the end of their basin, and width of the widest kernels."""
_FLOOR = 1e-12
"""Means of kernels below this are taken for it, for none of the runs comes near."""
_EXCLUDED = -2.0
"""Difference of log10 below which a reading is excluded: a hundredth as likely."""
_ENOUGH = 100
"""Runs that have to count in each factor."""
_ERRORS = 1.96
"""Standard errors of the simulation that are granted it."""
SHARED = 7
"""Table that has k_p, c and the errors of c, k_p in common with another, and may be its copy."""

Found = Mapping[str, pd.DataFrame]
"""Rows of every reading, by case; parameters stand by name in the place of their columns."""
Factors = Mapping[tuple[int, str], tuple[float, float, int]]
"""Of a table and a quantity: log10 of a factor, variance of this by simulation, runs."""


def read(study: Study, files: list[Path]) -> Found:
    """Read what all readings found, of files in folders of their case, with sums of dampers."""
    found: dict[str, list[pd.DataFrame]] = {}
    for path in files:
        rows = read_readings(path, study.cases[path.parent.name])
        found.setdefault(path.parent.name, []).append(rows)
    joined = {name: pd.concat(rows, ignore_index=True) for name, rows in found.items()}
    return {
        name: runs.assign(**{"c + c_p": runs["c"] + runs["c_p"]}) for name, runs in joined.items()
    }


def printable(study: Study, reading: str) -> dict[str, int]:
    """Count the paper's identified values that a reading's genes hold.

    They hold them `exactly`, or another number that is printed so, with the error (`with_error`).
    """
    counts = dict.fromkeys(("values", "exactly", "with_error"), 0)
    for case in study.cases.values():
        changes = study.config.readings[reading].changes
        ranges = built(CaseBlock, overlaid(case.plain, changes)).search_range
        for name, printed in case.published.identified.items():
            held = encodable_values(getattr(ranges, name))
            ends = {"exactly": (printed, printed)}
            ends["with_error"] = (value_in_case(case, [name]) or ends["exactly"])[-2:]
            counts["values"] += 1
            for how, (low, high) in ends.items():
                # Doubles of decimal numbers.
                inside = (held >= low * (1 - 1e-9)) & (held <= high * (1 + 1e-9))
                counts[how] += bool(inside.any())
    return counts


def able(study: Study) -> str:
    """Return the first reading that can print the most of the paper's values with their errors."""
    return max(study.config.readings, key=lambda name: printable(study, name)["with_error"])


def factors(study: Study, found: Found, reading: str) -> Factors:
    """Return the factors of the likelihood of a reading, in the order of the tables."""
    factors: dict[tuple[int, str], tuple[float, float, int]] = {}
    for case, rows in _of(study, found, reading):
        table = case.published.table
        determined, scattered = (
            {name: _away(case, rows, name) for name in names[table]}
            for names in (_DETERMINED, _SCATTERED)
        )
        near = np.all([np.abs(away) <= _BASIN for away, _ in determined.values()], axis=0)
        factors[table, "basin"] = _factor(near.astype(float), 1.0)
        for name, (away, digits) in determined.items():
            spread = np.std(away[near], ddof=1) if near.sum() > 1 else _WIDTH
            width = np.hypot(spread * max(near.sum(), 1) ** -0.2, digits)
            factors[table, name] = _factor(np.exp(-0.5 * (away[near] / width) ** 2), width)
        for name, (away, _) in scattered.items():
            factors[table, name] = _factor(np.exp(-0.5 * (away / _WIDTH) ** 2), _WIDTH)
    return factors


def _of(study: Study, found: Found, reading: str) -> Iterator[tuple[Any, pd.DataFrame]]:
    """Yield the cases of the paper's tables with the rows of a reading."""
    for name, case in study.cases.items():
        if case.published.table in _DETERMINED:
            yield case, found[name][found[name]["reading"] == reading]


def _away(case: Case, rows: pd.DataFrame, name: str) -> tuple[Array, float]:
    """Return e-folds from the printed value, (n,), and the deviation that its digits leave."""
    told = value_in_case(case, name.split(" + "))
    assert told is not None
    value, low, high = told
    away = np.log(np.maximum(rows[name].to_numpy(float), 1e-12) / value)
    return away, float(np.log(high / low)) / np.sqrt(12)


def _factor(kernel: Array, width: float) -> tuple[float, float, int]:
    """Return log10 of the mean of kernels over their width, its variance, and their number."""
    count = len(kernel)
    mean = max(float(kernel.mean()) if count else 0.0, _FLOOR)
    variance = float(kernel.var(ddof=1)) / count / mean**2 if count > 1 else 0.0
    return float(np.log10(mean / width)), variance / np.log(10) ** 2, count


def likelihood_ratio(mine: Factors, base: Factors, without: int = 0) -> tuple[float, float]:
    """Return log10 of the ratio of two likelihoods, of all tables but one, and its error."""
    kept = [key for key in base if key[0] != without]
    ratio = sum(mine[key][0] - base[key][0] for key in kept)
    variance = sum(mine[key][1] + base[key][1] for key in kept)
    return ratio, 0.0 if mine is base else float(np.sqrt(variance))


def readings(study: Study, found: Found) -> ShownTable:
    """Compare what the readings can print, and how likely they make what the paper prints."""
    first, rows = able(study), []
    base = factors(study, found, first)
    for name, reading in study.config.readings.items():
        mine = base if name == first else factors(study, found, name)
        (all_of, error), (alone, error_alone) = (
            likelihood_ratio(mine, base, table) for table in (0, SHARED)
        )
        table, quantity = min(base, key=lambda key: mine[key][0] - base[key][0])
        row: Row = {"reading": reading.title, **printable(study, name)}
        row |= {"likelihood": all_of, "likelihood_error": error}
        row |= {"without_shared": alone, "without_shared_error": error_alone}
        row["least"] = mine[table, quantity][0] - base[table, quantity][0]
        row["decides"] = f"Table {table}, {quantity}" if name != first else ""
        row["counted"] = min(count for *_, count in mine.values())
        for case, rows_of_case in _of(study, found, name):
            column = f"last_improvement_{case.published.table}"
            row[column] = rows_of_case["last_improvement"].median()
        highest = max(all_of + _ERRORS * error, alone + _ERRORS * error_alone)
        few = "too few runs" if row["counted"] < _ENOUGH else "not excluded"
        row["verdict"] = "excluded" if highest < _EXCLUDED else few
        rows.append(row)
    columns = (
        *titled("reading", "values", "exactly", "with_error"),
        Column("likelihood", "log₁₀ likelihood", 2),
        Column("likelihood_error", "its error", 1),
        Column("without_shared", f"without Table {SHARED}", 2),
        Column("without_shared_error", "its error", 1),
        Column("decides", "Least factor"),
        Column("least", "its log₁₀", 2),
        Column("counted", "Runs that count"),
        *(Column(f"last_improvement_{n}", f"Last improvement, Table {n}") for n in _DETERMINED),
        Column("verdict", "By its likelihood"),
    )
    caption = (
        "Which reading of section 4 can have printed Tables 5 to 7. How many of their identified "
        "values the genes hold: exactly; or as another number that is printed so, with the "
        "printed error. Likelihood of the values: the product of the "
        "share of runs in the basin of the printed values and of densities there of each quantity; "
        f"log₁₀ less that of “{study.config.readings[first].title}”, with the standard error of "
        f"the simulation. Table {SHARED} shares k_p, c and their errors with Table 6, perhaps "
        "as one run. Least factor: the table and quantity that speak most against "
        f"it. Excluded: below {_EXCLUDED:g} with and without Table {SHARED}, {_ERRORS:g} errors "
        f"granted. Too few runs: fewer than {_ENOUGH} count in a factor. Last improvement: medians."
    )
    return ShownTable(caption, columns, rows)


_PANELS = (
    (5, "k", 10.0, "k, Table 5"),
    (6, "c", 3.5, "c, Table 6"),
    (7, "k", 3.5, "k, Table 7"),
)
"""Table, quantity, error in percent and heading of the claims on what runs find."""
_LEFT, _LAST = -12.0, 110.0
"""Ends of the axes of likelihoods and of generations."""


def draw_referee(study: Study, found: Found, compared: ShownTable) -> Figure:
    """Draw the likelihood of every reading, and what it makes of four of the paper's claims."""
    pairs = zip(study.config.readings, compared.rows, strict=True)
    ordered = sorted(pairs, key=lambda pair: pair[1]["likelihood"])
    drawn = figure(PAGE_IN, 1.0 + 0.14 * len(ordered))
    first, *claims, last = drawn.subplots(1, 2 + len(_PANELS), sharey=True, width_ratios=_RATIOS)
    first.axvline(_EXCLUDED, color=BLACK, linewidth=0.6, linestyle="--")
    last.axvspan(50, 70, color=SHADE, linewidth=0)
    for place, (name, row) in enumerate(ordered):
        look = {"color": GREY if row["verdict"] == "excluded" else BLUE, "markersize": 3}
        spread = _ERRORS * row["likelihood_error"]
        first.errorbar(max(row["likelihood"], _LEFT), place, xerr=spread, fmt="o", **look)
        for case, rows in _of(study, found, name):
            table = case.published.table
            last.plot(min(rows["last_improvement"].median(), _LAST), place, _MARKS[table], **look)
            for axes, (of, quantity, most, _) in zip(claims, _PANELS, strict=True):
                if of == table:
                    off = 100 * np.abs(rows[quantity] / case.parameters[quantity] - 1)
                    share, *ends = share_with_limits(int(np.sum(off <= most)), len(rows))
                    axes.plot(ends, [place, place], color=look["color"])
                    axes.plot(share, place, "o", **look)
    first.set_yticks(range(len(ordered)), [row["reading"] for _, row in ordered])
    first.set(ylim=(-1, len(ordered)), xlabel="log₁₀ L")
    panel(first, "a", "Tables 5 to 7")
    for letter, axes, (_, _, most, heading) in zip("bcd", claims, _PANELS, strict=True):
        axes.set(xlim=(0, 1), xlabel=f"within {most:g} %")
        panel(axes, letter, heading)
    last.set(xlim=(20, _LAST + 5), xlabel="generation")
    panel(last, "e", "last change")
    for table, mark in _MARKS.items():
        last.plot([], [], mark, color=BLUE, markersize=3, label=f"Table {table}")
    drawn.legend(*last.get_legend_handles_labels(), loc="outside lower right", ncols=3)
    return drawn


_MARKS = {5: "o", 6: "^", 7: "s"}
_RATIOS = 1.3, 1, 1, 1, 1.3


def found_by_readings(study: Study, found: Found) -> ShownTable:
    """Compare what the readings find in each sample."""
    rows: list[Row] = []
    for reading, block in study.config.readings.items():
        for case, mine in _of(study, found, reading):
            near = near_noise(mine, study)
            row: Row = {"case": case.name, "reading": block.title, "seeds": len(mine)}
            row |= zip(_SHARES, share_with_limits(int(near.sum()), len(mine)), strict=True)
            table = case.published.table
            for name in (*_DETERMINED[table], *_SCATTERED[table]):
                target = sum(case.parameters[part] for part in name.split(" + "))
                row[f"error_percent {name}"] = 100 * np.abs(mine[name] / target - 1).median()
            rows.append(row | {"last_improvement": mine["last_improvement"].median()})
    words = near_noise_words(study)
    columns = (
        *titled("case", "reading", "seeds"),
        *map(Column, _SHARES, (f"Share {words}", "95 % from", "to"), (2, 2, 2)),
        *(Column(f"error_percent {name}", f"Error {name} %", 2) for name in _JUDGED),
        Column("last_improvement", "Last improvement"),
    )
    caption = (
        "What the genetic algorithm finds under each reading. Errors: medians over runs of the "
        "absolute error. Last improvement: median generation."
    )
    return ShownTable(caption, columns, rows)


_JUDGED = "k", "k_p", "c", "c + c_p"
_SHARES = "near_noise_share", "near_noise_from", "near_noise_to"

if __name__ == "__main__":
    with logged(snakemake):
        of_paper = job_study(snakemake)
        files = paths(snakemake.input.found)
        of_paper = of_paper.of(dict.fromkeys(file.parent.name for file in files))
        all_found = read(of_paper, files)
        compared = readings(of_paper, all_found)
        write(compared, Path(snakemake.output.readings))
        write(found_by_readings(of_paper, all_found), Path(snakemake.output.found))
        with styled():
            save(draw_referee(of_paper, all_found, compared), *paths(snakemake.output.figure))
