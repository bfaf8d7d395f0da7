"""Studies small enough for tests, run by Snakemake or by the command, and what they wrote."""

import fcntl
import os
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import NamedTemporaryFile

import pytest

from tests.helpers import loaded
from tests.helpers.places import ROOT

# A whole study in a few seconds: real physics and algorithm, little of each.
_PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
_WHEEL = _PROJECT["tool"]["hatch"]["build"]["targets"]["wheel"]["force-include"]
SHIPPED = [name for name in _WHEEL if name.startswith("results/")]
"""What claims read beside the code."""

SMALL = """
seeds: 4
batch_size: 2
measurement: {rate_Hz: 1.0}
methods: [genetic, least_squares, differential_evolution]
least_squares: {candidates: 100, starts: 4}
differential_evolution: {popsize: 5, maxiter: 20}
identifiability: {coverage_seeds: 6}
model_selection: {models: [maxwell, generalized_maxwell]}
genetic_algorithm: {population: 60, survivors: 30, min_generations: 10, max_generations: 25}
cases:
  liquid_drop_1: null
"""

# Folders of what is compared where figures and pages are not looked at.
COMPARED = ("results/tables", "results/targets", "results/identifications")

# Every kind of file, and of each as little as there can be.
TINY = """
seeds: 2
batch_size: 1
measurement: {rate_Hz: 0.5}
methods: [least_squares, genetic]
least_squares: {candidates: 50, starts: 3}
genetic_algorithm: {population: 20, survivors: 10, min_generations: 2, max_generations: 4}
identifiability: {coverage_seeds: 2}
model_selection: {models: [damper, maxwell]}
cases:
  endothelial_cell: null
  liquid_drop_1: null
"""

# A trace of a user's, and nothing else.
RECORDED = """
methods: [least_squares]
model_selection: {models: [damper, liquid_drop]}
only: [my_trace]
cases:
  my_trace:
    sample: {model: generalized_maxwell}
    measurement: {file: mine.csv, time: time_s, rotation: rotation_rad}
"""


@dataclass(frozen=True)
class Run:
    """What a call of a program came to."""

    status: int
    output: str

    def jobs(self, rule: str) -> int:
        """How many jobs of a rule were run or would be."""
        return self.all_jobs().get(rule, 0)

    def all_jobs(self) -> dict[str, int]:
        """How many jobs of each rule were run or would be (from the job table)."""
        rows = [line.split() for line in self.output.splitlines()]
        table = {
            row[0]: int(row[1])
            for row in rows
            if len(row) == 2 and row[0].isidentifier() and row[1].isdigit()
        }
        return {rule: jobs for rule, jobs in table.items() if rule not in ("all", "total")}


def replaced(text: str, old: str, new: str) -> str:
    """Replace a part of a text that is there: what was renamed would change nothing otherwise."""
    assert old in text, old
    return text.replace(old, new)


def waited_for(run: Run) -> set[str]:
    """Files that `all` would wait for in a dry run, of those that the run would make."""
    _, _, told = run.output.partition(": The whole study;")
    reason = next(line for line in told.splitlines() if line.startswith("Reason: "))
    return set(reason.partition("another job: ")[2].split(", "))


def snakemake(
    folder: Path,
    *arguments: str,
    config: str = SMALL,
    environment: dict[str, str] | None = None,
    tree: "Tree | None" = None,
) -> Run:
    """Run the repository's workflow in a folder of its own, over a config laid on the default.

    In an environment of its own by a program that is started.
    """
    overlay = folder / "overlay.yaml"
    overlay.write_text(config)
    jobs = () if any(a.startswith(("-j", "--profile")) for a in arguments) else ("-j2",)
    root = ROOT if tree is None else tree.root
    given = [*jobs, *arguments, "--snakefile", str(root / "Snakefile"), "--directory", str(folder)]
    given += ["--configfile", str(overlay)]
    if environment is None:
        return _loaded("snakemake", given, root, os.environ if tree is None else tree.environment)
    done = subprocess.run(
        [sys.executable, "-m", "snakemake", *given],
        cwd=root,
        env={**os.environ, **environment},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=600,
    )
    return Run(done.returncode, done.stdout)


def _loaded(
    program: str, arguments: Sequence[str], folder: Path, environment: Mapping[str, str]
) -> Run:
    with NamedTemporaryFile("w+") as said:
        status = loaded.call(program, arguments, folder, environment, (said, said))
        said.seek(0)
        return Run(status, said.read())


def called(folder: Path, *arguments: str | Path) -> Run:
    """Run a command of the command line in a folder, by a process that is loaded already."""
    return _loaded("biogrip", [*map(str, arguments)], folder, os.environ)


def run(folder: Path, *arguments: str, config: str = SMALL) -> Run:
    """Run a study by `biogrip run` in a folder of its own, over a config laid on the default."""
    (folder / "overlay.yaml").write_text(config)
    return called(folder, "run", "overlay.yaml", "-j2", *arguments)


def biogrip(folder: Path, *arguments: str | Path) -> "subprocess.CompletedProcess[str]":
    """Run a command of the command line in a folder, and wait for it."""
    command = [sys.executable, "-m", "biogrip", *map(str, arguments)]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=300)


def started(folder: Path, *arguments: str | Path) -> "subprocess.Popen[str]":
    """Start a command of the command line in a folder, both outputs in one."""
    return subprocess.Popen(
        [sys.executable, "-m", "biogrip", *map(str, arguments)],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )


@dataclass(frozen=True)
class Tree:
    """A copy of the repository that may be edited, and a study in it."""

    root: Path
    study: Path

    @property
    def environment(self) -> dict[str, str]:
        """In which Python finds the copy."""
        return {**os.environ, "PYTHONPATH": str(self.root / "src")}

    def run(self, *arguments: str, config: str = SMALL) -> Run:
        """Run the copy's workflow in its study."""
        return snakemake(self.study, *arguments, tree=self, config=config)


def copied_tree(folder: Path) -> Tree:
    """Copy what a study runs by, but no study."""
    for name in ("src", "workflow", "config", "profiles"):
        shutil.copytree(ROOT / name, folder / name)
    shutil.copy(ROOT / "Snakefile", folder)
    for name in SHIPPED:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, folder / name)
    return Tree(folder, folder / "study")


def built_once(
    name: str,
    build: Callable[[Path], None],
    tmp_path_factory: pytest.TempPathFactory,
    worker_id: str,
) -> Path:
    """Build a folder unless another worker has."""
    own = tmp_path_factory.getbasetemp()
    folder = (own if worker_id == "master" else own.parent) / name
    with folder.with_suffix(".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not folder.exists():
            building = tmp_path_factory.mktemp("building")
            build(building)
            shutil.copytree(building, folder)
    return folder


def tables(folder: Path) -> dict[str, bytes]:
    """Every file of results that is compared, by name."""
    results = folder / "results"
    return {
        str(path.relative_to(results)): path.read_bytes()
        for kind in COMPARED
        for path in sorted((folder / kind).glob("*.*"))
    }


def results_of(folder: Path) -> dict[str, bytes]:
    """Every result by name, but for what tells times, and for logs and records."""
    results = folder / "results"
    found = (path.relative_to(results) for path in sorted(results.rglob("*.*")))
    return {
        str(name): (results / name).read_bytes()
        for name in found
        if (results / name).is_file()
        and name.parts[0] not in ("logs", "timings", ".manifest", "manifest.jsonl")
        and not name.name.startswith("timings.")
    }
