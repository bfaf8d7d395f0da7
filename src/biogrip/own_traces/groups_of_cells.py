"""The command ``biogrip groups``: recorded traces of cells, compared between groups of cells."""

import json
from collections.abc import Iterable, Mapping, Sequence
from math import exp
from pathlib import Path
from typing import Any

from biogrip import __version__
from biogrip.digits import rounded_numbers
from biogrip.errors import BiogripError, nearest
from biogrip.files import refuse_inputs, write_text
from biogrip.groups.group_findings import (
    USUAL_POWER,
    GroupDifference,
    GroupFinding,
    differences_of_groups,
    findings_of_groups,
)
from biogrip.groups.population import FEWEST_CELLS
from biogrip.identifiability.fit_status import DOUBTFUL, OK, REJECTED
from biogrip.identify.case_problem import CaseProblem
from biogrip.own_traces.assumed import gripper_in_limits
from biogrip.own_traces.judged_cells import CellJudge, CellResults, same_readings
from biogrip.own_traces.one_trace import IdentifyOptions, fixed_data
from biogrip.own_traces.outputs import WRITTEN_BY, check_output, in_own_units
from biogrip.own_traces.read_as import ReadAs
from biogrip.own_traces.rows_of_sheets import cases_of, refuse_mixed_models, with_row
from biogrip.own_traces.words import fixed_in_words, in_unit
from biogrip.progress import Progress
from biogrip.study.named_blocks import read_named_blocks
from biogrip.study.sheet import Cell, cells_of, read_sheet
from biogrip.study.study import Case
from biogrip.study.trace_file import trace_file_problem
from biogrip.terminal import aligned, visible, visible_lines

_LIMITS = (
    "Limits are statistical only: all cells share the gripper, whose uncertainty changes their "
    "values alike, and ratios hardly."
)
_LIMITS_OF_SEVERAL = (
    "Limits are statistical only: the grippers, which differ from trace to trace, are taken as "
    "exact."
)


def groups(
    table: Path,
    model: str,
    read_as: ReadAs,
    config: Path | None,
    *,
    by: str | None,
    exclude: Sequence[str],
    fixed: Mapping[str, float],
    output: Path | None,
    force: bool,
) -> int:
    """Compare the groups of cells that a sheet lists, write the results, and print them.

    Parameters
    ----------
    table
        The sheet, see `read_sheet`.
    model, read_as, config
        Fields of `IdentifyOptions`.
    by
        Name of the factor that makes groups, see `cells_of`.
    exclude
        Names of cells to leave out.
    fixed
        Field of `IdentifyOptions`.
    output
        JSON file. By default it is beside the table.
    force
        If true, replace even a file that biogrip did not write.

    Returns
    -------
    int
        1 if any trace could not be used.

    Raises
    ------
    BiogripError
        If options, config, table or all traces cannot be used.
    """
    if problem := trace_file_problem(table):
        raise BiogripError(f"TABLE: {problem}")
    blocks = read_named_blocks(config)
    sheet = read_sheet(table, blocks)
    blocks.refuse_unused(sheet.named)
    factor, cells = cells_of(sheet, by)
    cells = _without(cells, exclude)
    written = output or table.with_suffix(".compared.json")
    traces = [row.file for row in sheet.rows]
    refuse_inputs([written], [table, *traces, *filter(None, [config])])
    check_output(written, force=force)
    options = IdentifyOptions(table, model, read_as, config, fixed=fixed)
    found = compare_groups(options, cells, factor, written)
    print(visible_lines(in_words(found)))
    print(f"Written to {visible(written)}.")
    return 1 if found["skipped"] else 0


def compare_groups(
    options: IdentifyOptions, cells: Sequence[Cell], factor: str, output: Path
) -> dict[str, Any]:
    """Identify every cell from all its traces, and compare the groups of cells.

    Traces that cannot be used are left out and listed under ``skipped``.

    Parameters
    ----------
    options
        Options for all traces; its own trace is the sheet.
    cells
        Cells with their rows of the sheet.
    factor
        Name of the factor that makes the groups.
    output
        JSON file to write; it holds the returned value with rounded numbers.

    Raises
    ------
    BiogripError
        If an option or the config cannot be used, or no trace can.
    """
    # Errors of options and config concern all traces: raise them once, here.
    rows = [with_row(options, row) for cell in cells for row in cell.rows]
    cases = cases_of(rows)
    refuse_mixed_models(rows, cases)
    confidence = cases[0].confidence
    progress = Progress(str(options.trace), len(cells))
    judge = CellJudge(options, confidence, progress.within)
    results: list[CellResults] = []
    for cell in cells:
        progress.doing(f"cell {cell.name}")
        results.append(judge.judged(cell))
        progress.done()
    found = {
        **header(options, cases, factor),
        **compared(results, cells, str(options.trace), confidence),
    }
    read = cases[0].problem.instrument.read
    written = in_own_units(rounded_numbers(found), read)
    write_text(output, json.dumps(written, indent=1) + "\n")
    return found


def header(options: IdentifyOptions, cases: Sequence[Case], factor: str) -> dict[str, Any]:
    """Return what is common to all cells of a sheet, as plain data.

    Parameters
    ----------
    options
        Options for all traces; its own trace is the sheet.
    cases
        Case of each trace.
    factor
        Name of the factor that makes the groups.
    """
    case_problem = cases[0].problem
    fixed = [fixed_data(case.problem) for case in cases]
    one_gripper = all(case.block.gripper == cases[0].block.gripper for case in cases)
    read = case_problem.instrument.read
    return {
        WRITTEN_BY: __version__,
        "table": str(options.trace),
        "by": factor,
        "model": case_problem.model.name,
        "model_title": case_problem.model.title,
        "confidence": cases[0].confidence,
        **(fixed[0] if fixed[1:] == fixed[:-1] else {}),
        "reads": {"quantity": read.name, "unit": read.unit},
        "limits": _limits(case_problem, one_gripper=one_gripper),
    }


def compared(
    results: Sequence[CellResults], cells: Sequence[Cell], sheet: str, confidence: float
) -> dict[str, Any]:
    """Return populations of groups and differences between them, as plain data.

    Parameters
    ----------
    results
        Results of each cell.
    cells
        All cells of the sheet; the group of the first is the reference, even if it is empty.
    sheet
        Name of the sheet, for messages.
    confidence
        Confidence level of all limits, e.g. 0.95.

    Raises
    ------
    BiogripError
        If no trace can be used, or the fits of all cells are rejected.
    """
    results = _without_copies(results)
    judged = [each for each in results if each.data is not None]
    skipped = [one for each in results for one in each.skipped]
    if not judged:
        raise BiogripError(
            f"{visible(sheet)}: none of its traces can be used; the first: {skipped[0]['reason']}"
        )
    data = [each.data for each in judged if each.data is not None]
    fixed = [own.get("fixed") for own in data]
    if fixed[1:] == fixed[:-1]:
        # What is the same for all cells is said once.
        data = [{key: own[key] for key in own if key != "fixed"} for own in data]
    # The reference group is the first in the table, even if none of its traces can be used.
    names = list(dict.fromkeys(cell.group for cell in cells))
    status = {own["cell"]: own["fit"] for own in data}
    kept = [each.judged for each in judged if status[each.judged.name] != REJECTED]
    if not kept:
        raise BiogripError(
            f"{visible(sheet)}: the fits of all cells are rejected; the first: "
            f"{data[0]['reasons'][0]}"
        )
    findings = findings_of_groups(kept, names, confidence)
    certain = [cell for cell in kept if status[cell.name] == OK]
    without = findings_of_groups(certain, names, confidence) if certain else []
    return {
        "cells": data,
        "groups": [_group_data(finding) for finding in findings],
        "differences": [_difference_data(each) for each in differences_of_groups(findings)],
        "rejected": [name for name, own in status.items() if own == REJECTED],
        "doubtful": [name for name, own in status.items() if own == DOUBTFUL],
        "differences_without_doubtful": [
            _difference_data(each) for each in differences_of_groups(without)
        ],
        "skipped": skipped,
    }


def _without_copies(results: Sequence[CellResults]) -> list[CellResults]:
    """Leave out cells with readings of an earlier one: copies of a file would feign agreement."""
    first: dict[str, str] = {}
    kept = []
    for each in results:
        own = each
        for digest, file in each.readings.items():
            before = first.setdefault(digest, file)
            if before != file and own.data is not None:
                own = own.left_out(file, same_readings(file, before))
        kept.append(own)
    return kept


def _limits(case_problem: CaseProblem, *, one_gripper: bool) -> str:
    if not case_problem.instrument.has_jaws:
        return gripper_in_limits(case_problem)
    return _LIMITS if one_gripper else _LIMITS_OF_SEVERAL


def in_words(found: dict[str, Any]) -> str:
    """Return the result of `compare_groups` as tables in plain text."""
    percent = f"{100 * found['confidence']:g} %"
    parts = [f"{visible(found['table'])}: {found['model_title']}, {percent} limits"]
    parts += [found["limits"], *fixed_in_words(found)]
    parts += [_cell_in_words(cell, found) for cell in found["cells"]]
    parts.append(_groups_in_words(found["groups"], percent))
    parts += _not_determined_in_words(found["groups"])
    if found["rejected"]:
        parts.append(f"Left out, as their fits are rejected: {', '.join(found['rejected'])}.")
    if found["differences"]:
        parts.append(_differences_in_words(found["differences"], percent))
    elif len({row["group"] for row in found["groups"]}) > 1:
        parts.append(
            f"No quantity is determined in {FEWEST_CELLS} cells or more of two groups: "
            "nothing is compared."
        )
    if found["doubtful"]:
        names = ", ".join(found["doubtful"])
        rows = found["differences_without_doubtful"]
        compared = _differences_in_words(rows, percent) if rows else "too few cells to compare."
        parts.append(f"Without the cells whose fits are doubtful, {names}:\n{compared}")
    parts += [f"Skipped: {each['reason']}" for each in found["skipped"]]
    return "\n\n".join(parts)


def _without(cells: list[Cell], exclude: Sequence[str]) -> list[Cell]:
    """Return the cells without some, which must be there and not be all.

    Raises
    ------
    BiogripError
        With the nearest name if there is no such cell.
    """
    names = [cell.name for cell in cells]
    for name in exclude:
        if name not in names:
            raise BiogripError(
                f"--exclude: found '{name}'.{nearest(name, names)} Allowed: {', '.join(names)}."
            )
    kept = [cell for cell in cells if cell.name not in exclude]
    if not kept:
        raise BiogripError("--exclude: found all cells, allowed is to keep one at least.")
    return kept


def _group_data(finding: GroupFinding) -> dict[str, Any]:
    known, population = finding.estimates, finding.population
    data: dict[str, Any] = {
        "group": finding.group,
        "quantity": finding.quantity,
        "unit": finding.unit,
        "determined": [
            {"cell": cell, "value": exp(value), "log_deviation": float(deviation)}
            for cell, value, deviation in zip(
                known.cells, known.log_values, known.deviations, strict=True
            )
        ],
        "not_determined": list(finding.others),
        "bounded": list(finding.bounded),
    }
    if population is not None:
        middle, spread = population.centre, population.spread
        data |= {
            "median": exp(middle.centre),
            "low": exp(middle.low),
            "high": exp(middle.high),
            "spread": {
                "log_deviation": spread.centre,
                "low": spread.low,
                "high": spread.high,
            },
            "shrunk": [
                {
                    "cell": cell,
                    "value": exp(own.centre),
                    "low": exp(own.low),
                    "high": exp(own.high),
                }
                for cell, own in finding.shrunk
            ],
        }
    return data


def _difference_data(each: GroupDifference) -> dict[str, Any]:
    apart, ranks = each.difference, each.ranks
    return {
        "quantity": each.quantity,
        "group": each.group,
        "against": each.against,
        "ratio": apart.ratio,
        "low": apart.low,
        "high": apart.high,
        "degrees_of_freedom": apart.freedom,
        "p": apart.p_value,
        "adjusted_p": each.adjusted_p,
        "by_ranks": {
            "ratio": exp(ranks.estimate),
            "low": None if ranks.low is None else exp(ranks.low),
            "high": None if ranks.high is None else exp(ranks.high),
        },
        "detectable_ratio": each.detectable_ratio,
    }


def _cell_in_words(cell: dict[str, Any], found: dict[str, Any]) -> str:
    width = max(len(item["quantity"]) for item in cell["quantities"])
    lines = [f"{cell['cell']} ({cell['group']}): fit {cell['fit']}"]
    lines += [
        f"  {Path(trace['file']).name}: noise {in_unit(trace['noise_rad'], found)}"
        for trace in cell["traces"]
    ]
    lines += [f"  {item['quantity']:<{width}}  {item['in_words']}" for item in cell["quantities"]]
    lines += [f"  {words}" for words in fixed_in_words(cell)]
    lines += [f"  {note['weight'].capitalize()}: {note['text']}" for note in cell["notes"]]
    return "\n".join(lines)


def _groups_in_words(rows: list[dict[str, Any]], percent: str) -> str:
    header, table = group_rows(rows, percent)
    return aligned(table, header)


def group_rows(rows: Iterable[dict[str, Any]], percent: str) -> tuple[list[str], list[list[str]]]:
    """Return header and rows of a table of groups and their medians.

    Parameters
    ----------
    rows
        What `compare_groups` returns under ``groups``.
    percent
        Confidence of the limits in words.
    """
    table = []
    for row in rows:
        cells = len(row["determined"])
        line = [row["group"], row["quantity"], f"{cells} of {cells + len(row['not_determined'])}"]
        if "median" in row:
            spread = row["spread"]
            line += [
                f"{row['median']:.3g} {row['unit']}".rstrip(),
                f"{row['low']:.3g} to {row['high']:.3g}",
                f"{exp(spread['log_deviation']):.2f}",
                f"{exp(spread['low']):.2f} to {exp(spread['high']):.2f}",
            ]
        table.append(line)
    header = [
        *("group", "quantity", "cells that determine it"),
        *("median", f"{percent} interval", "spread, times", f"{percent} interval"),
    ]
    return header, table


def _not_determined_in_words(rows: list[dict[str, Any]]) -> list[str]:
    """Name the cells that do not determine a quantity, and what they add to its median."""
    words = []
    for row in rows:
        flat = [cell for cell in row["not_determined"] if cell not in row["bounded"]]
        said = [
            f"{what}: {', '.join(cells)}"
            for what, cells in (
                ("only their bound counts", row["bounded"]),
                ("next to nothing is known", flat),
            )
            if cells and "median" in row
        ]
        words += [f"{row['group']}, {row['quantity']}: {'; '.join(said)}."] if said else []
    return ["\n".join(words)] if words else []


def _differences_in_words(rows: list[dict[str, Any]], percent: str) -> str:
    header, table = difference_rows(rows, percent)
    return aligned(table, header)


def difference_rows(
    rows: Iterable[dict[str, Any]], percent: str
) -> tuple[list[str], list[list[str]]]:
    """Return header and rows of a table of differences; arguments as of `group_rows`."""
    table = []
    for row in rows:
        ranks = row["by_ranks"]
        by_ranks = f"{ranks['ratio']:.3g}"
        if ranks["low"] is not None:
            by_ranks += f" ({ranks['low']:.3g} to {ranks['high']:.3g})"
        table.append(
            [
                row["quantity"],
                f"{row['group']} over {row['against']}",
                f"{row['ratio']:.3g}",
                f"{row['low']:.3g} to {row['high']:.3g}",
                f"{row['p']:.2g}",
                f"{row['adjusted_p']:.2g}",
                by_ranks,
                f"{row['detectable_ratio']:.3g}",
            ]
        )
    header = [
        *("quantity", "groups", "ratio of medians", f"{percent} interval", "p", "adjusted p"),
        *("by ranks", f"ratio found in {100 * USUAL_POWER:g} %"),
    ]
    return header, table
