"""Rules as Snakemake's own commands show them."""

import csv
import os
import re
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any

import pytest
from biogrip.products.catalogue import products
from biogrip.products.plan import Plan
from biogrip.running.rules import ProductRule, inputs_of, make_rules
from snakemake.api import SnakemakeApi
from snakemake.settings.types import OutputSettings, Quietness, ResourceSettings

from tests.helpers import loaded
from tests.helpers.default import study_of
from tests.helpers.places import ROOT
from tests.helpers.runs import TINY, snakemake

STAGES = [
    "target",
    "measurement",
    "identification",
    "identifications",
    "judgement",
    "errors_of_case",
    "errors",
]


def shown(folder: Path, *arguments: str) -> str:
    """What Snakemake says of the default study, without being told of processors."""
    status, said = called(folder, *arguments)
    assert status == 0, said
    return said


def called(folder: Path, *arguments: str) -> tuple[int, str]:
    given = ["--directory", str(folder), *arguments]
    with TemporaryFile("w+") as said:
        status = loaded.call("snakemake", given, ROOT, os.environ, (said, said))
        said.seek(0)
        return status, said.read()


@pytest.mark.parametrize("graph", ["--dag", "--rulegraph"])
def test_graphs_need_no_number_of_processors(tmp_path: Path, graph: str) -> None:
    assert "digraph snakemake_dag {" in shown(tmp_path, graph)


def test_a_table_of_errors_plans_only_what_it_needs(tmp_path: Path) -> None:
    """Targets, noise and identifications of three cases by four methods, put together."""
    rows = [
        line.split() for line in shown(tmp_path, "-n", "results/tables/errors.csv").splitlines()
    ]
    jobs = {row[0]: int(row[1]) for row in rows if len(row) == 2 and row[1].isdigit()}
    assert jobs == {
        "target": 3,
        "measurement": 3,
        "identification": 12,
        "identifications": 3,
        "errors_of_case": 3,
        "errors": 1,
        "total": 25,
    }


def test_linting_wants_conda_and_nothing_else(tmp_path: Path) -> None:
    """Which nobody needs here: the environment is locked."""
    _, said = called(tmp_path, "--lint")
    wanted = {line.strip() for line in said.splitlines() if line.startswith("    * ")}
    assert wanted == {"* Specify a conda environment or container for each rule.:"}


@pytest.fixture(scope="module")
def declared() -> dict[str, ProductRule]:
    """The rules of the default study, as the products declare them."""
    plan = Plan(study_of(""), Path("nowhere"))
    return {rule.name: rule for rule in make_rules(products().values(), plan)}


@pytest.fixture(scope="module")
def written() -> dict[str, Any]:
    """The rules as Snakemake reads them."""
    with SnakemakeApi(OutputSettings(quiet={Quietness.ALL})) as api:
        workflow = api.workflow(resource_settings=ResourceSettings(), snakefile=ROOT / "Snakefile")
        rules = {rule.name: rule for rule in workflow._workflow.rules}
        local = workflow._workflow._localrules
        return {name: (rule, name in local) for name, rule in rules.items()}


@pytest.mark.parametrize("stage", STAGES)
def test_a_stage_is_a_rule_as_its_product_declares_it(
    declared: dict[str, ProductRule], written: dict[str, Any], stage: str
) -> None:
    (own, local), rule = written[stage], declared[stage]
    outputs = [re.sub(r"{(\w+),[^}]*}", r"{\1}", str(file)) for file in own.output]
    assert outputs == list(rule.outputs.values())
    assert own.message == rule.message
    assert (own._group, local) == (rule.weight.group, rule.weight.local)
    assert own.wildcard_constraints.keys() == rule.constraints.keys()
    for attempt in (1, 2):
        for name, asked in (("runtime", rule.runtime), ("mem_mb", rule.megabytes)):
            resource = own.resources[name].evaluate({}, attempt=attempt)
            assert resource.value == asked({}, attempt)


def test_jobs_of_stages_are_those_that_their_products_declare(tiny_copy: Path) -> None:
    """What they read, and the command, which has the digest of the settings and the log."""
    plan = Plan(study_of(TINY), Path("nowhere"))
    rules = [s for s in make_rules(products().values(), plan) if s.name in STAGES]
    said = snakemake(tiny_copy, "--detailed-summary", config=TINY).output
    rows = csv.DictReader(said[said.index("output_file\t") :].splitlines(), delimiter="\t")
    found = {row["output_file"]: row for row in rows if row["rule"] in STAGES}
    declared = {
        file: (rule, job)
        for rule in rules
        for job in rule.jobs
        for file in (pattern.format(**job) for pattern in rule.outputs.values())
    }
    assert found.keys() == declared.keys()
    for file, (rule, job) in declared.items():
        assert sorted({*found[file]["input-file(s)"].split(",")} - {""}) == inputs_of(rule, job)
        command, log = found[file]["shellcmd"].split(" 2> ")
        assert (found[file]["rule"], log) == (rule.name, rule.log.format(**job))
        options = [*rule.command(job).split(), "--made-for", rule.digest(job)]
        assert sorted(command.split()) == sorted(["biogrip", "make", *options])
