"""The command ``biogrip identify``: the files it writes and the text it prints."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from biogrip.errors import BiogripError
from biogrip.files import refuse_inputs
from biogrip.identify.many_traces import identify_batch, identify_traces, write_table
from biogrip.identify.one_trace import IdentifyOptions, check_trace_file
from biogrip.identify.outputs import check_output
from biogrip.identify.read_as import ReadAs
from biogrip.identify.table_of_traces import Row, cases_of, is_table, read_table
from biogrip.identify.words import in_words, side_by_side
from biogrip.judging.doubts import REJECTED
from biogrip.terminal import visible
from biogrip.traces.columns import trace_file_problem


def identify(
    traces: Sequence[Path],
    model: str,
    read_as: ReadAs,
    config: Path | None,
    *,
    output: Path | None,
    report: Path | None,
    table: Path | None,
    rows: tuple[int, int] | None,
    fixed: Mapping[str, float],
    strict: bool,
    force: bool,
) -> int:
    """Identify traces, write the results, and print them.

    Parameters
    ----------
    traces
        CSV files of traces, and tables that list some.
    model, read_as, config
        Fields of `IdentifyOptions`.
    output
        JSON file of a single trace. By default each trace has one beside it.
    report, table
        HTML and CSV file to write, if any.
    rows
        First and last row of a single table to identify, from 0, in one process and without JSON
        files; by default all.
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
    options = IdentifyOptions(traces[0], model, read_as, config, fixed)
    tables = {trace: read_table(trace) for trace in traces if _is_table(trace)}
    if rows is not None:
        tables = {trace: _chosen(trace, every, rows) for trace, every in tables.items()}
        if len(traces) > 1 or not tables:
            raise BiogripError("--rows: only for one table of traces.")
    listed, copied = _with_rows(options, traces, tables)
    absent = {
        str(own.trace): f"{own.place if own.table else 'TRACE'}: {problem}"
        for own in listed
        if (problem := trace_file_problem(own.trace))
    }
    every = [own for own in listed if str(own.trace) not in absent]
    alone = len(traces) == 1 and not tables
    if output is not None and not alone:
        raise BiogripError("--output: only for one trace; each of several gets its own file.")
    if every and (not alone or config is not None):
        # Errors of options and config concern all traces: raise them once, here.
        cases_of(every)
    outputs = [output or each.trace.with_suffix(".identified.json") for each in every]
    outputs = outputs if rows is None else []
    written = [*outputs, *filter(None, (report, table))]
    if len({path.absolute() for path in written}) < len(written):
        raise BiogripError("found the same file to be written twice; allowed are different ones.")
    read = [*traces, *(each.trace for each in every), *filter(None, [config])]
    refuse_inputs(written, read)
    for path in written:
        check_output(path, force=force)
    page = report is not None
    if rows is None:
        outcome = identify_traces(every, outputs, page=page)
    else:
        outcome = identify_batch(every, None, page=page)
    outcome.refused.update(absent)
    if alone and outcome.refused:
        raise BiogripError(next(iter(outcome.refused.values())))
    if table is not None:
        write_table(outcome, table, copied)
    if report is not None:
        from biogrip.identify.page import write_page

        write_page(outcome.on_page, outcome.refused, report, copied)
    print(in_words(outcome.found[0]) if alone else side_by_side(outcome.found, outcome.refused))
    refused = outcome.refused
    said = [
        path for each, path in zip(every, outputs, strict=False) if str(each.trace) not in refused
    ]
    said += [path for path in (report, table) if path is not None]
    if said:
        print(f"Written to {', '.join(map(visible, said))}.")
    rejected = strict and any(each["fit"] == REJECTED for each in outcome.found)
    return 1 if outcome.refused or rejected else 0


def _is_table(trace: Path) -> bool:
    return trace_file_problem(trace) is None and is_table(trace)


def _chosen(table: Path, every: list[Row], rows: tuple[int, int]) -> list[Row]:
    """Return some rows of a table; the last may be beyond its end."""
    first, last = rows
    if not every[first : last + 1]:
        raise BiogripError(
            f"--rows: found {first}-{last}, allowed are some of the {len(every)} of "
            f"{visible(table)}, counted from 0."
        )
    return every[first : last + 1]


def _with_rows(
    options: IdentifyOptions, traces: Sequence[Path], tables: Mapping[Path, Sequence[Row]]
) -> tuple[list[IdentifyOptions], dict[str, Mapping[str, str]]]:
    """Return the options of every trace, those of a table in its place, and what is copied."""
    listed: list[IdentifyOptions] = []
    copied: dict[str, Mapping[str, str]] = {}
    for trace in dict.fromkeys(traces):
        if trace not in tables:
            listed.append(replace(options, trace=trace))
            copied[str(trace)] = {}
        for row in tables.get(trace, ()):
            own = replace(
                options, trace=row.file, settings=row.settings, table=trace, line=row.line
            )
            listed.append(own)
            copied[str(row.file)] = row.copied
    return listed, copied
