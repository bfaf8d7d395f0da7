"""What the study makes: each thing declared beside the function that makes it."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from biogrip.products.plan import Plan, Wildcards
from biogrip.study.study import Study

PUBLISHED_TABLE_KINDS = (".csv", ".md", ".tex")
"""HTML is for the report alone."""

TABLE_KINDS = (*PUBLISHED_TABLE_KINDS, ".html")
FIGURE_KINDS = (".png", ".pdf")


@dataclass(frozen=True)
class Weight:
    """How heavy a job is, for a cluster.

    Parameters
    ----------
    minutes, megabytes
        What it takes at most; more of both at every retry.
    group
        Jobs of a group that follow one another are submitted as one.
    local
        Whether it is less work than submitting it.
    """

    minutes: int = 5
    megabytes: int = 1000
    group: str | None = None
    local: bool = False


LIGHT = Weight(local=True)
EVALUATION = Weight(10, 1000, group="case")
JUDGEMENT = Weight(60, 1000, group="verdicts")


@dataclass(frozen=True)
class Reads:
    """Files that a product is made from.

    Parameters
    ----------
    files
        Names them, given the plan and the wildcards of a job.
    one
        Whether it is always a single file.
    """

    files: Callable[[Plan, Wildcards], list[str]]
    one: bool = False


def the(pattern: str) -> Reads:
    """One file, named by the wildcards of the job itself."""
    return Reads(lambda _, job: [pattern.format(**job)], one=True)


def of_cases(pattern: str, cases: Callable[[Study], Iterable[str]]) -> Reads:
    """A file of each of some cases."""
    return Reads(lambda plan, _: [pattern.format(case=name) for name in cases(plan.study)])


def of_batches(pattern: str) -> Reads:
    """All batches of the job's case, of every method if the pattern has one."""
    return Reads(lambda plan, job: plan.batch_files(pattern, job["case"]))


@dataclass(frozen=True)
class Product:
    """Something that the study makes.

    Parameters
    ----------
    name
        Names it in commands, logs and the report.
    writes
        Files by name, as patterns with the wildcards of a job in braces.
    make
        Is called with the settings, then by keyword the files of `reads` and `writes`,
        a list where there may be several, and ``seeds`` or ``seed`` if it has any.
    settings
        All of the config that it uses, from the study and the wildcards.
    jobs
        Which jobs a study has of it; wildcards of each.
    message
        What a job says that it does, with wildcards in braces.
    reads
        Files that it is made from, by name.
    weight
        How heavy a job is.
    sheet
        Products of the same sheet are made by one job: starting one takes longer than most.
    category, item, caption
        Where in the report its page stands, and what is said of it; none without a category.
    modules
        Modules it is made by beside its own, given the wildcards.
    asked
        Whether a run makes it without being asked.
    """

    name: str
    writes: Mapping[str, str]
    make: Callable[..., None]
    settings: Callable[[Study, Wildcards], object]
    jobs: Callable[[Plan], Iterable[Wildcards]]
    message: str
    reads: Mapping[str, Reads] = field(default_factory=dict)
    weight: Weight = LIGHT
    sheet: str = ""
    category: str = ""
    item: str = ""
    caption: str = ""
    modules: Callable[[Wildcards], tuple[str, ...]] = lambda _: ()
    asked: bool = True

    @property
    def module(self) -> str:
        """Name of the module that declares it, and holds what makes it."""
        return self.make.__module__

    def inputs(self, plan: Plan, job: Wildcards) -> dict[str, list[str]]:
        """Files that a job reads, by name."""
        return {name: reads.files(plan, job) for name, reads in self.reads.items()}

    def outputs(self, job: Wildcards) -> dict[str, str]:
        """Files that a job writes, by name."""
        return {name: pattern.format(**job) for name, pattern in self.writes.items()}

    def run(self, plan: Plan, job: Wildcards) -> None:
        """Do one job."""
        given: dict[str, Any] = {
            name: [Path(file) for file in files] for name, files in self.inputs(plan, job).items()
        }
        for name, reads in self.reads.items():
            if reads.one:
                (given[name],) = given[name]
        given |= {name: Path(file) for name, file in self.outputs(job).items()}
        if "batch" in job:
            given["seeds"] = plan.seeds_of(job["batch"])
        if "seed" in job:
            given["seed"] = int(job["seed"])
        self.make(self.settings(plan.study, job), **given)


def wildcards_of(names: Iterable[str]) -> list[Wildcards]:
    """Jobs that are one a case."""
    return [{"case": name} for name in names]


@dataclass(frozen=True)
class Scope:
    """Of what there is a table or figure: of the study, of each of some cases, or of each sweep.

    Parameters
    ----------
    cases
        Which cases; None where it is not of cases.
    sweeps
        Whether it is of sweeps.
    when
        Whether a study has it.
    """

    cases: Callable[[Study], Iterable[str]] | None
    sweeps: bool
    when: Callable[[Study], bool]

    @property
    def whose(self) -> str:
        """The wildcard in braces; nothing of the study's."""
        return "{case}" if self.cases else "{sweep}" if self.sweeps else ""

    def jobs(self, plan: Plan) -> list[Wildcards]:
        """Jobs that a study has of it."""
        if not self.when(plan.study):
            return []
        if self.sweeps:
            return [{"sweep": sweep} for sweep in plan.study.sweeps]
        return wildcards_of(self.cases(plan.study)) if self.cases else [{}]

    def settings(self, choose: Callable[..., object], study: Study, job: Wildcards) -> object:
        """Call a function that chooses settings with the study, and the case or sweep."""
        if self.sweeps:
            return choose(study, study.sweeps[job["sweep"]])
        return choose(study, study.case(job["case"])) if self.cases else choose(study)
