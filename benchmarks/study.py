"""What the whole default study takes, job by job."""

import os
import shlex
import subprocess
import sys
import tempfile
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from graphlib import TopologicalSorter
from pathlib import Path

import yaml

from benchmarks.section import Row, Section, number
from benchmarks.setup import CONFIG
from biogrip.products.catalogue import products
from biogrip.products.plan import Plan, Wildcards
from biogrip.running.resolved import write_study
from biogrip.running.rules import ProductRule, files_of, make_rules
from biogrip.study.load import load_study
from biogrip.study.study import Study

_TOTAL = "all"
_STARTS = 3

_TEXT = f"""\
Processor time of every job of the default study, each in a process of its own by the command that
the workflow runs, one after the other in an empty folder; summed by rule. Processor time, unlike
wall time, hardly knows what else the machine does. Beside it what starting these processes takes:
a process that does no more than import what declares the job's products and makes them, the least
of {_STARTS}, times the number of jobs. Snakemake itself is not included."""


@dataclass(frozen=True)
class Job:
    """A job of the workflow.

    Parameters
    ----------
    rule
        What it makes.
    wildcards
        Of what.
    """

    rule: ProductRule
    wildcards: Wildcards

    @property
    def command(self) -> list[str]:
        """The command that the workflow runs."""
        return [
            sys.executable,
            "-m",
            "biogrip",
            "make",
            *shlex.split(self.rule.command(self.wildcards)),
        ]

    @property
    def imports(self) -> list[str]:
        """A command that loads what the job is made with, and ends."""
        modules = {
            module
            for product in self.rule.products
            for module in (product.module, *product.modules(self.wildcards))
        }
        names = ", ".join(("biogrip.cli", "biogrip.running.make", *sorted(modules)))
        return [sys.executable, "-c", f"import {names}"]

    @property
    def outputs(self) -> list[str]:
        """Files that it writes."""
        made = (product.outputs(self.wildcards) for product in self.rule.products)
        return [file for files in made for file in files.values()]


def study_section() -> Section:
    """Run the default study, and add up by rule."""
    study = load_study(yaml.safe_load(CONFIG.read_text()), [CONFIG])
    with tempfile.TemporaryDirectory() as name:
        rows = by_rule(in_order(study), study, Path(name))
    columns: dict[str, Callable[[Row], str]] = {
        "rule": lambda row: row["rule"].replace("_", " "),
        "jobs": lambda row: str(row["jobs"]),
        "processor time (s)": lambda row: number(row["processor_s"]),
        "of which to start (s)": lambda row: number(row["starting_s"]),
        "share of all": lambda row: f"{100 * row['share']:.1f} %",
    }
    return Section("study", "The whole study", _TEXT, columns, rows)


def in_order(study: Study) -> list[Job]:
    """Jobs of a study, each after those that make what it reads."""
    sheets = make_rules(products().values(), Plan(study, Path("results")))
    jobs = [Job(rule, wildcards) for rule in sheets for wildcards in rule.jobs]
    maker = {file: index for index, job in enumerate(jobs) for file in job.outputs}
    assert set(maker) == set(files_of(sheets))
    graph = {
        index: {
            maker[file]
            for files in job.rule.inputs(job.wildcards).values()
            for file in files
            if file in maker
        }
        for index, job in enumerate(jobs)
    }
    return [jobs[index] for index in TopologicalSorter(graph).static_order()]


def by_rule(jobs: Sequence[Job], study: Study, folder: Path) -> list[Row]:
    """Run jobs in a folder; a row a rule, the most expensive first, and one of all."""
    write_study(study, folder / "results")
    spent: dict[str, list[float]] = defaultdict(list)
    starting: dict[str, float] = defaultdict(float)
    # By command, for jobs of a rule may load different modules: those of a method.
    starts: dict[str, float] = {}
    for job, seconds in _run(jobs, folder):
        spent[job.rule.name].append(seconds)
        what = job.imports[-1]
        if what not in starts:
            starts[what] = min(processor_s(job.imports, folder) for _ in range(_STARTS))
        starting[job.rule.name] += starts[what]
    total_s = sum(map(sum, spent.values()))
    rows: list[Row] = [
        {
            "rule": name,
            "jobs": len(seconds),
            "processor_s": sum(seconds),
            "starting_s": starting[name],
            "share": sum(seconds) / total_s,
        }
        for name, seconds in sorted(spent.items(), key=lambda item: -sum(item[1]))
    ]
    all_s = {"processor_s": total_s, "starting_s": sum(starting.values()), "share": 1.0}
    return [*rows, {"rule": _TOTAL, "jobs": len(jobs), **all_s}]


def _run(jobs: Sequence[Job], folder: Path) -> Iterator[tuple[Job, float]]:
    for job in jobs:
        for file in job.outputs:
            (folder / file).parent.mkdir(parents=True, exist_ok=True)
        yield job, processor_s(job.command, folder)


def processor_s(command: Sequence[str], folder: Path) -> float:
    """Run a command in a folder, and return its processor time."""
    running = subprocess.Popen(
        command, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    _, status, used = os.wait4(running.pid, 0)
    running.returncode = os.waitstatus_to_exitcode(status)
    if running.returncode:
        raise subprocess.CalledProcessError(running.returncode, command)
    return used.ru_utime + used.ru_stime
