"""Declaration of products: what a Snakemake rule is generated from."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from biogrip.products.plan import Plan, Wildcards
from biogrip.products.uses import Uses
from biogrip.study.study import Study

PUBLISHED_TABLE_KINDS = (".csv", ".md", ".tex")
"""Formats of published tables; HTML is for the report only."""

TABLE_KINDS = (*PUBLISHED_TABLE_KINDS, ".html")
FIGURE_KINDS = (".png", ".pdf")


@dataclass(frozen=True)
class Weight:
    """Resources of a job on a cluster."""

    minutes: int = 5
    """Upper limit; every retry raises it."""
    megabytes: int = 1000
    """Likewise."""
    group: str | None = None
    """Successive jobs of a group are submitted as one."""
    local: bool = False
    """True if the job is too short to be worth submitting."""


LIGHT = Weight(local=True)
EVALUATION = Weight(10, 1000, group="case")
JUDGEMENT = Weight(60, 1000, group="verdicts")


@dataclass(frozen=True)
class Reads:
    """Input files of a product."""

    files: Callable[[Plan, Wildcards], list[str]]
    """Function of plan and wildcards that names the files."""
    one: bool = False
    """True if it is always a single file."""


def the(pattern: str) -> Reads:
    """Return the input that is a single file with the job's own wildcards."""
    return Reads(lambda _, job: [pattern.format(**job)], one=True)


def of_cases(pattern: str, cases: Callable[[Study], Iterable[str]]) -> Reads:
    """Return the input that has one file per case, or one per batch where the pattern has it."""
    if "{batch}" not in pattern:
        return Reads(lambda plan, _: [pattern.format(case=name) for name in cases(plan.study)])
    return Reads(
        lambda plan, _: [
            file for name in cases(plan.study) for file in plan.batch_files(pattern, name)
        ]
    )


def of_batches(pattern: str) -> Reads:
    """Return the input with all batches of the job's case, and of all methods if asked."""
    return Reads(lambda plan, job: plan.batch_files(pattern, job["case"]))


@dataclass(frozen=True)
class Product:
    """A product of the study, made by one or more jobs of a Snakemake rule."""

    name: str
    """Name in commands, logs and the report."""
    writes: Mapping[str, str]
    """Output files by name, as patterns with the job's wildcards in braces."""
    make: Callable[..., None]
    """Function that makes the outputs, called with the view of `uses`, and by keyword with the
    files of `reads` and `writes` (lists if there may be several), and ``method``, ``seeds`` or
    ``seed`` if any."""
    uses: Uses
    """Parts of the config that the function uses: it can read nothing else."""
    jobs: Callable[[Plan], Iterable[Wildcards]]
    """Function that returns the wildcards of every job in a plan."""
    message: str
    """Message of a job in the log, with wildcards in braces."""
    reads: Mapping[str, Reads] = field(default_factory=dict)
    """Input files by name."""
    weight: Weight = LIGHT
    """Resources of a job."""
    rule: str = ""
    """Products of a rule are made by one job, as start-up takes longer than most of them."""
    category: str = ""
    """Place in the report; a product without category is not in it."""
    item: str = ""
    """Likewise, within the category."""
    caption: str = ""
    """Caption in the report."""
    modules: Callable[[Wildcards], tuple[str, ...]] = lambda _: ()
    """Function of the wildcards that names further modules whose code the product depends on."""
    by_default: bool = True
    """True if a run makes it by default."""

    @property
    def module(self) -> str:
        """Name of the module that declares the product and holds its code."""
        return self.make.__module__

    def settings(self, study: Study, job: Wildcards) -> object:
        """Return the view of what a job uses."""
        return self.uses(study, job)

    def inputs(self, plan: Plan, job: Wildcards) -> dict[str, list[str]]:
        """Return the input files of a job by name."""
        return {name: reads.files(plan, job) for name, reads in self.reads.items()}

    def outputs(self, job: Wildcards) -> dict[str, str]:
        """Return the output files of a job by name."""
        return {name: pattern.format(**job) for name, pattern in self.writes.items()}

    def run(self, plan: Plan, job: Wildcards) -> None:
        """Run one job."""
        given: dict[str, Any] = {
            name: [Path(file) for file in files] for name, files in self.inputs(plan, job).items()
        }
        for name, reads in self.reads.items():
            if reads.one:
                (given[name],) = given[name]
        given |= {name: Path(file) for name, file in self.outputs(job).items()}
        if "method" in job:
            given["method"] = job["method"]
        if "batch" in job:
            given["seeds"] = plan.seeds_of(job["batch"])
        if "seed" in job:
            given["seed"] = int(job["seed"])
        self.make(self.settings(plan.study, job), **given)


def wildcards_of(names: Iterable[str]) -> list[Wildcards]:
    """Return the wildcards of jobs that are one per case."""
    return [{"case": name} for name in names]
