"""Steps of ``biogrip run`` before Snakemake plans its jobs.

A run puts the results in order: locks of a dead run are removed by ``snakemake --unlock``,
changed results are set aside, and outdated ones are named to ``--forcerun``.
"""

import io
import os
import subprocess
import sys
from collections.abc import Iterable, Sequence
from contextlib import chdir, redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any

from biogrip.products.catalogue import products
from biogrip.products.plan import Plan
from biogrip.running import job_lines
from biogrip.running.locks import is_locked, is_locked_by_dead
from biogrip.running.manifest import Manifest
from biogrip.running.provenance import Provenance
from biogrip.running.resolved import write_study
from biogrip.running.rules import ProductRule, files_of, make_rules, needed_for
from biogrip.running.wholeness import check_results
from biogrip.stages.recording import check_traces
from biogrip.study.defaults import default_config, snakefile
from biogrip.study.load import load_study, read_configs
from biogrip.study.source import overlaid
from biogrip.study.study import Study
from biogrip.terminal import visible

RESULTS = Path("results")

done = False
"""True if `prepared` has checked the results in this process."""

# Options with which Snakemake runs no jobs; a dry run is none of them.
_NO_RUN = (
    *("archive", "cleanup_metadata", "cleanup_shadow", "conda_cleanup_envs", "containerize"),
    *("conda_create_envs_only", "container_cleanup_images", "d3dag", "dag", "delete_all_output"),
    *("delete_temp_output", "detailed_summary", "filegraph", "generate_unit_tests", "lint"),
    *("list_changes", "list_conda_envs", "list_input_changes", "list_params_changes"),
    *("list_rules", "list_target_rules", "list_untracked", "print_compilation", "report"),
    *("rulegraph", "summary", "touch", "unlock"),
)


def prepared(arguments: Sequence[str]) -> list[str]:
    """Check configs, traces and results as a run of Snakemake will find them.

    Parameters
    ----------
    arguments
        Arguments of Snakemake.

    Returns
    -------
    list of str
        Arguments of Snakemake, by which it makes outdated results again, and prints one line per
        job unless they ask for other output.

    Raises
    ------
    BiogripError
        If a config or a trace cannot be used, or a file that is not the study's is in the way.
    """
    global done
    options = _parsed(arguments)
    if options is None or Path(options.snakefile) != snakefile():
        # It is not this workflow that is run, or none.
        return [*arguments]
    folder = Path(options.directory or ".")
    study = _checked(options, folder)
    if any(getattr(options, name, None) for name in _NO_RUN):
        return [*arguments]
    if not options.dryrun:
        folder.mkdir(parents=True, exist_ok=True)
        if is_locked_by_dead(folder / ".snakemake"):
            _unlock(arguments)
    # Beside another run nothing is changed: Snakemake says so, and ends.
    if not folder.is_dir() or (not options.dryrun and is_locked(folder / ".snakemake")):
        return [*arguments]
    with chdir(folder):
        rules = make_rules(products().values(), Plan(study, RESULTS))
        check_results(RESULTS, files_of(rules), _may_make(rules), changing=not options.dryrun)
        if not options.dryrun:
            write_study(study, RESULTS)
        needed = needed_for(map(os.path.normpath, options.targets), rules)
        stale = [file for file in made_otherwise(rules, RESULTS) if file in needed]
    done = True
    again = ["--forcerun", *(options.forcerun or ()), *stale] if stale else []
    own = options.dryrun or options.verbose or options.logger or options.quiet is not None
    return [*([] if own else ["--logger", job_lines.NAME]), *again, *arguments]


def look(rules: Sequence[ProductRule], results: Path) -> None:
    """Print what `prepared` would put in order, and refuse what is in the way.

    Parameters
    ----------
    rules, results
        All products and jobs of the study, and its results folder.

    Raises
    ------
    BiogripError
        If a file that is not the study's is in the way.
    """
    check_results(results, files_of(rules), _may_make(rules), changing=False)
    stale = made_otherwise(rules, results)
    if stale:
        print(
            f"biogrip: made for other settings, by other code or of other files: {len(stale)} "
            f"results, the first {visible(stale[0])}. `biogrip run` makes them again; snakemake "
            "does where it has its own notes (.snakemake).",
            file=sys.stderr,
        )


def made_otherwise(rules: Iterable[ProductRule], results: Path) -> list[str]:
    """Return the results that were made otherwise than the study's jobs would."""
    found = Provenance(results, Manifest(results)).made_otherwise(rules)
    return [f"{results}/{name}" for name in found]


def _parsed(arguments: Sequence[str]) -> Any:
    """Return Snakemake's options; None if it will refuse them, or only print something."""
    from snakemake.cli import parse_args, parse_config

    try:
        # It says everything again.
        with redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()):
            options = parse_args([*arguments])[1]
            options.config = parse_config(options.config)
    except (Exception, SystemExit):
        return None
    return options


def _checked(options: Any, folder: Path) -> Study:
    """Return the study, after checks in the directory that Snakemake will run in."""
    files = [Path(name).absolute() for name in options.configfile or ()]
    over = overlaid(read_configs(files), options.config)
    # Keys in Snakemake's order: cases stand in tables as they do in the config.
    config = overlaid(overlaid(over, read_configs([default_config()])), over)
    # Paths of traces are relative to it; before the first run it need not exist.
    with chdir(folder if folder.is_dir() else "."):
        study = load_study(config, [default_config(), *files], command_line=options.config)
        check_traces(study)
    return study


def _unlock(arguments: Sequence[str]) -> None:
    command = [sys.executable, "-m", "snakemake", "--unlock", *arguments]
    subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False)


def _may_make(rules: Sequence[ProductRule]) -> Any:
    return lambda file: any(rule.makes(file) for rule in rules)
