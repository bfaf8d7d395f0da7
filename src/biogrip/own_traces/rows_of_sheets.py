"""Rows of sheets as traces to identify, checked together before anything is fitted."""

import json
from collections.abc import Sequence
from dataclasses import replace

from biogrip.errors import BiogripError
from biogrip.own_traces.one_trace import IdentifyOptions, study_of
from biogrip.study.sheet import MOST_SHOWN, Row
from biogrip.study.study import Case
from biogrip.terminal import visible
from biogrip.traces.columns import place


def with_row(options: IdentifyOptions, row: Row) -> IdentifyOptions:
    """Return options for all traces as those of the trace of a row."""
    return replace(options, trace=row.file, row=row)


def cases_of(traces: Sequence[IdentifyOptions]) -> list[Case]:
    """Return the case of each trace; where the settings are the same, one serves all.

    Raises
    ------
    BiogripError
        With the places of the first few problems, if options, config or rows cannot be used, or
        rows read different quantities.
    """
    cases: dict[str, Case | None] = {}
    found: list[Case | None] = []
    problems: dict[str, None] = {}
    for options in traces:
        settings = json.dumps(options.settings, sort_keys=True)
        if settings not in cases:
            cases[settings] = None
            try:
                (cases[settings],) = study_of(options).cases.values()
            except BiogripError as error:
                problems[str(error)] = None
        found.append(cases[settings])
    if problems:
        raise BiogripError(_merged(list(problems)))
    usable = [case for case in found if case is not None]
    _refuse_mixed(
        traces, [f"a reading of {case.instrument.read.name}" for case in usable], "quantity read"
    )
    return usable


def refuse_mixed_models(traces: Sequence[IdentifyOptions], cases: Sequence[Case]) -> None:
    """Refuse traces whose sample models, or the names of whose known parameters, differ.

    Raises
    ------
    BiogripError
        With the first two that differ.
    """
    _refuse_mixed(traces, [f"the model {case.sample.candidate}" for case in cases], "model")
    known = [f"{', '.join(sorted(case.fixed)) or 'nothing'} known" for case in cases]
    _refuse_mixed(traces, known, "set of known parameters")


def _refuse_mixed(traces: Sequence[IdentifyOptions], said: Sequence[str], what: str) -> None:
    first = said[0]
    for options, words in zip(traces, said, strict=True):
        if words != first:
            raise BiogripError(
                f"{_place(options)}: found {words}, but {first} of {_place(traces[0])}; allowed is "
                f"one {what} for all traces of a command."
            )


def _place(options: IdentifyOptions) -> str:
    row = options.row
    return place(row.sheet, row.line) if row else visible(options.trace)


def _merged(errors: Sequence[str]) -> str:
    """Return messages as one, with a heading that they share once and the first few lines."""
    if len(errors) == 1:
        return errors[0]
    lines = list(dict.fromkeys(line for text in errors for line in text.split("\n")))
    more = len(lines) - MOST_SHOWN
    return "\n".join(lines[:MOST_SHOWN] + ([f"... and {more} more."] if more > 0 else []))
