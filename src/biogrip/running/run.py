"""A study run by one command: its configs checked first, and its end said in a line."""

import argparse
import os
import shlex
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import chdir, contextmanager
from pathlib import Path
from types import FrameType

from biogrip.errors import BiogripError
from biogrip.study.defaults import default_config, snakefile
from biogrip.study.load import load_study, read_configs

_STOPS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_SHOWN = 6


def run(arguments: Sequence[str]) -> int:
    """Check a study's configs, run it by Snakemake, and say what to open.

    Parameters
    ----------
    arguments
        Config files (``*.yaml``, ``*.yml``, ``*.json``), laid one over the other; then
        anything that Snakemake takes.

    Returns
    -------
    int
        Snakemake's exit status; 128 and the signal's number if one ended it.

    Raises
    ------
    BiogripError
        If a config cannot be used. Nothing has been started then.
    """
    overlays, rest = _split(arguments)
    known = _known(rest)
    folder = Path(known.directory or ".")
    configs = [Path(name).absolute() for name in overlays]
    _check([default_config(), *configs], folder)
    command = [sys.executable, "-m", "snakemake", "--snakefile", str(snakefile()), *rest]
    if not known.cores and not known.profile:
        command += ["--cores", "all"]
    if not known.dry_run and known.quiet is None:
        # A reason lists every file that is missing; the log has them.
        command += ["--quiet", "host", "reason"]
    if configs:
        command += ["--configfile", *map(str, configs)]
    status, stopped = _supervised(command)
    again = shlex.join(["biogrip", "run", *arguments])
    if stopped is not None:
        print(
            f"biogrip: stopped by {stopped.name}. Nothing that is done is lost; to go on: {again}",
            file=sys.stderr,
        )
        return 128 + stopped
    if status == 0 and not known.dry_run:
        print(_to_open(folder / "results"))
    return status


def _check(configs: list[Path], folder: Path) -> None:
    """Check the study as Snakemake will see it, from the folder that it will run in."""
    merged = read_configs(configs)
    # Traces are named from there; before the first run it need not exist.
    with chdir(folder if folder.is_dir() else "."):
        load_study(merged, configs)


def _split(arguments: Sequence[str]) -> tuple[list[str], list[str]]:
    """Divide the arguments into config files and Snakemake's."""
    names = list(arguments)
    count = 0
    while count < len(names) and names[count].endswith((".yaml", ".yml", ".json")):
        count += 1
    return names[:count], names[count:]


def _known(rest: list[str]) -> argparse.Namespace:
    """Read those of Snakemake's options that matter here."""
    parser = argparse.ArgumentParser(add_help=False, allow_abbrev=False)
    parser.add_argument("-n", "--dry-run", "--dryrun", action="store_true", dest="dry_run")
    parser.add_argument("-d", "--directory")
    parser.add_argument("-c", "--cores", "-j", "--jobs", nargs="?", const="all")
    parser.add_argument("--profile", "--workflow-profile")
    parser.add_argument("-q", "--quiet", nargs="*")
    parser.add_argument("--configfile", "--configfiles", nargs="*")
    known, _ = parser.parse_known_args(rest)
    if known.configfile is not None:
        raise BiogripError(
            "--configfile: config files come first here: biogrip run my.yaml, then options."
        )
    return known


def _supervised(command: list[str]) -> tuple[int, signal.Signals | None]:
    """Run a command in a process group of its own, and hand it the signals that we get.

    So that it gets each of them once, whether from the terminal or from a scheduler.
    """
    got: list[signal.Signals] = []
    child = subprocess.Popen(command, start_new_session=True)

    def pass_on(number: int, _: FrameType | None) -> None:
        got.append(signal.Signals(number))
        # Snakemake ends at once on SIGINT; on SIGTERM it would first wait for its jobs.
        os.killpg(child.pid, signal.SIGINT)

    with _handled(pass_on):
        status = child.wait()
    return status, got[0] if got else None


@contextmanager
def _handled(handler: Callable[[int, FrameType | None], None]) -> Iterator[None]:
    before = {number: signal.signal(number, handler) for number in _STOPS}
    try:
        yield
    finally:
        for number, old in before.items():
            signal.signal(number, old)


def _to_open(results: Path) -> str:
    """Name what a reader should look at first."""
    pages = sorted((results / "summaries").glob("*.html"))
    shown = [results / "tables" / "errors.md", results / "figures" / "overview.png", *pages]
    there = [str(path) for path in shown if path.is_file()]
    more = f" and {len(there) - _SHOWN} more" if len(there) > _SHOWN else ""
    return f"biogrip: done. Open {', '.join(there[:_SHOWN])}{more}." if there else "biogrip: done."
