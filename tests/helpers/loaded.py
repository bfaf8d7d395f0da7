"""Snakemake and `biogrip`, called as often as need be and loaded once.

Loading them takes longer than most of what tests call them for. So a process loads both, and
forks for each call: folder, environment and output of a call are its own, as those of a program
that is started. The jobs of a run ask it, too: for their shell `biogrip` is `asking.py`; and so
does `biogrip run` for Snakemake. In an environment of another tree's code, that is loaded anew.
"""

import atexit
import gc
import os
import shlex
import shutil
import socket
import subprocess
import sys
import tempfile
import traceback
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from functools import cache
from importlib import import_module
from io import BytesIO
from pathlib import Path
from select import select
from typing import IO, Any, NoReturn

from tests.helpers import asking
from tests.helpers.pictures import in_coarse_dots

_SECONDS = 600
# Set in the environment of calls of which no picture is looked at.
COARSE = "COARSE_PICTURES"
PROGRAMS = {
    "biogrip": "biogrip.__main__",
    "snakemake": "snakemake.cli",
    "run": "biogrip.running.snakemake_process",
}
# Python as `biogrip` knows it, which starts Snakemake by it.
PYTHON = """#!/bin/sh
case "$2" in biogrip.running.snakemake_process) shift 2; exec {client} run "$@" ;; esac
exec {python} "$@"
"""


def call(
    program: str,
    arguments: Sequence[str],
    folder: Path,
    environment: Mapping[str, str],
    outputs: Sequence[IO[str]],
) -> int:
    """Call a program in a folder; its exit status.

    Parameters
    ----------
    program
        Which: ``biogrip`` or ``snakemake``.
    arguments
        Of the command line.
    folder
        Where.
    environment
        All of it; its jobs are told besides whom to ask.
    outputs
        Files for its output and its errors.
    """
    place = _place()
    told = for_jobs(environment)
    with open(os.devnull) as nothing:
        files = [nothing.fileno(), *(file.fileno() for file in outputs)]
        return asking.ask(
            f"{place}/socket", [program, *arguments], str(folder), told, files, _SECONDS
        )


def for_jobs(environment: Mapping[str, str]) -> dict[str, str]:
    """An environment in which a Snakemake's jobs ask the process that is loaded."""
    return {**environment, "BASH_ENV": f"{_place()}/functions"}


@cache
def _place() -> str:
    """Folder of the socket at which a process listens; it ends when nobody can ask any more."""
    # Not that of a test: the path of a socket has to be short.
    folder = tempfile.mkdtemp(prefix="biogrip-loaded-")
    atexit.register(shutil.rmtree, folder)
    client = shlex.join([sys.executable, "-I", "-S", asking.__file__, f"{folder}/socket"])
    Path(folder, "functions").write_text(f'biogrip() {{ {client} biogrip "$@"; }}\n')
    python = Path(folder, "python")
    python.write_text(PYTHON.format(python=shlex.quote(sys.executable), client=client))
    python.chmod(0o755)
    # Its standard input is closed when this process ends, however it does.
    process = subprocess.Popen(
        [sys.executable, "-m", __name__, f"{folder}/socket"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    atexit.register(process.communicate)
    assert process.stdout is not None
    assert process.stdout.readline() == "ready\n"
    return folder


def _serve(place: str) -> None:
    _load()
    # Else a call would copy all that is loaded, to count what refers to it.
    gc.freeze()
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind(place)
        listening.listen()
        print("ready", flush=True)
        while sys.stdin not in select([listening, sys.stdin], [], [])[0]:
            connection, _ = listening.accept()
            with connection:
                if not os.fork():
                    listening.close()
                    _answer(connection, Path(place).parent)
            _reap()


def _load() -> None:
    from snakemake.cli import get_argument_parser

    from biogrip.figures.style import figure, styled
    from biogrip.products.catalogue import products
    from biogrip.products.source_files import fingerprint

    # What either imports only when it is needed.
    get_argument_parser()
    for name in (
        "biogrip.__main__",
        "biogrip.cli",
        "smart_open",
        "snakemake.report",
        "scipy.interpolate",
        "scipy.ndimage",
    ):
        import_module(name)
    for product in products().values():
        fingerprint(product.module)
    with styled():
        drawn = figure(1.0, 1.0)
        drawn.subplots().set_title("$10^{-1}$")
        for kind in ("png", "pdf"):
            drawn.savefig(BytesIO(), format=kind)


def _answer(connection: socket.socket, place: Path) -> None:
    """Run what is asked for in a process of its own, and say how that ended."""
    (program, *arguments), folder, environment, files = asking.asked(connection)
    child = os.fork()
    if not child:
        connection.close()
        for number, file in enumerate(files):
            os.dup2(file, number)
            os.close(file)
        os.chdir(folder)
        if environment.get("PYTHONPATH") != os.environ.get("PYTHONPATH"):
            _unload(environment["PYTHONPATH"])
        os.environ.clear()
        os.environ.update(environment)
        sys.argv = [program, *arguments]
        if program == "biogrip":
            sys.executable = f"{place}/python"
        with in_coarse_dots() if COARSE in environment else nullcontext():
            _end(import_module(PROGRAMS[program]).main)
    asking.answer(connection, os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
    os._exit(0)


def _unload(tree: str) -> None:
    """Forget this tree's code, so that another's is found."""
    for name in [name for name in sys.modules if name.partition(".")[0] == "biogrip"]:
        del sys.modules[name]
    sys.path.insert(0, tree)


def _end(program: Callable[[], Any]) -> NoReturn:
    """Run a program and end as it does, but leave it to the system to take all down."""
    try:
        status = program()
    except SystemExit as ended:
        status = ended.code
    except BaseException:
        traceback.print_exc()
        status = 1
    if isinstance(status, str):
        print(status, file=sys.stderr)
        status = 1
    atexit._run_exitfuncs()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(status or 0)


def _reap() -> None:
    try:
        while os.waitpid(-1, os.WNOHANG)[0]:
            pass
    except ChildProcessError:
        return


if __name__ == "__main__":
    _serve(sys.argv[1])
