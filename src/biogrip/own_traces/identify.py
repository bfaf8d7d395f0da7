"""The command ``biogrip identify``: the files it writes and the text it prints."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from biogrip.errors import BiogripError
from biogrip.files import refuse_inputs
from biogrip.identifiability.fit_status import REJECTED
from biogrip.own_traces.many_traces import Outcome, identify_traces, write_table
from biogrip.own_traces.one_trace import IdentifyOptions, check_trace_file
from biogrip.own_traces.outputs import check_output
from biogrip.own_traces.read_as import ReadAs
from biogrip.own_traces.rows_of_sheets import cases_of, with_row
from biogrip.own_traces.words import in_words, side_by_side
from biogrip.study.named_blocks import read_named_blocks
from biogrip.study.sheet import read_sheet
from biogrip.study.sheet_text import is_sheet
from biogrip.study.trace_file import trace_file_problem
from biogrip.terminal import visible


def identify(
    traces: Sequence[Path],
    model: str,
    read_as: ReadAs,
    config: Path | None,
    *,
    output: Path | None,
    report: Path | None,
    table: Path | None,
    fixed: Mapping[str, float],
    strict: bool,
    force: bool,
) -> int:
    """Identify traces, write the results, and print them.

    Parameters
    ----------
    traces
        CSV files of traces, and sheets that list some.
    model, read_as, config
        Fields of `IdentifyOptions`.
    output
        JSON file of a single trace. By default each trace has one beside it.
    report, table
        HTML and CSV file to write, if any.
    fixed
        Field of `IdentifyOptions`.
    strict
        If true, a rejected fit counts as a failure.
    force
        If true, replace even files that biogrip did not write.

    Returns
    -------
    int
        1 if any of several traces could not be used, or with `strict` if a fit is rejected.

    Raises
    ------
    BiogripError
        If an option or the config cannot be used, or the only trace cannot.
    """
    if len(traces) == 1:
        check_trace_file(traces[0])
    problems = {trace: trace_file_problem(trace) for trace in traces}
    absent = {str(trace): f"TRACE: {words}" for trace, words in problems.items() if words}
    there = [trace for trace in dict.fromkeys(traces) if str(trace) not in absent]
    options = IdentifyOptions((there or traces)[0], model, read_as, config, fixed)
    sheets = [trace for trace in there if is_sheet(trace)]
    every = _with_rows(options, there, sheets)
    alone = len(every) + len(absent) == 1
    if output is not None and not alone:
        raise BiogripError("--output: only for one trace; each of several gets its own file.")
    if every and (sheets or not alone or config is not None):
        # Errors of options and config concern all traces: raise them once, here.
        cases_of(every)
    outputs = [output or each.trace.with_suffix(".identified.json") for each in every]
    written = [*outputs, *filter(None, (report, table))]
    if len({path.absolute() for path in written}) < len(written):
        raise BiogripError("found the same file to be written twice; allowed are different ones.")
    read = [*traces, *(each.trace for each in every), *filter(None, [config])]
    refuse_inputs(written, read)
    for path in written:
        check_output(path, force=force)
    outcome = identify_traces(every, outputs, page=report is not None)
    outcome.refused.update(absent)
    if alone and outcome.refused:
        raise BiogripError(next(iter(outcome.refused.values())))
    if table is not None:
        write_table(outcome, table, {str(each.trace): each.row for each in every if each.row})
    if report is not None:
        from biogrip.own_traces.page import write_page

        write_page(outcome.on_page, outcome.refused, report)
    print(in_words(outcome.found[0]) if alone else _of_many(outcome))
    by_trace = {str(each.trace): path for each, path in zip(every, outputs, strict=True)}
    said = [by_trace[each["trace"]] for each in outcome.found]
    said += [path for path in (report, table) if path is not None]
    print(f"Written to {', '.join(map(visible, said))}.")
    rejected = strict and any(each["fit"] == REJECTED for each in outcome.found)
    return 1 if outcome.refused or rejected else 0


def _with_rows(
    options: IdentifyOptions, traces: Sequence[Path], sheets: Sequence[Path]
) -> list[IdentifyOptions]:
    """Return the options of every trace, those of a sheet in its place."""
    if not sheets:
        return [replace(options, trace=trace) for trace in traces]
    blocks = read_named_blocks(options.config)
    read = {path: read_sheet(path, blocks) for path in sheets}
    blocks.refuse_unused(name for each in read.values() for name in each.named)
    return [
        each
        for trace in traces
        for each in (
            [with_row(options, row) for row in read[trace].rows]
            if trace in read
            else [replace(options, trace=trace)]
        )
    ]


def _of_many(outcome: Outcome) -> str:
    return side_by_side(outcome.found, outcome.refused)
