"""The command ``biogrip identify``: the files it reads and writes, and the text it prints."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from biogrip.errors import BiogripError
from biogrip.files import refuse_inputs
from biogrip.identify.one_trace import identify_batch, identify_traces
from biogrip.identify.outputs import check_output, write_table
from biogrip.identify.settings import Asked, Setting, check_settings, is_table, read_table
from biogrip.identify.words import in_words, side_by_side
from biogrip.terminal import visible
from biogrip.traces.columns import trace_file_problem

MOST_DRAWN = 50
"""Most traces of which a page has pictures: with more it would be too large to be sent."""


def identify(
    files: Sequence[Path],
    config: Path | None = None,
    settings: Sequence[Setting] = (),
    *,
    output: Path | None = None,
    report: Path | None = None,
    table: Path | None = None,
    rows: tuple[int, int] | None = None,
) -> int:
    """Identify traces and tables of traces, write the results, and print them.

    Config and settings are those of all traces. `output` is the JSON file of a single trace, by
    default one beside each; `report` and `table` are HTML and CSV files to write, if any. `rows`
    are the first and last row of a table to identify, from 0, without JSON files; by default all.

    Return 1 if any of several traces could not be used. A `BiogripError` says that an option, the
    config or the only trace cannot.
    """
    alone = len(files) == 1
    asked: list[Asked] = []
    for file in dict.fromkeys(files):
        if trace_file_problem(file) is None and is_table(file):
            asked += read_table(file, config, settings)
            alone = False
        else:
            asked.append(Asked(file, config, tuple(settings)))
    if rows is not None:
        # The last may be beyond the end.
        asked = asked[rows[0] : rows[1] + 1]
    absent = {
        str(own.trace): f"{own.place}: {problem}"
        for own in asked
        if (problem := trace_file_problem(own.trace))
    }
    every = [own for own in asked if str(own.trace) not in absent]
    if alone and absent:
        raise BiogripError(absent[str(files[0])])
    if output is not None and not alone:
        raise BiogripError("--output: only for one trace; each of several gets its own file.")
    # Errors of options and config concern all traces: they are raised once, here.
    check_settings(every)
    outputs = [output or own.trace.with_suffix(".identified.json") for own in every]
    outputs = outputs if rows is None else []
    written = [*outputs, *filter(None, (report, table))]
    if len({path.absolute() for path in written}) < len(written):
        raise BiogripError("found the same file to be written twice; allowed are different ones.")
    refuse_inputs(written, [*files, *(own.trace for own in every), *filter(None, [config])])
    for path in written:
        check_output(path)
    drawn = report is not None and len(every) <= MOST_DRAWN
    if outputs:
        outcome = identify_traces(every, outputs, drawn=drawn)
    else:
        outcome = identify_batch(every, None, drawn=drawn)
    if alone and outcome.refused:
        raise BiogripError(outcome.refused[str(files[0])])
    copied = {str(own.trace): own.copied for own in asked}
    outcome = replace(outcome, refused=outcome.refused | absent, copied=copied)
    if table is not None:
        write_table(outcome, table)
    if report is not None:
        from biogrip.identify.page import write_page

        write_page(outcome, report)
    print(in_words(outcome.found[0]) if alone else side_by_side(outcome.found, outcome.refused))
    pairs = zip(every, outputs, strict=False)
    made = [path for own, path in pairs if str(own.trace) not in outcome.refused]
    if said := [visible(path) for path in (*made, report, table) if path]:
        print(f"Written to {', '.join(said)}.")
    return 1 if outcome.refused else 0
