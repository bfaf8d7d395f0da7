"""Identify the viscoelastic parameters of samples in recorded traces."""

import argparse
import math
import os
import re
import signal
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, NoReturn

from biogrip import __version__
from biogrip.command.options import OPTIONS
from biogrip.errors import BiogripError, nearest
from biogrip.terminal import visible, visible_lines

_SHOWN = 200
_USUAL = ("sls", "zener_kelvin", "kelvin_voigt", "maxwell", "burgers", "power_law")

# Imports are inside the commands, so that jobs import only what they use.


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line, and return its exit status."""
    # Matrices are small: BLAS threads, which NumPy starts when it is imported, cost more than they
    # bring.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    options = _parser().parse_args((sys.argv[1:] if arguments is None else arguments) or ["--help"])
    try:
        status: int = options.command(options)
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
    return status


class _Parser(argparse.ArgumentParser):
    """Argument parser with safe error messages, and examples at the end of its help."""

    examples = ""
    lists_models = False

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        # argparse takes a negative number with an exponent, or a unit, for an option.
        self._negative_number_matcher = re.compile(r"-\.?\d")

    def format_help(self) -> str:
        """Return the help, with the sample models where one is to be named."""
        models = _models() if self.lists_models else ""
        return f"{super().format_help()}{models}{self.examples}"

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Refuse unknown options with the usage of their command, and the nearest that there is."""
        found, unknown = super().parse_known_args(args, namespace)
        if unknown:
            near = nearest(unknown[0].partition("=")[0], self._option_string_actions)
            self.error(f"unrecognized arguments: {' '.join(unknown)}.{near}")
        return found, unknown

    def error(self, message: str) -> NoReturn:
        """Print a usage error and exit."""
        super().error(visible_lines(message))


def _models() -> str:
    """Return the names and titles of the sample models, usual ones first."""
    from biogrip.physics.models import ALIASES, MODELS

    width = max(map(len, MODELS))
    lines = ["\nsample models (other names; prony3: generalized_maxwell_3 without c_p):"]
    shown = {ALIASES.get(name, name): name for name in _USUAL}
    shown |= {name: name for name in MODELS if name not in shown}
    for name, usual in shown.items():
        others = [other for other in (*ALIASES, *MODELS) if ALIASES.get(other, other) == name]
        also = ", ".join(other for other in others if other != usual)
        lines.append(f"  {usual:<{width}}  {MODELS[name].title}" + (f" ({also})" if also else ""))
    return "\n".join([*lines, ""])


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(prog="biogrip", description=__doc__)
    parser.add_argument("--version", action="version", version=f"biogrip {__version__}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    _identify_parser(commands)
    _study_parser(commands)
    _groups_parser(commands)
    _design_parser(commands)
    return parser


def _examples(*commands: str, cost: str = "") -> str:
    """Return examples of a command, and a sentence on what takes long."""
    lines = ["\nexamples:", *(f"  biogrip {command}" for command in commands), ""]
    return "\n".join([*lines, cost, ""] if cost else lines)


def _within(text: str) -> tuple[str | None, float]:
    name, _, percent = text.rpartition("=")
    with suppress(ValueError):
        if 0 < float(percent) < math.inf:
            return name or None, float(percent)
    raise ValueError(f"found '{text}', allowed is a percentage, or as in k=10")


def _any_key(text: str) -> tuple[tuple[str, ...], Any]:
    from biogrip.study.source import value_of

    key, found, value = text.partition("=")
    if not (key and found):
        raise ValueError(f"found '{text}', allowed is KEY=VALUE, as in measurement.time_unit=ms")
    try:
        return tuple(key.split(".")), value_of(value, key)
    except BiogripError as error:
        raise ValueError(f"{key}: {error}") from error


def _read(reader: Callable[[str], Any]) -> Callable[[str], Any]:
    """Return a reader whose message argparse shows."""

    def read(text: str) -> Any:
        try:
            return reader(text)
        except ValueError as error:
            raise argparse.ArgumentTypeError(str(error)) from error

    return read


_SETTINGS: dict[str, list[tuple[str, str, str]]] = {
    "the file's columns": [
        (
            *("--reading", "[QUANTITY=]COLUMN"),
            "of readings, and their quantity [rotation=rotation_rad]; in creep displacement, "
            "strain, compliance; in relaxation force, stress, modulus, relative_modulus; of a "
            "sweep storage, complex_modulus or storage_stiffness, and, by a second --reading, "
            "loss, phase or loss_factor",
        ),
        ("--time", "COLUMN", "of times [time_s]"),
        ("--frequency", "COLUMN", "of frequencies, of a sweep"),
    ],
    "what was done": [
        (
            *("--hold", "VALUE"),
            "what was held from 0 to the end: the stress if strain was read, the force if "
            "displacement, and the reverse; as in '20 pN', 5mbar or 5%%, or in SI units "
            "[1 for a compliance or a modulus]",
        ),
        ("--load", "COLUMN", "instead of --hold: column of the same, as recorded"),
        (
            *("--sphere", "RADIUS"),
            "of a sphere that indents the sample, as in '2.5 um': force or "
            "indentation is read, the other is of --hold or --load",
        ),
        ("--start", "SECONDS", "the protocol's start on the clock, or fit to fit it [0]"),
        ("--from", "PLACE", "use nothing before this time (s), or below this frequency"),
        ("--until", "PLACE", "use nothing after or above it"),
    ],
    "the sample": [
        ("--model", "NAME", "sample model, see below [generalized_maxwell]"),
        ("--fix", "NAME=VALUE", "known parameter, SI units; 0 for no element; repeatable"),
        ("--at", "SECONDS,...", "times after a step at which to print G, K or J, of any model"),
    ],
    "the noise and the instrument": [
        ("--noise", "SD", "known noise, in the readings' SI unit"),
        ("--noise-share", "SHARE", "known noise, as a share of the readings"),
        ("--sd", "COLUMN", "column of the readings' standard deviations"),
        ("--noise-model", "NAME", "white, or coloured: autocorrelated"),
        ("--offset", "", "fit an offset of the readings, too, or not"),
        ("--drift", "", "fit a linear drift, too, or not"),
    ],
    "any other key of the config": [
        (
            "--set",
            "KEY=VALUE",
            "as in measurement.time_unit=ms or measurement.block=2, YAML; repeatable",
        ),
    ],
}
"""Options of `identify` by what they are about: name; what is given, nothing for a switch; help."""


class _Set(argparse.Action):
    """Append what an option sets: the path of a config key, by default `dest`, and its value."""

    def __call__(
        self, parser: Any, namespace: argparse.Namespace, values: Any, option: str | None = None
    ) -> None:
        """Append the option with path and value; one that takes no value is a switch."""
        path, value = tuple(self.dest.split(".")), values
        if isinstance(values, tuple):
            path, value = values
        elif self.nargs == 0:
            value = not str(option).startswith("--no-") if self.const is None else self.const
        namespace.settings = [*namespace.settings, (str(option), path, value)]


def _add_settings(parser: Any, outputs: Callable[[Any], None] | None = None) -> None:
    """Add traces, and options that say what they are of."""
    parser.add_argument(
        "traces",
        type=Path,
        nargs="+",
        metavar="TRACE",
        help="CSV file with a header; or a table of traces: column file has their names, columns "
        "named like keys of the config set these, others are copied to --csv",
    )
    for title, options in _SETTINGS.items():
        group = parser.add_argument_group(title)
        for name, metavar, text in options:
            names = [name] if metavar else [name, name.replace("--", "--no-")]
            key = OPTIONS.get(name[2:].replace("-", "_"), _any_key)
            of_key: dict[str, Any] = {"dest": key} if isinstance(key, str) else {"type": _read(key)}
            of_key |= {"metavar": metavar} if metavar else {"nargs": 0}
            group.add_argument(*names, action=_Set, help=text, **of_key)
        if title == "what was done":
            text = "YAML file with your gripper, protocol, search range, ..."
            group.add_argument("--config", type=Path, help=text)
        if title == "the sample":
            of_key = {"dest": "model_selection.models", "nargs": 0, "const": []}
            text = "do not try other models, which takes long where none fits"
            group.add_argument("--no-compare", action=_Set, help=text, **of_key)
            if outputs:
                outputs(parser.add_argument_group("output"))


def _identify_parser(stages: Any) -> None:
    text = "identify the sample in recorded traces, without a workflow"
    identify = stages.add_parser("identify", help=text, description=text)
    identify.set_defaults(command=_identify, settings=[])
    identify.lists_models = True
    identify.examples = _examples(
        "identify cell.csv --config my_gripper.yaml --model liquid_drop --report page.html",
        "identify creep.csv --reading 'strain=Strain [%]' --time 'Time [s]' --hold 5Pa --model sls",
        "identify afm.txt --reading 'force=Load (uN)' --time 'Time (s)' "
        "--load 'Indentation (nm)' --sphere '25 um' --model sls",
        """identify sweep.csv --reading "storage=G' (Pa)" --reading "loss=G'' (Pa)" """
        "--frequency 'f (Hz)' --model power_law",
        "identify cells.tsv --config my_gripper.yaml --csv found.csv",
        cost="A trace takes seconds, or longer where no model fits it (--no-compare).",
    )
    _add_settings(identify, _add_outputs)


def _add_outputs(group: Any) -> None:
    group.add_argument("--report", type=Path, metavar="PAGE", help="HTML page with pictures")
    group.add_argument("--csv", type=Path, metavar="TABLE", help="CSV file, a row per trace")
    text = "JSON file, of one trace [TRACE.identified.json]"
    group.add_argument("--output", type=Path, metavar="FILE", help=text)


def _study_parser(stages: Any) -> None:
    text = "write the config of a study of recorded traces, from the options of identify"
    study = stages.add_parser("study", help=text, description=text)
    study.set_defaults(command=_study, settings=[])
    study.lists_models = True
    study.examples = _examples("study cell.csv --config my_gripper.yaml --model liquid_drop")
    _add_settings(study)
    text = "new folder for the study [TRACE_study]"
    study.add_argument("--output", type=Path, metavar="FOLDER", help=text)


def _groups_parser(stages: Any) -> None:
    text = "compare groups of cells, from the table that identify --csv wrote"
    groups = stages.add_parser("groups", help=text, description=text)
    groups.set_defaults(command=_groups)
    groups.examples = _examples(
        "groups found.csv --by treatment --unit dish",
        "groups found.csv --by treatment --unit dish --csv compared.csv --plot cells.pdf",
    )
    groups.add_argument("found", type=Path, help="CSV file that identify --csv wrote")
    groups.add_argument("--by", required=True, metavar="COLUMN", help="column that makes groups")
    text = "column of the independent repeats: dishes, animals, days [every cell is one]"
    groups.add_argument("--unit", metavar="COLUMN", help=text)
    groups.add_argument(
        "--csv", type=Path, metavar="TABLE", help="CSV file, a row for a quantity of a group"
    )
    text = "figure of every cell, by unit: a name that ends with .png or .pdf"
    groups.add_argument("--plot", type=Path, metavar="FIGURE", help=text)


def _design_parser(stages: Any) -> None:
    text = "search a protocol of steps that determines the samples of a config better"
    design = stages.add_parser("design", help=text, description=text)
    design.set_defaults(command=_design)
    design.examples = _examples(
        "design my.yaml",
        "design my.yaml --within k=10",
        cost="The search takes less than a minute.",
    )
    text = "YAML file with your samples, laid over the default study"
    design.add_argument("config", type=Path, help=text)
    text = "config of the designed study, YAML [CONFIG_designed.yaml]"
    design.add_argument("--output", type=Path, help=text)
    text = "the shortest protocol whose 95 %% limits of a parameter, or of all, are within PERCENT"
    design.add_argument("--within", type=_read(_within), metavar="[NAME=]PERCENT", help=text)


def _identify(options: argparse.Namespace) -> int:
    from biogrip.command.files import identify_files
    from biogrip.command.settings import Setting

    return identify_files(
        options.traces,
        options.config,
        [Setting(*each) for each in options.settings],
        output=options.output,
        report=options.report,
        table=options.csv,
    )


def _study(options: argparse.Namespace) -> int:
    from biogrip.command.settings import Setting
    from biogrip.command.study import write_study

    settings = [Setting(*each) for each in options.settings]
    write_study(options.traces, options.config, settings, options.output)
    return 0


def _groups(options: argparse.Namespace) -> int:
    from biogrip.groups import groups

    groups(options.found, options.by, options.csv, options.unit, options.plot)
    return 0


def _design(options: argparse.Namespace) -> int:
    from biogrip.design import design

    design(options.config, options.output, options.within)
    return 0
