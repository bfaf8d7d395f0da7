"""A study made job by job in this process, in the order in which jobs read one another's files.

What is made is what Snakemake's jobs make, by the same commands; of a rule with several
products only those that are wanted, if not all are. Neither Snakemake nor a
process for each job has to be started, which takes most of the time of a small study.
"""

import shlex
from collections.abc import Iterable
from contextlib import chdir
from pathlib import Path

from biogrip.cli import main
from biogrip.products.catalogue import products
from biogrip.products.plan import Plan, Wildcards
from biogrip.running.resolved import write_study
from biogrip.running.rules import ProductRule, make_rules
from biogrip.study.study import Study


def make_in_process(folder: Path, study: Study, wanted: Iterable[str] | None = None) -> None:
    """Make files of a study, and all that they are made from.

    Parameters
    ----------
    folder
        Where the results folder is to be.
    study
        What is made.
    wanted
        Files from the folder on; all that a run makes if that is not given.
    """
    with chdir(folder):
        results = Path("results")
        write_study(study, results)
        plan = Plan(study, results)
        alone = [ProductRule(p.name, (p,), plan, tuple(p.jobs(plan))) for p in products().values()]
        rules = make_rules(products().values(), plan) if wanted is None else alone
        makers = _makers(rules)
        for file in makers if wanted is None else wanted:
            _make(file, makers)


def inputs_and_outputs(study: Study) -> tuple[set[str], set[str]]:
    """Every file that a run of a study reads, and every one that it makes, from nothing."""
    makers = _makers(make_rules(products().values(), Plan(study, Path("nowhere"))))
    read = {
        file
        for rule, job in makers.values()
        for files in rule.inputs(job).values()
        for file in files
    }
    return read, set(makers)


def _makers(rules: Iterable[ProductRule]) -> dict[str, tuple[ProductRule, Wildcards]]:
    """Sheet and job that make each file."""
    return {
        pattern.format(**job): (rule, job)
        for rule in rules
        for job in rule.jobs
        for pattern in rule.outputs.values()
    }


def _make(file: str, makers: dict[str, tuple[ProductRule, Wildcards]]) -> None:
    if Path(file).exists():
        return
    rule, job = makers[file]
    for needed in {file for files in rule.inputs(job).values() for file in files}:
        _make(needed, makers)
    made_for = ["--made-for", rule.digest(job)]
    assert main(["make", *shlex.split(rule.command(job)), *made_for]) == 0, file
