"""The ``biogrip`` command."""

import argparse
import os
import re
import signal
import sys
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any, NoReturn

from biogrip import __version__
from biogrip.errors import BiogripError
from biogrip.terminal import visible, visible_lines

if TYPE_CHECKING:
    from biogrip.identify.read_as import ReadAs

FIT = "fit"
_SHOWN = 200

# Imports are inside the commands, so that jobs import only what they use.


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line, and return its exit status."""
    given = sys.argv[1:] if arguments is None else list(arguments)
    parser = _parser()
    options = parser.parse_args(given)
    # Matrices are small: BLAS threads cost more than they bring.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    try:
        options.command(options)
        sys.stdout.flush()
    except BiogripError as error:
        print(f"biogrip: {visible_lines(error)}", file=sys.stderr)
        return 1
    except BrokenPipeError:
        # The reader has closed the pipe. Python would report that again at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 128 + signal.SIGPIPE
    except OSError as error:
        # Errors of the operating system: no permission, a name too long, ...
        place = "" if error.filename is None else f"{visible(error.filename)[:_SHOWN]}: "
        print(f"biogrip: {place}{error.strerror or error}.", file=sys.stderr)
        return 1
    return options.status


class _Parser(argparse.ArgumentParser):
    """Argument parser with safe error messages, and examples at the end of its help."""

    examples = ""
    lists_models = False

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        # argparse takes a negative number with an exponent for an option.
        self._negative_number_matcher = re.compile(r"-(\d+\.?\d*|\.\d+)(e[-+]?\d+)?$", re.I)

    def format_help(self) -> str:
        """Return the help, with the sample models where one is to be named."""
        models = _models() if self.lists_models else ""
        return f"{super().format_help()}{models}{self.examples}"

    def error(self, message: str) -> NoReturn:
        """Print a usage error and exit."""
        super().error(visible_lines(message))


def _models() -> str:
    """Return the names and titles of the sample models."""
    from biogrip.physics.models import MODELS

    width = max(map(len, MODELS))
    lines = [f"  {name:<{width}}  {model.title}" for name, model in MODELS.items()]
    return "\n".join(["\nsample models:", *lines, ""])


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(prog="biogrip", description=__doc__)
    parser.set_defaults(status=0)
    parser.add_argument("--version", action="version", version=f"biogrip {__version__}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    _identify_parser(commands)
    _groups_parser(commands)
    _design_parser(commands)

    return parser


def _examples(*commands: str, cost: str = "") -> str:
    """Return examples of a command, and a sentence on what takes long."""
    lines = ["\nexamples:", *(f"  biogrip {command}" for command in commands), ""]
    return "\n".join([*lines, fill(cost, 80), ""] if cost else lines)


def _identify_parser(stages: Any) -> None:
    text = "identify the sample in recorded traces, without a workflow"
    identify = stages.add_parser("identify", help=text, description=text)
    identify.set_defaults(command=_identify)
    identify.examples = _examples(
        "identify cell.csv --config my_gripper.yaml --model liquid_drop --report page.html",
        "identify cells.tsv --config my_gripper.yaml --csv found.csv",
        cost="A trace takes seconds, most of them for comparing the sample models.",
    )
    identify.add_argument(
        "traces",
        type=Path,
        nargs="+",
        metavar="TRACE",
        help="CSV file with a header, or a table of traces: its header has the column file, and "
        "others that are keys of the config, with dots, or copied to the CSV",
    )
    identify.lists_models = True
    _reading_options(identify)
    identify.add_argument(
        "--model", default="generalized_maxwell", help="sample model [%(default)s]"
    )
    identify.add_argument(
        "--fix",
        type=_parameter,
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="known parameter, SI units; 0 leaves an element out; repeat for more",
    )
    identify.add_argument(
        "--config", type=Path, help="YAML file with your gripper, protocol, search range, ..."
    )
    identify.add_argument(
        "--noise-model", help="white, or coloured: intervals that allow for autocorrelation"
    )
    identify.add_argument(
        "--force", action="store_true", help="replace a file that biogrip did not write"
    )
    identify.add_argument(
        "--strict", action="store_true", help="end with status 1 if a fit is rejected"
    )
    identify.add_argument(
        "--report", type=Path, metavar="PAGE", help="HTML page with all results and figures"
    )
    identify.add_argument("--csv", type=Path, metavar="TABLE", help="CSV file, one row per trace")
    identify.add_argument(
        "--rows",
        type=_rows,
        metavar="FIRST-LAST",
        help="some rows of a table, from 0, without JSON files [all]",
    )
    identify.add_argument(
        "--output", type=Path, help="JSON file, of one trace [TRACE.identified.json]"
    )


def _groups_parser(stages: Any) -> None:
    text = "compare groups of cells, from the table that identify --csv wrote"
    groups = stages.add_parser("groups", help=text, description=text)
    groups.set_defaults(command=_groups)
    groups.examples = _examples(
        "groups found.csv --by dish", "groups found.csv --by treatment --csv compared.csv"
    )
    groups.add_argument("found", type=Path, help="CSV file that identify --csv wrote")
    groups.add_argument("--by", required=True, metavar="COLUMN", help="column that makes groups")
    groups.add_argument("--csv", type=Path, metavar="TABLE", help="CSV file, a row a median")
    groups.add_argument(
        "--force", action="store_true", help="replace a file that biogrip did not write"
    )


def _design_parser(stages: Any) -> None:
    text = "search for a train of steps that determines the samples of a config better"
    design = stages.add_parser("design", help=text, description=text)
    design.set_defaults(command=_design)
    design.examples = _examples(
        "design my.yaml",
        "design my.yaml --output designed.yaml",
        cost="The search takes some ten seconds.",
    )
    design.add_argument(
        "config", type=Path, help="YAML file with your samples, laid over the default study"
    )
    design.add_argument(
        "--output", type=Path, help="config of the designed study, YAML [CONFIG_designed.yaml]"
    )
    design.add_argument(
        "--force", action="store_true", help="replace a file that biogrip did not write"
    )


def _reading_options(command: argparse.ArgumentParser) -> None:
    """Add options for columns, noise and nuisance terms of recorded traces."""
    command.add_argument("--time", help="column of times [time_s]")
    command.add_argument("--rotation", help="column of rotations [rotation_rad]")
    command.add_argument(
        "--reading",
        type=_reading,
        metavar="QUANTITY=COLUMN",
        help="column of another instrument's readings: displacement, strain or compliance (creep), "
        "force, stress or modulus (relaxation)",
    )
    command.add_argument(
        "--hold",
        type=float,
        metavar="VALUE",
        help="what was held from 0 to the end, without a config: a stress in Pa for a strain, a "
        "force in N for a displacement, and the reverse; 1 for a compliance or a modulus",
    )
    command.add_argument("--time-unit", help="s, ms, min or h, if the column's name has none")
    command.add_argument("--rotation-unit", help="rad, mrad, urad or deg, likewise")
    command.add_argument("--reading-unit", help="unit of another reading, likewise")
    command.add_argument("--skip", type=int, metavar="N", help="lines before the header [0]")
    command.add_argument(
        "--block", type=int, metavar="N", help="table to read, where a file has several"
    )
    command.add_argument(
        "--average-repeated",
        action="store_true",
        default=None,
        help="average the readings of equal times",
    )
    command.add_argument(
        "--scale", type=float, metavar="FACTOR", help="reading = FACTOR times the column [1]"
    )
    command.add_argument(
        "--start",
        type=_start,
        metavar="SECONDS",
        help="time of the clock at which the protocol starts, or fit to fit it along [0]",
    )
    for name, what in (("from", "first"), ("until", "last")):
        command.add_argument(
            f"--{name}",
            type=float,
            dest=f"{name}_s",
            metavar="SECONDS",
            help=f"{what} time of the clock to use [all]",
        )
    command.add_argument("--noise", type=float, metavar="RAD", help="known noise of the trace")
    for name, what in (("--offset", "an offset"), ("--drift", "a linear drift")):
        command.add_argument(
            name, action=argparse.BooleanOptionalAction, help=f"fit {what} along, or not"
        )
    command.add_argument(
        "--sd", metavar="COLUMN", help="column of the readings' standard deviations"
    )
    command.add_argument(
        "--noise-share", type=float, metavar="SHARE", help="known noise, as a share of the reading"
    )


def _start(text: str) -> float | str:
    """Read the value of ``--start``."""
    with suppress(ValueError):
        return text if text == FIT else float(text)
    raise argparse.ArgumentTypeError(f"found '{text}', allowed are seconds, or {FIT}")


def _rows(text: str) -> tuple[int, int]:
    """Read the value of ``--rows``."""
    first, _, last = text.partition("-")
    if first.isdecimal() and last.isdecimal() and int(first) <= int(last):
        return int(first), int(last)
    raise argparse.ArgumentTypeError(f"found '{text}', allowed is FIRST-LAST, as in 0-99")


def _fixed(given: Sequence[tuple[str, float]]) -> dict[str, float]:
    """Return the values of all ``--fix`` by name, each of which may come once."""
    for number, (name, _) in enumerate(given):
        if name in dict(given[:number]):
            raise BiogripError(f"--fix: found {name} repeated, allowed is each parameter once.")
    return dict(given)


def _parameter(text: str) -> tuple[str, float]:
    """Read a value of ``--fix``."""
    name, _, value = text.partition("=")
    with suppress(ValueError):
        if name:
            return name, float(value)
    raise argparse.ArgumentTypeError(f"found '{text}', allowed is NAME=VALUE, as in k_p=0")


def _reading(text: str) -> tuple[str, str]:
    """Read the value of ``--reading``."""
    quantity, _, column = text.partition("=")
    if quantity and column:
        return quantity, column
    raise argparse.ArgumentTypeError(
        f"found '{text}', allowed is QUANTITY=COLUMN, as in compliance=J"
    )


def _identify(options: argparse.Namespace) -> None:
    from biogrip.identify.identify import identify

    options.status = identify(
        options.traces,
        options.model,
        _read_as(options),
        options.config,
        output=options.output,
        report=options.report,
        table=options.csv,
        rows=options.rows,
        fixed=_fixed(options.fix),
        strict=options.strict,
        force=options.force,
    )


def _groups(options: argparse.Namespace) -> None:
    from biogrip.groups import groups

    groups(options.found, options.by, options.csv, force=options.force)


def _design(options: argparse.Namespace) -> None:
    from biogrip.design import design

    design(options.config, options.output, force=options.force)


def _read_as(options: argparse.Namespace) -> "ReadAs":
    from biogrip.identify.read_as import ReadAs

    return ReadAs(
        options.time,
        options.rotation,
        reading=options.reading,
        hold=options.hold,
        time_unit=options.time_unit,
        rotation_unit=options.rotation_unit,
        reading_unit=options.reading_unit,
        skip=options.skip,
        scale=options.scale,
        block=options.block,
        average_repeated=options.average_repeated,
        from_s=options.from_s,
        until_s=options.until_s,
        start_s=None if options.start == FIT else options.start,
        fit_start=options.start == FIT or None,
        noise_rad=options.noise,
        offset=options.offset,
        drift=options.drift,
        noise_model=options.noise_model,
        sd=options.sd,
        noise_share=options.noise_share,
    )
