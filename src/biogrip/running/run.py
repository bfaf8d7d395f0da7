"""The command ``biogrip run``: checks the configs, runs Snakemake, and handles signals."""

import argparse
import os
import shlex
import signal
import stat
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from types import FrameType

from biogrip.errors import BiogripError
from biogrip.stopping import end_at_once
from biogrip.terminal import visible_lines

# Large imports are inside functions: until a handler is installed, signals are lost.
_STOPS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_SHOWN = 6
_LONGEST = 200


def run(arguments: Sequence[str]) -> int:
    """Check a study's configs, run it by Snakemake, and name the page to open.

    Parameters
    ----------
    arguments
        Config files (``*.yaml``, ``*.yml``, ``*.json``), merged in order; then options of
        Snakemake.

    Returns
    -------
    int
        Snakemake's exit status, or 128 plus the number of the signal that ended it.

    Raises
    ------
    BiogripError
        If a config cannot be used. Nothing is started then.
    """
    signals = _Signals(shlex.join(["biogrip", "run", *arguments]))
    with signals.handled():
        status = _run(arguments, signals)
        if signals.first is not None:
            signals.end(signals.first)
    return status


def _run(arguments: Sequence[str], signals: "_Signals") -> int:
    from biogrip.study.defaults import snakefile

    overlays, rest = _split(arguments)
    known = _known(rest)
    folder = Path(known.directory or ".")
    _check_folder(folder)
    configs = [Path(name).absolute() for name in overlays]
    # Targets after "--" must stay behind the options added here.
    cut = rest.index("--") if "--" in rest else len(rest)
    command = [sys.executable, "-m", "biogrip.running.snakemake_process"]
    command += ["--snakefile", str(snakefile()), *rest[:cut]]
    if not known.cores and not known.profile:
        command += ["--cores", "all"]
    if configs:
        command += ["--configfile", *map(str, configs)]
    status = signals.supervise([*command, *rest[cut:]])
    if status == 0 and signals.first is None and not known.dry_run:
        print(visible_lines(_to_open(folder, rest)))
    return status


def _check_folder(folder: Path) -> None:
    """Refuse a working directory that Snakemake could not use; a missing one is created."""
    from biogrip.running.places import refuse_other_than_folder

    try:
        found = None if stat.S_ISDIR(folder.stat().st_mode) else "found a file"
    except FileNotFoundError:
        return
    except OSError as error:
        found = error.strerror
    if found:
        shown = str(folder)[:_LONGEST]
        raise BiogripError(f"--directory: {shown}: {found}, allowed is a folder.")
    # Snakemake would follow a link, and fail with a traceback on a file.
    refuse_other_than_folder(folder / ".snakemake")


def _split(arguments: Sequence[str]) -> tuple[list[str], list[str]]:
    """Split the arguments into config files and options of Snakemake."""
    names = list(arguments)
    count = 0
    while count < len(names) and names[count].endswith((".yaml", ".yml", ".json")):
        count += 1
    # Same option names as Snakemake's, whose errors would end in a traceback.
    parser = argparse.ArgumentParser(add_help=False, allow_abbrev=False, exit_on_error=False)
    parser.add_argument("--configfile", "--configfiles", nargs="+", action="extend", default=[])
    try:
        known, rest = parser.parse_known_args(names[count:])
    except argparse.ArgumentError as error:
        raise BiogripError("--configfile: needs a file.") from error
    return names[:count] + known.configfile, rest


def _known(rest: list[str]) -> argparse.Namespace:
    """Parse those options of Snakemake that affect this command."""
    parser = argparse.ArgumentParser(add_help=False, allow_abbrev=False)
    parser.add_argument("-n", "--dry-run", "--dryrun", action="store_true", dest="dry_run")
    parser.add_argument("-d", "--directory")
    parser.add_argument("-c", "--cores", "-j", "--jobs", nargs="?", const="all")
    parser.add_argument("--profile", "--workflow-profile")
    known, _ = parser.parse_known_args(rest)
    return known


class _Signals:
    """Handler of stop signals that forwards them to Snakemake once it has started."""

    def __init__(self, again: str) -> None:
        self._to_go_on = f"Nothing that is done is lost; to go on: {again}"
        self.first: signal.Signals | None = None
        self._starting = False
        self._child: subprocess.Popen[bytes] | None = None

    @contextmanager
    def handled(self) -> Iterator[None]:
        """Handle stop signals within a context, except those ignored, as with ``nohup``."""
        taken = [number for number in _STOPS if signal.getsignal(number) != signal.SIG_IGN]
        before = {number: signal.signal(number, self._got) for number in taken}
        try:
            yield
        finally:
            for number, old in before.items():
                signal.signal(number, old)

    def supervise(self, command: list[str]) -> int:
        """Run a command in its own process group, and return its exit status.

        In its own group it gets each signal once, and its jobs get none from the terminal.
        """
        self._starting = True
        # The child unblocks SIGINT when its handler is installed.
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            self._child = subprocess.Popen(command, start_new_session=True)
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
        if self.first is not None:
            self._pass_on(self._child)
        status = self._child.wait()
        if status < 0:
            # Its jobs would go on, and write what the next run does not expect.
            with suppress(ProcessLookupError):
                os.killpg(self._child.pid, signal.SIGTERM)
        if status < 0 and self.first is None:
            ended = f"Snakemake was ended by signal {-status}"
            with suppress(ValueError):
                ended = f"Snakemake was ended by {signal.Signals(-status).name}"
            print(f"biogrip: {ended}. {self._to_go_on}", file=sys.stderr)
        return status if status >= 0 else 128 - status

    def _got(self, number: int, _: FrameType | None) -> None:
        self.first = self.first or signal.Signals(number)
        if self._child is not None:
            self._pass_on(self._child)
        elif not self._starting:
            self.end(self.first)

    def end(self, number: signal.Signals) -> None:
        """End this process with a message on how to continue."""
        if self._child is not None:
            # Output may have stopped in the middle of a line.
            with suppress(OSError):
                os.write(sys.stderr.fileno(), b"\n")
        end_at_once(number, f"stopped by {number.name}. {self._to_go_on}")

    def _pass_on(self, child: "subprocess.Popen[bytes]") -> None:
        # The process may have ended just now.
        with suppress(ProcessLookupError):
            # On SIGTERM Snakemake waits for running jobs, on SIGINT it ends them.
            os.kill(child.pid, signal.SIGINT)


def _to_open(folder: Path, arguments: list[str]) -> str:
    """Return a message naming the files to open: requested ones, or else the report pages."""
    from biogrip.running.resolved import read_study

    results = folder / "results"
    pages: list[Path] = []
    # Snakemake may have been called for something other than a run.
    with suppress(BiogripError, OSError):
        pages = [results / "summaries" / f"{case}.html" for case in read_study(results).cases]
        begun_ns = (results / "study.json").stat().st_mtime_ns
        # Pages that are older were made for the study before, and were not asked for now.
        pages = [
            page
            for page in (results / "report.html", *pages)
            if page.is_file() and page.stat().st_mtime_ns >= begun_ns
        ]
    requested = [folder / word for word in arguments if word.startswith("results/")]
    there = _files(requested) or _files(pages)
    more = f" and {len(there) - _SHOWN} more" if len(there) > _SHOWN else ""
    return f"biogrip: done. Open {', '.join(there[:_SHOWN])}{more}." if there else "biogrip: done."


def _files(paths: list[Path]) -> list[str]:
    return [str(path) for path in paths if path.is_file()]
