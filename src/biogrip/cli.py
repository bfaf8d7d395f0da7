"""The ``biogrip`` command: one subcommand per stage, as the workflow calls them, and `identify`."""

import argparse
import json
import os
import signal
import sys
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from types import FrameType
from typing import Any

from biogrip import __version__
from biogrip.errors import BiogripError
from biogrip.files import refuse_inputs, watched
from biogrip.running.journal import recorded_in

RESULTS = Path("results")
_OUTPUTS = {"output", "history", "timing", "traces"}

# Imports of stages stay inside their command: a job pays only for what it uses.


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; return its exit status."""
    given = sys.argv[1:] if arguments is None else list(arguments)
    parser = _parser()
    if given[:1] == ["run"] and not {"-h", "--help"} & set(given):
        # What follows is for Snakemake to read.
        options = parser.parse_args(given[:1])
        options.rest = given[1:]
    else:
        options = parser.parse_args(given)
    signal.signal(signal.SIGTERM, _terminated)
    try:
        # What the workflow makes is recorded; what a person writes elsewhere is theirs.
        with ExitStack() as stack:
            if options.recorded:
                _refuse_inputs(options)
                stack.enter_context(watched(_refuse_others))
                stack.enter_context(recorded_in(RESULTS))
            options.command(options)
    except BiogripError as error:
        print(f"biogrip: {error}", file=sys.stderr)
        return 1
    except KeyError as error:
        print(f"biogrip: --settings: the key {error} is missing.", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("biogrip: stopped; nothing was written by halves.", file=sys.stderr)
        return 128 + signal.SIGINT
    return options.status


def _refuse_inputs(options: argparse.Namespace) -> None:
    """Refuse to write over what is read."""
    paths = {
        name: [value] if isinstance(value, Path) else value
        for name, value in vars(options).items()
        if isinstance(value, Path | list)
    }
    inputs = [path for name in paths if name not in _OUTPUTS for path in paths[name]]
    for name in _OUTPUTS & set(paths):
        refuse_inputs(paths[name], inputs)


def _refuse_others(path: Path, scratch: Path) -> None:
    """Refuse to replace what the study has no record of; Snakemake has removed what it has."""
    if os.path.lexists(path):
        from biogrip.running.manifest import Manifest
        from biogrip.running.wholeness import refuse_others

        refuse_others(Manifest(RESULTS), RESULTS, [path])


def _terminated(number: int, frame: FrameType | None) -> None:
    print("biogrip: ended by SIGTERM; nothing was written by halves.", file=sys.stderr)
    # Scratch files are tidied up on the way out.
    raise SystemExit(128 + number)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="biogrip", description=__doc__)
    parser.set_defaults(recorded=False, status=0)
    parser.add_argument("--version", action="version", version=f"biogrip {__version__}")
    stages = parser.add_subparsers(required=True, metavar="STAGE")

    target = _stage(stages, "target", _target, "simulate the noise-free response of a case")
    _outputs(target, "output")

    measurement = _stage(stages, "measurement", _measurement, "add noise to a target")
    _seeds(measurement)
    _inputs(measurement, "target")
    _outputs(measurement, "output")

    text = "write one noisy trace as CSV"
    export = stages.add_parser("export", help=text, description=text)
    export.set_defaults(command=_export, recorded=True)
    export.add_argument("--seed", type=int, required=True, help="which trace")
    _inputs(export, "measurements")
    _outputs(export, "output")

    calibration = _stage(
        stages, "calibration", _calibration, "calibrate a gripper without a sample"
    )
    _outputs(calibration, "output", "traces")

    linearisation = _stage(
        stages, "linearisation", _linearisation, "compare the linear and the nonlinear model"
    )
    _outputs(linearisation, "output")

    identification = _stage(
        stages, "identification", _identification, "identify the sample in noisy traces"
    )
    _seeds(identification)
    _inputs(identification, "measurements")
    _inputs(identification, "calibrated", many=True)
    _outputs(identification, "output", "history", "timing")

    recording = _stage(stages, "recording", _recording, "read and check a recorded trace")
    _inputs(recording, "recorded")
    _outputs(recording, "output")

    identifiability = _stage(
        stages, "identifiability", _identifiability, "judge what a trace of a case tells"
    )
    _inputs(identifiability, "measurements")
    _inputs(identifiability, "calibrated", many=True)
    _outputs(identifiability, "output")

    expected = _stage(stages, "expected", _expected, "judge what a case's traces should tell")
    _inputs(expected, "target")
    _inputs(expected, "calibrated", many=True)
    _outputs(expected, "output")

    coverage = _stage(stages, "coverage", _coverage, "estimates and intervals of many seeds")
    _seeds(coverage)
    _inputs(coverage, "target", "expected")
    _inputs(coverage, "calibrated", many=True)
    _outputs(coverage, "output")

    selection = _stage(stages, "selection", _selection, "fit every sample model to noisy traces")
    _seeds(selection)
    _inputs(selection, "measurements")
    _inputs(selection, "calibrated", many=True)
    _outputs(selection, "output")

    collection = _stage(stages, "collection", _collection, "join the batches of a case")
    _inputs(collection, "batches", "histories", many=True)
    _outputs(collection, "output", "history")

    robustness = _stage(
        stages, "robustness", _robustness, "judge the identifications of a sweep over a case"
    )
    _inputs(robustness, "identifications", many=True)
    _outputs(robustness, "output")

    text = "join the batches of a case in a stage whose files are tables"
    joined = _stage(stages, "joined", _joined, text)
    _inputs(joined, "batches", many=True)
    _outputs(joined, "output")

    table = _stage(stages, "table", _table, "write a table as CSV, Markdown, LaTeX and HTML")
    table.add_argument("name", help="which table")
    _inputs(table, "inputs", many=True)
    _outputs(table, "output")

    figure = _stage(stages, "figure", _figure, "draw a figure as PNG and PDF")
    figure.add_argument("name", help="which figure")
    _inputs(figure, "inputs", many=True)
    _outputs(figure, "output")

    summary = _stage(stages, "summary", _summary, "write what a trace tells on one page")
    _inputs(summary, "verdicts")
    _inputs(summary, "figures", many=True)
    _outputs(summary, "output")

    _identify_parser(stages)

    text = "run a study"
    more = "Config files (*.yaml) are laid over the default study; the rest goes to Snakemake."
    run = stages.add_parser(
        "run",
        help=text,
        description=f"{text.capitalize()}. {more}",
        usage="biogrip run [CONFIG.yaml ...] [options of Snakemake ...]",
    )
    run.set_defaults(command=_run)

    for name, command, text in (
        ("verify", _verify, "read all results and hold them against their record"),
        ("clean", _clean, "remove the results of a study, and nothing else"),
    ):
        parser_of = stages.add_parser(name, help=text, description=text)
        parser_of.set_defaults(command=command)
        parser_of.add_argument(
            "results", type=Path, nargs="?", default=RESULTS, help="folder [%(default)s]"
        )

    publish = stages.add_parser("publish", help="renew published tables and figures")
    publish.set_defaults(command=_publish)
    publish.add_argument("results", type=Path, help="results of a finished study")
    publish.add_argument("published", type=Path, help="folder to publish in")

    compare = stages.add_parser("compare", help="compare regenerated tables with published ones")
    compare.set_defaults(command=_compare)
    compare.add_argument("published", type=Path, help="folder of published tables")
    compare.add_argument("now", type=Path, help="folder of regenerated tables")

    reference = stages.add_parser("reference", help="print the description of every config key")
    reference.set_defaults(command=_reference)
    reference.add_argument("config", type=Path, help="YAML file that gives the defaults")
    return parser


def _identify_parser(stages: Any) -> None:
    text = "identify the sample in a recorded trace, without a workflow"
    identify = stages.add_parser("identify", help=text, description=text)
    identify.set_defaults(command=_identify)
    identify.add_argument("trace", type=Path, help="CSV file with a header")
    identify.add_argument("--time", default="time_s", help="column of times [%(default)s]")
    identify.add_argument(
        "--rotation", default="rotation_rad", help="column of rotations [%(default)s]"
    )
    identify.add_argument("--time-unit", help="s, ms, min or h, if the column's name has none")
    identify.add_argument("--rotation-unit", help="rad, mrad, urad or deg, likewise")
    identify.add_argument(
        "--model", default="generalized_maxwell", help="sample model [%(default)s]"
    )
    identify.add_argument(
        "--config", type=Path, help="YAML file with your gripper, protocol, search range, ..."
    )
    identify.add_argument("--noise", type=float, metavar="RAD", help="known noise of the trace")
    identify.add_argument("--offset", action="store_true", help="fit an offset along")
    identify.add_argument("--drift", action="store_true", help="fit a linear drift along")
    identify.add_argument("--output", type=Path, help="JSON file [TRACE.identified.json]")
    identify.add_argument(
        "--force", action="store_true", help="replace a file that biogrip did not write"
    )


def _stage(stages: Any, name: str, command: Any, text: str) -> argparse.ArgumentParser:
    parser: argparse.ArgumentParser = stages.add_parser(name, help=text, description=text)
    parser.set_defaults(command=command, recorded=True)
    parser.add_argument(
        "--settings",
        type=_settings,
        required=True,
        help="the config keys it uses, as JSON",
    )
    return parser


def _settings(text: str) -> dict[str, Any]:
    settings = json.loads(text)
    if not isinstance(settings, dict):
        raise ValueError(text)
    return settings


def _seeds(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--seeds", required=True, help="batch of seeds, e.g. seeds_0-24")


def _inputs(parser: argparse.ArgumentParser, *names: str, many: bool = False) -> None:
    for name in names:
        if many:
            parser.add_argument(f"--{name}", type=Path, nargs="*", default=[], help="input files")
        else:
            parser.add_argument(f"--{name}", type=Path, required=True, help="input file")


def _outputs(parser: argparse.ArgumentParser, *names: str) -> None:
    for name in names:
        parser.add_argument(f"--{name}", type=Path, required=True, help="output file")


def _batch(name: str) -> list[int]:
    from biogrip.study.batches import parse_batch

    batch = parse_batch(name)
    if batch is None or batch.last < batch.first:
        raise BiogripError(f"--seeds: found '{name}', allowed is seeds_FIRST-LAST.")
    return batch.seeds


def _target(options: argparse.Namespace) -> None:
    from biogrip.stages import target

    target.run(options.settings, options.output)


def _measurement(options: argparse.Namespace) -> None:
    from biogrip.stages import measurement

    measurement.run(options.settings, _batch(options.seeds), options.target, options.output)


def _export(options: argparse.Namespace) -> None:
    from biogrip.stages import export

    export.run(options.seed, options.measurements, options.output)


def _calibration(options: argparse.Namespace) -> None:
    from biogrip.stages import calibration

    calibration.run(options.settings, options.output, options.traces)


def _linearisation(options: argparse.Namespace) -> None:
    from biogrip.stages import linearisation

    linearisation.run(options.settings, options.output)


def _identification(options: argparse.Namespace) -> None:
    from biogrip.stages import identification

    identification.run(
        options.settings,
        _batch(options.seeds),
        options.measurements,
        options.output,
        options.history,
        options.timing,
        *options.calibrated,
    )


def _recording(options: argparse.Namespace) -> None:
    from biogrip.stages import recording

    recording.run(options.settings, options.recorded, options.output)


def _identifiability(options: argparse.Namespace) -> None:
    from biogrip.stages import identifiability

    identifiability.run(options.settings, options.measurements, options.output, *options.calibrated)


def _expected(options: argparse.Namespace) -> None:
    from biogrip.stages import identifiability

    identifiability.expected(options.settings, options.target, options.output, *options.calibrated)


def _coverage(options: argparse.Namespace) -> None:
    from biogrip.stages import coverage

    coverage.run(
        options.settings,
        _batch(options.seeds),
        options.target,
        options.expected,
        options.output,
        *options.calibrated,
    )


def _selection(options: argparse.Namespace) -> None:
    from biogrip.stages import selection

    selection.run(
        options.settings,
        _batch(options.seeds),
        options.measurements,
        options.output,
        *options.calibrated,
    )


def _collection(options: argparse.Namespace) -> None:
    from biogrip.stages import collection

    collection.run(
        options.settings,
        options.batches,
        options.histories,
        options.output,
        options.history,
    )


def _robustness(options: argparse.Namespace) -> None:
    from biogrip.stages import robustness

    robustness.run(options.settings, options.identifications, options.output)


def _joined(options: argparse.Namespace) -> None:
    from biogrip.stages import joined

    joined.run(options.settings, options.batches, options.output)


def _table(options: argparse.Namespace) -> None:
    from biogrip.stages import table

    table.run(options.name, options.settings, options.inputs, options.output)


def _figure(options: argparse.Namespace) -> None:
    from biogrip.stages import figure

    figure.run(options.name, options.settings, options.inputs, options.output)


def _summary(options: argparse.Namespace) -> None:
    from biogrip import summary

    summary.run(options.settings, options.verdicts, options.figures, options.output)


def _identify(options: argparse.Namespace) -> None:
    from biogrip.study.one_trace import (
        Wanted,
        check_output,
        check_trace_file,
        identify_trace,
        in_words,
    )

    check_trace_file(options.trace)
    output = options.output or options.trace.with_suffix(".identified.json")
    refuse_inputs([output], [options.trace, *([options.config] if options.config else [])])
    check_output(output, force=options.force)
    measurement = {
        "time": options.time,
        "rotation": options.rotation,
        "time_unit": options.time_unit,
        "rotation_unit": options.rotation_unit,
        "noise_rad": options.noise,
        "offset": options.offset,
        "drift": options.drift,
    }
    given = {key: value for key, value in measurement.items() if value is not None}
    found = identify_trace(Wanted(options.trace, options.model, given, options.config), output)
    print(in_words(found))
    print(f"Written to {output}.")


def _run(options: argparse.Namespace) -> None:
    from biogrip.running.run import run

    options.status = run(options.rest)


def _verify(options: argparse.Namespace) -> None:
    from biogrip.running.manifest import verify

    print(verify(options.results))


def _clean(options: argparse.Namespace) -> None:
    from biogrip.running.manifest import clean

    print(clean(options.results))


def _publish(options: argparse.Namespace) -> None:
    from biogrip.running.published import publish

    print(publish(options.results, options.published))


def _compare(options: argparse.Namespace) -> None:
    from biogrip.tables.comparison import compare

    print(compare(options.published, options.now))


def _reference(options: argparse.Namespace) -> None:
    from biogrip.study.reference import reference

    print(reference(options.config))
