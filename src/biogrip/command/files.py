"""The command ``biogrip identify``: the files it reads and writes, and the text it prints.

Traces are identified in batches, several processes at once. One that fails, or whose process is
killed, costs no other its result, and what is done is not done again.
"""

import os
import sys
import traceback
from base64 import b64decode
from collections import defaultdict
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from biogrip import __version__
from biogrip.command.options import Setting
from biogrip.command.outputs import (
    WRITTEN_BY,
    Outcome,
    as_written,
    check_outputs,
    read_result,
    table_of,
    write_result,
)
from biogrip.command.settings import Asked, check_settings, is_table, read_trace
from biogrip.command.words import in_columns, in_words, load_in_words
from biogrip.config.case import SampleCase
from biogrip.config.loading import trace_defaults
from biogrip.errors import BiogripError
from biogrip.files import atomic_write, digest_of, software, write_rows
from biogrip.fit.experiment import Experiment
from biogrip.fit.problem import SearchRange
from biogrip.identify.data import trace_data
from biogrip.identify.identify import STEPS, budget, identify_alike
from biogrip.identify.prepare import Trace, prepare
from biogrip.judging.diagnosis import Diagnosis
from biogrip.keys import plain
from biogrip.terminal import Progress, end_with, visible
from biogrip.traces.columns import trace_file_problem
from biogrip.traces.reader import form_in_words, is_usual

if TYPE_CHECKING:
    from biogrip.identify.together import Together

MOST_DRAWN = 50
"""Most traces of which a page has pictures: with more it would be too large to be sent."""

# Most traces of a batch, and most readings that are fitted together, of short traces.
_MOST_IN_BATCH, _MOST_READINGS = 25, 200_000

# Keys of a trace's result that a sample of several has not.
_OF_ONE_TRACE = {"read_as", "load", "onset_s", "onset_limits_s", "contact_m", "contact_limits_m"}
_OF_ONE_TRACE |= {"offset_rad", "drift_rad_per_s", "jaw_force"}

_KILLED = "a process was killed, perhaps because memory ran out"

J = TypeVar("J")
T = TypeVar("T")


def identify_files(
    files: Sequence[Path],
    config: Path | None = None,
    settings: Sequence[Setting] = (),
    *,
    output: Path | None = None,
    report: Path | None = None,
    table: Path | None = None,
    plot: Path | None = None,
    rows: tuple[int, int] | None = None,
    together: bool = False,
) -> int:
    """Identify traces and tables of traces, write the results, and print them.

    Config and settings are those of all traces. `output` is the JSON file of a single trace, by
    default one beside each; `report`, `table` and `plot` are HTML, CSV and PNG files, if any.
    `rows` are the first and last sample of a table to identify, from 0, without JSON files; by
    default all. With `together` all traces are of one sample.

    Return 1 if any of several traces could not be used. A `BiogripError` says that an option, the
    config or the only trace cannot.
    """
    asked = traces_of(files, config, settings, together=together)
    alone = together or (len(files) == 1 and asked[0].place == Asked.place)
    if rows is not None:
        # The last may be beyond the end.
        asked = asked[rows[0] : rows[1] + 1]
    if output is not None and not alone:
        raise BiogripError("--output: only for one trace; each of several gets its own file.")
    if plot is not None and not (alone and plot.suffix == ".png"):
        text = f"found {visible(plot)}; allowed is a name that ends with .png, of one trace."
        raise BiogripError(f"--plot: {text} For several there is --report.")
    for trace in asked[0].traces if alone else ():
        trace.refuse_missing()
    # Errors of options and config concern all traces: they are raised once, here.
    check_settings(asked)
    outputs = [output or sample.output for sample in asked] if rows is None else []
    names = [sample.name for sample in asked]
    written = [*zip(names, outputs, strict=False), ("--report", report), ("--csv", table)]
    read = [trace.trace for sample in asked for trace in sample.traces]
    check_outputs(written, [*files, *read, *filter(None, [config])])
    drawn = len(asked) if (report or plot) and len(asked) <= MOST_DRAWN else 0
    outcome = _identify_traces(asked, outputs or None, drawn=drawn)
    if alone and outcome.refused:
        raise BiogripError(outcome.refused[names[0]])
    outcome = replace(outcome, copied={sample.name: sample.copied for sample in asked})
    if table is not None:
        write_rows(table, *table_of(outcome))
    if report is not None:
        from biogrip.command.page import write_page

        write_page(outcome, report)
    if plot is not None and (pictures := outcome.pictures.get(names[0])):
        with atomic_write(plot) as scratch:
            scratch.write_bytes(b64decode(pictures[0].partition(",")[2]))
    print(in_words(outcome.found[0]) if alone else in_columns(outcome.found, outcome.refused))
    pairs = zip(names, outputs, strict=False)
    made = [path for name, path in pairs if name not in outcome.refused]
    if said := [visible(path) for path in (*made, report, table, plot) if path]:
        print(f"Written to {', '.join(said)}.")
    return 1 if outcome.refused else 0


def traces_of(
    files: Sequence[Path],
    config: Path | None,
    settings: Sequence[Setting],
    *,
    together: bool = False,
) -> list[Asked]:
    """Return the traces of files, of which some may be tables of traces, or their samples."""
    asked = [Asked(file, config, tuple(settings)) for file in dict.fromkeys(files)]
    tables = {one.trace for one in asked if not trace_file_problem(one.trace) and is_table(one)}
    if not (together or tables):
        return asked
    # Imported here: one trace has no use for it.
    from biogrip.command.sheet import by_sample, read_table

    rows: list[Asked] = []
    for one in asked:
        rows += read_table(one.trace, config, settings) if one.trace in tables else [one]
    return [*by_sample(rows, together=together)]


def _identify_traces(
    asked: Sequence[Asked], outputs: Sequence[Path] | None, *, drawn: int
) -> Outcome:
    """Identify traces in batches, several processes at once, and write a JSON file of each.

    What such files have of the same trace, settings and software is taken from there, but if
    `drawn`, the number of traces of which a page has pictures. Errors of those that fail are
    collected. Without JSON files, as a job of a workflow, it is one batch.
    """
    if len(asked) <= 1 or outputs is None:
        return identify_batch(asked, outputs, drawn=drawn)
    jobs = [*zip(asked, outputs, strict=True)]
    known: dict[str, dict[str, Any]] = {}
    for sample, path in [] if drawn else jobs:
        with suppress(BiogripError):
            known[sample.name] = read_result(path, _made_from(sample))
    if known:
        text = f"{len(known)} of {len(asked)} traces are taken from their JSON files, as they and"
        print(f"{text} what is asked have not changed.", file=sys.stderr)
    left = [job for job in jobs if job[0].name not in known]
    processors = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else 2
    size = max(1, min(_MOST_IN_BATCH, -(-len(left) // processors)))
    batches = [left[start : start + size] for start in range(0, len(left), size)]
    work = partial(_identify_jobs, drawn=drawn)
    every, count = Outcome([], {}), len(known)
    for batch, outcome in zip(batches, side_by_side(work, batches, processors), strict=True):
        pieces = [(batch, outcome)]
        if outcome is None:
            # One of its traces may have asked for more memory than there is.
            print(f"biogrip: {_KILLED}; its traces are identified one by one.", file=sys.stderr)
            pieces = [([job], next(side_by_side(work, [[job]], 1))) for job in batch]
        for piece, told in pieces:
            name = piece[0][0].name
            text = f"{visible(name)}: {_KILLED}, twice; the same command tries it again."
            told = told or Outcome([], {name: text})
            known.update({result["trace"]: as_written(result) for result in told.found})
            every.refused.update(told.refused)
            every.pictures.update(told.pictures)
            for sample, _ in piece:
                count += 1
                print(f"{count} of {len(asked)}: {visible(sample.name)}", file=sys.stderr)
    every.found.extend(known[sample.name] for sample in asked if sample.name in known)
    return every


def _identify_jobs(jobs: Sequence[tuple[Asked, Path]], *, drawn: int) -> Outcome:
    asked, outputs = zip(*jobs, strict=True)
    return identify_batch(asked, outputs, drawn=drawn)


def side_by_side(work: Callable[[J], T], jobs: Sequence[J], most: int) -> Iterator[T | None]:
    """Yield what work gives of each job, in their order; None from where a process was killed on.

    At most some are done at once, in processes that are forked, and end when this one does, however
    that ends. An error that work raises is raised here.
    """
    # Imported here: one trace has no use for them.
    from concurrent.futures import ProcessPoolExecutor
    from concurrent.futures.process import BrokenProcessPool
    from multiprocessing import get_all_start_methods, get_context

    if "fork" not in get_all_start_methods():  # on Windows
        yield from map(work, jobs)
        return
    with ProcessPoolExecutor(most, get_context("fork"), end_with, (os.getpid(),)) as pool:
        try:
            for future in [pool.submit(work, job) for job in jobs]:
                try:
                    yield future.result()
                except BrokenProcessPool:
                    yield None
        finally:
            pool.shutdown(cancel_futures=True)


def _made_from(asked: Asked) -> str:
    """Return in one line what the result of a trace follows from."""
    if asked.together:
        return "; ".join(map(_made_from, asked.together))
    trace, default = digest_of(asked.trace), digest_of(trace_defaults())
    return repr((software(), default, str(asked.trace), trace, asked.given))


def identify_batch(
    asked: Sequence[Asked], outputs: Sequence[Path] | None, *, drawn: int = 0
) -> Outcome:
    """Identify the traces of one batch, see `identify_files`; None to write no JSON files."""
    alone = len(asked) == 1 and outputs is not None
    # Before anything is read: what is changed meanwhile is identified again.
    made_from = [] if outputs is None else [*map(_made_from, asked)]
    every = [(index, trace) for index, own in enumerate(asked) for trace in own.traces]
    read: dict[int, tuple[SampleCase, Trace]] = {}
    refused: dict[str, str] = {}
    outcome = Outcome([], {})
    with Progress(asked[0].name if alone else "", 1 + STEPS, live=alone, quiet=not alone) as told:
        for number, (index, trace) in enumerate(every):
            with _caught(asked[index], refused):
                recording, case = read_trace(trace)
                if not is_usual(recording):
                    told.note(form_in_words(trace.trace, recording.form))
                read[number] = case, prepare(recording, case.judged_experiment)
        read = {of: it for of, it in read.items() if asked[every[of][0]].name not in refused}
        of_each = [asked[of] for of, _ in every]
        diagnosed = dict(_diagnosed(of_each, read, refused, told))
        for index, sample in enumerate(asked):
            parts = {}
            with _caught(sample, refused):
                for number in (number for number, (of, _) in enumerate(every) if of == index):
                    if number in diagnosed:
                        trace, diagnosis = every[number][1], diagnosed[number]
                        data = data_of(diagnosis, read[number][0], trace.name, trace.given)
                        parts[trace.name] = diagnosis, data
                if sample.together and sample.name not in refused:
                    diagnosis, data = sample_of(sample.name, parts)
            if sample.name in refused:
                continue
            outcome.found.append(data)
            if outputs is not None:
                write_result(outputs[index], data, made_from[index])
            if drawn:
                # Imported here: loading Matplotlib takes long.
                from biogrip.command.page import MOST_OPEN, trace_pictures

                # What is found counts without a picture, too.
                with _caught(sample, {}):
                    pictures = trace_pictures(diagnosis, data, of_many=drawn > MOST_OPEN)
                    outcome.pictures[sample.name] = pictures
    in_order = (sample.name for sample in asked if sample.name in refused)
    outcome.refused.update((name, refused[name]) for name in in_order)
    return outcome


def _diagnosed(
    asked: Sequence[Asked],
    read: Mapping[int, tuple[SampleCase, Trace]],
    refused: dict[str, str],
    progress: Progress,
) -> Iterator[tuple[int, Diagnosis]]:
    """Yield diagnoses of traces with their places, and add messages on those that fail."""
    alike = defaultdict[Hashable, list[int]](list)
    for index, (_, (recording, experiment)) in read.items():
        few = len(recording.time_s) * _MOST_IN_BATCH <= _MOST_READINGS
        alike[budget(experiment), None if few else index].append(index)

    groups = [*alike.values()]
    for group in groups:
        traces, failed = [read[index][1] for index in group], dict[str, str]()
        diagnoses: list[Diagnosis] = []
        with _caught(asked[group[0]], failed):
            diagnoses = identify_alike(traces, progress.within, progress.doing)
        yield from zip(group, diagnoses, strict=False)
        # An error is of one of a group: it is then identified one by one.
        if failed and len(group) > 1:
            groups += ([index] for index in group)
        else:
            refused |= failed


@contextmanager
def _caught(asked: Asked, refused: dict[str, str]) -> Iterator[None]:
    """Take the error by which work on a trace fails, whatever that is, for its message."""
    try:
        yield
    except BiogripError as error:
        refused[asked.name] = str(error)
    except BrokenPipeError:
        # Whoever reads the progress has gone.
        raise
    except Exception as error:
        where = traceback.extract_tb(error.__traceback__)[-1]
        refused[asked.name] = (
            f"{visible(asked.name)}: the fit failed, which is a fault of biogrip and not of the "
            f"trace: {type(error).__name__}: {error} ({Path(where.filename).name}, line "
            f"{where.lineno}). Please report it, with the trace if it may be shared."
        )


def data_of(
    diagnosis: Diagnosis, case: SampleCase, trace: str, given: Mapping[str, Any]
) -> dict[str, Any]:
    """Return all that is said of a trace as plain data, with a config that repeats it.

    Given are the blocks of the config that the user has set.
    """
    recording, experiment = diagnosis.identified
    load = load_in_words((recording, experiment), case, given)
    tried = diagnosis.models.answers if diagnosis.models else ()
    return {
        WRITTEN_BY: __version__,
        "trace": trace,
        **({} if is_usual(recording) else {"read_as": recording.form}),
        **({"load": load} if load else {}),
        **trace_data(diagnosis),
        "without_model": diagnosis.without_model(case.block.identifiability.at_s).data(),
        "assumed": _assumed(experiment, case, list(tried or case.models)),
        # What the user does not set; uncertainties are no gripper.
        "by_default": [
            name
            for name in ("gripper", "protocol")
            if case.instrument.has_jaws and not {*(given.get(name) or ())} - {"uncertainty"}
        ],
        "versions": {name: it for name, it in software().items() if name != "source"},
    }


def sample_of(
    name: str, traces: Mapping[str, tuple[Diagnosis, dict[str, Any]]]
) -> tuple["Together", dict[str, Any]]:
    """Identify a sample from traces that were; return it, and all that is said of it as plain data.

    Of each trace, by name, there are its diagnosis and its `data_of`.
    """
    # Imported here: most traces are each of its sample.
    from biogrip.identify.together import identify_sample_of

    diagnoses, said = zip(*traces.values(), strict=True)
    sample = identify_sample_of([*traces], diagnoses)
    shared = {key: it for key, it in said[0].items() if key not in _OF_ONE_TRACE}
    at_s = shared["assumed"]["identifiability"]["at_s"]
    without = {"without_model": sample.without_model(at_s).data(), "traces": [*said]}
    return sample, {**shared, "trace": name, **sample.data(), **without}


def _assumed(found: Experiment, case: SampleCase, tried: Sequence[str]) -> dict[str, Any]:
    """Return what an identification relies on, as a config that repeats it."""
    asked = case.block.identifiability
    blocks = ["instrument", "protocol", "search_range", "measurement", "least_squares"]
    blocks += ["gripper"] if case.instrument.has_jaws else []
    if case.record is not None or case.instrument.sweeps:
        blocks.remove("protocol")
    terms: dict[str, Any] = {"offset": found.offset, "drift": found.drift}
    left_out = {name: it for name, it in terms.items() if it != getattr(case.experiment, name)}
    block = replace(
        case.block,
        search_range=SearchRange(**found.ranges),
        measurement=replace(case.block.measurement, **left_out),
    )
    return {
        "sample": {"model": case.sample.name, "branches": case.sample.branches},
        **{name: plain(getattr(block, name)) for name in blocks},
        **({"actuator": plain(case.common.actuator)} if case.instrument.has_jaws else {}),
        "fixed": case.block.fixed,
        "identifiability": {key: plain(getattr(asked, key)) for key in ("confidence", "at_s")},
        "model_selection": {"models": list(tried)},
        "study_seed": case.common.study_seed,
    }
