"""Identify the viscoelastic parameters of samples in recorded traces."""

import argparse
import os
import re
import signal
import sys
from collections.abc import Callable, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any, NoReturn

from biogrip import __version__
from biogrip.command.options import GROUPS, Setting, setting_of
from biogrip.errors import BiogripError, nearest
from biogrip.terminal import visible, visible_lines

_FILE_NAME_SHOWN = 200


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line, and return its exit status."""
    # Matrices are small: BLAS threads, which NumPy starts when it is imported, cost more than they
    # bring.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    given = (sys.argv[1:] if arguments is None else arguments) or ["--help"]
    options = vars(_parser().parse_args(given))
    module, _, function = options.pop("command").partition(":")
    try:
        # Imported here, so that a command loads only what it uses.
        status = getattr(import_module(module), function)(**options) or 0
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
        place = "" if error.filename is None else f"{visible(error.filename)[:_FILE_NAME_SHOWN]}: "
        print(f"biogrip: {place}{error.strerror or error}.", file=sys.stderr)
        return 1
    return int(status)


class _Parser(argparse.ArgumentParser):
    """Argument parser with safe error messages, and examples at the end of its help."""

    lists_models = False

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        # What is not given has the default of the function that does the command.
        self.argument_default = argparse.SUPPRESS
        # argparse takes a negative number with an exponent, or a unit, for an option.
        self._negative_number_matcher = re.compile(r"-\.?\d")

    def format_help(self) -> str:
        """Return the help, with the sample models where one is to be named."""
        lines = _model_lines() if self.lists_models else []
        return super().format_help() + "".join(f"{line}\n" for line in lines)

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Refuse unknown options with the usage of their command, and the nearest that there is."""
        parsed, unknown = super().parse_known_args(args, namespace)
        if unknown:
            option = unknown[0].partition("=")[0]
            near = nearest(option, self._option_string_actions)
            self.error(f"unrecognized arguments: {' '.join(unknown)}.{near}")
        return parsed, unknown

    def error(self, message: str) -> NoReturn:
        """Print a usage error and exit."""
        super().error(visible_lines(message))


def _model_lines() -> list[str]:
    """Return the names, titles and networks of the sample models."""
    from biogrip.physics.models import ALIASES, MODELS
    from biogrip.physics.sample_model import sketched

    width = max(map(len, MODELS))
    lines = ["", "sample models (other names; prony3, sls3: generalized_maxwell_3 without c_p):"]
    for name, model in MODELS.items():
        also = ", ".join(other for other, meant in ALIASES.items() if meant == name)
        lines.append(f"  {name:<{width}}  {model.title}" + (f" ({also})" if also else ""))
        lines.append(f"  {'':<{width}}  {sketched(model)}")
    return [*lines, f"  {'jeffreys':<{width}}  Burgers fluid without its spring"]


class _RaisingParser(_Parser):
    """The same, of which a usage error is an error to catch."""

    def error(self, message: str) -> NoReturn:
        """Raise what would be printed."""
        raise BiogripError(message)

    def exit(self, status: int = 0, message: str | None = None) -> NoReturn:
        """Do not exit."""
        raise BiogripError(message or "allowed are options that set something.")


def options_of(arguments: Sequence[str]) -> dict[str, Any]:
    """Return what a command line asks for; what is wrong with it is a `BiogripError`."""
    return vars(_parser(_RaisingParser).parse_args(arguments))


def _parser(kind: type[_Parser] = _Parser) -> argparse.ArgumentParser:
    parser = kind(prog="biogrip", description=__doc__)
    parser.add_argument("--version", action="version", version=f"biogrip {__version__}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    for add in (_add_identify, _add_groups, _add_design, _add_app):
        add(commands)
    return parser


def _setting(option: str) -> Callable[[str], Setting]:
    """Return what makes a setting of an option's value, with a message that argparse shows."""

    def set_to(text: str) -> Setting:
        try:
            return setting_of(option, text)
        except BiogripError as error:
            raise argparse.ArgumentTypeError(str(error)) from error

    return set_to


def _add_command(
    commands: Any, name: str, function: str, text: str, examples: Sequence[str] = (), cost: str = ""
) -> Any:
    """Add a command, what does it, and what stands at the end of its help."""
    lines = ["examples:", *(f"  biogrip {example}" for example in examples)] if examples else []
    shown = {"help": text, "description": text, "epilog": "\n".join([*lines, "", cost])}
    added = commands.add_parser(name, **shown, formatter_class=argparse.RawDescriptionHelpFormatter)
    added.set_defaults(command=function)
    return added


def _add_file(parser: Any, name: str, metavar: str, text: str, **more: Any) -> None:
    parser.add_argument(name, type=Path, metavar=metavar, help=text, **more)


def _add_identify(commands: Any) -> None:
    examples = (
        "identify cell.csv --config my_gripper.yaml --model liquid_drop --report page.html",
        "identify creep.csv --reading 'strain=Strain [%]' --time 'Time [s]' --hold 5Pa --model sls",
        "identify afm.txt --reading 'force=Load (uN)' --time 'Time (s)' "
        "--load 'Indentation (nm)' --shape 'sphere 25 um' --model sls",
        """identify sweep.csv --reading "storage=G' (Pa)" --reading "loss=G'' (Pa)" """
        "--frequency 'f (Hz)' --model power_law",
        "identify cells.tsv --config my_gripper.yaml --csv found.csv",
    )
    cost = "A trace takes seconds, or longer where no model fits it (--no-compare)."
    text = "identify the sample in recorded traces, without a workflow"
    function = "biogrip.command.files:identify_files"
    identify = _add_command(commands, "identify", function, text, examples, cost)
    identify.set_defaults(settings=[])
    identify.lists_models = True
    identify.add_argument(
        "files",
        type=Path,
        nargs="+",
        metavar="TRACE",
        help="CSV file with a header; or a table of traces: column file has their names, columns "
        "named like keys of the config set these, others are copied to --csv",
    )
    text = "all traces are of one sample, which they tell together (a table: column sample)"
    identify.add_argument("--together", action="store_true", help=text)
    text = "YAML file with your gripper, protocol, search range, ..."
    identify.add_argument("--config", type=Path, help=text)
    for title, options in GROUPS.items():
        group = identify.add_argument_group(title)
        for name, metavar, _, text in options:
            how = {"action": "append", "metavar": metavar, "type": _setting(name[2:])}
            if not metavar:
                how = {"action": "append_const", "const": setting_of(name[2:], "true")}
            group.add_argument(name, dest="settings", help=text, **how)
    group = identify.add_argument_group("output")
    _add_file(group, "--report", "PAGE", "HTML page with pictures")
    _add_file(group, "--csv", "TABLE", "CSV file, a row per trace", dest="table")
    _add_file(group, "--plot", "FIGURE", "PNG file, of one trace: its fit")
    _add_file(group, "--output", "FILE", "JSON file, of one trace [TRACE.identified.json]")


def _add_groups(commands: Any) -> None:
    text = "compare groups of cells, from the table that identify --csv wrote"
    examples = (
        "groups found.csv --by treatment --unit dish",
        "groups found.csv --by treatment --unit dish --csv compared.csv --plot cells.pdf",
    )
    groups = _add_command(commands, "groups", "biogrip.groups:groups", text, examples)
    groups.add_argument("found", type=Path, help="CSV file that identify --csv wrote")
    groups.add_argument("--by", required=True, metavar="COLUMN", help="column that makes groups")
    text = "column of the independent repeats: dishes, animals, days [every cell is one]"
    groups.add_argument("--unit", metavar="COLUMN", help=text)
    text = "CSV file, a row for a quantity of a group"
    _add_file(groups, "--csv", "TABLE", text, dest="table")
    text = "figure of every cell, by unit: a name that ends with .png or .pdf"
    _add_file(groups, "--plot", "FIGURE", text)


def _add_design(commands: Any) -> None:
    text = "search a protocol of steps that determines the samples of a config better"
    examples = ("design my.yaml", "design my.yaml --output designed.yaml")
    cost = "The search takes less than a minute."
    design = _add_command(commands, "design", "biogrip.design:design", text, examples, cost)
    design.add_argument("config", type=Path, help="YAML file with your samples")
    text = "config of the designed study, YAML [CONFIG_designed.yaml]"
    _add_file(design, "--output", "OUTPUT", text)


def _add_app(commands: Any) -> None:
    text = "open a window of this machine: drop files, choose, see the answer and its command"
    app = _add_command(commands, "app", "biogrip.app.server:open_app", text)
    app.add_argument("--port", type=int, metavar="PORT", help="of this machine [any that is free]")
    app.add_argument("--no-browser", action="store_true", help="print the address only")
