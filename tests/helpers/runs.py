"""Small studies that Snakemake runs, each in a folder of its own, and what it would run."""

import multiprocessing
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import Any

import yaml

from tests.helpers.places import ROOT

_SECONDS = 1200
_JOBS = re.compile(r"^(\w+) +(\d+) *$", re.MULTILINE)

# Every kind of file, and of each as little as there can be: a simulated sample, and a trace that
# a user recorded, which is `mine.csv` in the study's folder.
TINY: dict[str, Any] = yaml.safe_load("""
seeds: 2
batch_size: 2
measurement: {rate_Hz: 0.5}
methods: [genetic, least_squares]
least_squares: {candidates: 50, starts: 3}
genetic_algorithm: {population: 20, survivors: 10, min_generations: 2, max_generations: 4}
identifiability: {coverage_seeds: 2}
model_selection: {models: [damper, maxwell]}
cases:
  endothelial_cell: null
  liquid_drop_1: null
  mine:
    title: A trace of mine
    sample: {model: generalized_maxwell}
    measurement: {file: mine.csv, time: time_s, rotation: rotation_rad}
""")
SMALL = {key: value for key, value in TINY.items() if key != "cases"}
"""What makes runs of any cases small."""
ONE_CASE = SMALL | {"methods": ["genetic"], "only": ["liquid_drop_2"]}
ONE_CASE |= {"identifiability": {"coverage_seeds": 0}, "model_selection": {"models": []}}


def jobs_of(dry_run: str) -> dict[str, int]:
    """Number of jobs of each rule, from the last table of jobs of what a dry run says."""
    found = {rule: int(jobs) for rule, jobs in _JOBS.findall(dry_run)}
    return {rule: jobs for rule, jobs in found.items() if rule not in ("all", "study", "total")}


def _environment() -> dict[str, str]:
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    return {**os.environ, "PATH": path}


def ran(folder: Path, *command: str | Path, status: int = 0, **environment: str) -> str:
    """What a command says that ends with a status, with the commands of this Python in its path."""
    done = subprocess.run(
        [*map(str, command)],
        cwd=folder,
        env=_environment() | environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=_SECONDS,
    )
    assert done.returncode == status, done.stdout
    return done.stdout


# Processes for Snakemake come from one that has loaded it: of 4 s of a dry run that is 3.
_LOADED = multiprocessing.get_context("forkserver")
_USED = "snakemake.cli snakemake.report smart_open yte pandas biogrip_study.config.study"
_USED += " biogrip_study.stages.job biogrip.command.settings"
_LOADED.set_forkserver_preload(_USED.split())
_PYTHONPATH = os.environ.get("PYTHONPATH")


def called(folder: Path, *arguments: str | Path, status: int = 0) -> str:
    if os.environ.get("PYTHONPATH") != _PYTHONPATH:
        # With other code than what is loaded.
        return ran(folder, sys.executable, "-m", "snakemake", *arguments, status=status)
    with NamedTemporaryFile("r") as said:
        given = (folder, [*map(str, arguments)], _environment(), said.name)
        process = _LOADED.Process(target=_snakemake, args=given)
        process.start()
        process.join(_SECONDS)
        if process.exitcode is None:
            process.kill()
            raise TimeoutError(said.read())
        output = said.read()
        assert process.exitcode == status, output
        return output


def _snakemake(
    folder: Path, arguments: list[str], environment: dict[str, str], output: str
) -> None:
    os.chdir(folder)
    os.environ.clear()
    os.environ.update(environment)
    with Path(output).open("w") as stream:
        for said in (sys.stdout, sys.stderr):
            os.dup2(stream.fileno(), said.fileno())
    from snakemake.cli import main

    main(arguments)


def clone(folder: Path) -> Path:
    for name in ("src", "config", "workflow"):
        shutil.copytree(ROOT / name, folder / name)
    return Path(shutil.copy(ROOT / "Snakefile", folder))


def snakemake(
    folder: Path,
    *arguments: str | Path,
    config: dict[str, Any] | None = None,
    snakefile: Path = ROOT / "Snakefile",
    status: int = 0,
) -> str:
    """Run the workflow in a folder, over a config laid on the default study, as `overlay.yaml`."""
    given: list[str | Path] = ["-s", snakefile, "--directory", folder]
    if config is not None:
        (folder / "overlay.yaml").write_text(yaml.safe_dump(config), encoding="utf-8")
        given += ["--configfile", folder / "overlay.yaml"]
    if not any(str(argument).startswith(("-j", "--profile")) for argument in arguments):
        given.append("-j2")
    return called(folder, *given, *arguments, status=status)


def dry_run(
    folder: Path, *arguments: str, config: dict[str, Any], snakefile: Path = ROOT / "Snakefile"
) -> str:
    # Other workers ask in the same folder.
    with NamedTemporaryFile("w", suffix=".yaml") as overlay:
        yaml.safe_dump(config, overlay)
        overlay.flush()
        options = ("--dry-run", "--configfile", overlay.name, "--workflow-profile", "none")
        return snakemake(folder, *options, *arguments, snakefile=snakefile)


def planned(folder: Path, *targets: str, config: dict[str, Any]) -> dict[str, int]:
    return jobs_of(dry_run(folder, "--quiet", "rules", "--", *targets, config=config))


def results_of(folder: Path) -> dict[str, bytes]:
    results = folder / "results"
    left_out = {results / "logs", results / "benchmarks"}
    files = [it for it in results.rglob("*.*") if it.is_file() and not left_out & {*it.parents}]
    return {str(file.relative_to(results)): file.read_bytes() for file in files}
