"""The study that all rules work on."""

import shlex
import sys
from pathlib import Path

from snakemake.settings.types import ExecMode

from biogrip.products.catalogue import products
from biogrip.products.plan import Plan
from biogrip.stages.recording import check_traces
from biogrip.running import preparation
from biogrip.running.locks import sign_locks
from biogrip.running.provenance import Provenance
from biogrip.running.resolved import read_study, write_study
from biogrip.running.rules import (
    GROUPS,
    ProductRule,
    files_of,
    make_rules,
)
from biogrip.running.wholeness import Claim, message_only, say_what_else_is_there
from biogrip.study.load import load_study
from biogrip.study.source import read_places

DEFAULT_CONFIG = Path(workflow.basedir) / "config" / "config.yaml"

# Rules find the biogrip command of the Python that runs Snakemake, activated or not.
COMMANDS = shlex.quote(str(Path(sys.executable).parent))
# A shell that is stopped ends after its command, not before.
shell.prefix(f"trap : TERM; set -euo pipefail; PATH={COMMANDS}:$PATH; ")

with message_only():
    read_places([DEFAULT_CONFIG])


configfile: DEFAULT_CONFIG


RESULTS = Path("results")

with message_only():
    if workflow.exec_mode == ExecMode.DEFAULT:
        STUDY = load_study(
            config,
            files=[DEFAULT_CONFIG, *workflow.overwrite_configfiles],
            command_line=workflow.config_settings.config,
        )
        check_traces(STUDY)
    else:
        # On another node: what the run was planned with.
        STUDY = read_study(RESULTS)

PLAN = Plan(STUDY, RESULTS)
RULES = make_rules(products().values(), PLAN)
ALL_FILES = files_of(RULES)
# The report's captions are looked up by rule: among the parameters, they would make things again.
config["captions"] = {rule.name: rule.caption for rule in RULES}
# The rules in stages.smk, which stand there one by one.
STAGES = (
    "target",
    "measurement",
    "identification",
    "identifications",
    "judgement",
    "errors_of_case",
    "errors",
)


def cases_of(stage):
    """The cases that have a stage, as a regular expression; one that nothing matches if none has."""
    jobs = products()[stage].jobs(PLAN)
    return "|".join(sorted({job["case"] for job in jobs})) or "(?!)"


def made_for(stage):
    """Digest of the settings and the code of a job: if it changes, the job is done again."""
    return ProductRule(stage, (products()[stage],), PLAN).digest


def batches_of(pattern):
    """The files of all methods and batches of seeds of a case."""
    return lambda wildcards: PLAN.batch_files(pattern, wildcards.case)


def calibration_of(wildcards):
    """The calibration of the gripper, for a case that uses one."""
    case = STUDY.case(wildcards.case)
    return [f"results/calibrations/{case.name}.yaml"] if case.is_calibrated else []


def rows_of(wildcards):
    """The rows of the table that a batch has, as `biogrip identify --rows` chooses them."""
    first, last = map(int, wildcards.rows.split("-"))
    return TABLE[first : last + 1]


def batches_of_traces(wildcards):
    """The tables of all batches."""
    size = TRACES.rows_a_batch
    firsts = range(0, len(TABLE), size)
    return [
        f"results/traces/batches/{first}-{first + size - 1}.csv" for first in firsts
    ]


CLAIM = Claim(RESULTS)

# `biogrip run` has checked already, and put right what can be.
if workflow.exec_mode == ExecMode.DEFAULT and not preparation.done:
    with message_only():
        preparation.look(RULES, RESULTS)


# A Snakefile that takes this one in as a module calls `begin` and `end` in hooks of its own.
def begin():
    """Refuse what is not the study's before jobs replace it, and say what the study is."""
    # Tables of the user's traces are not on record.
    jobs = [
        job
        for job in workflow.dag.needrun_jobs()
        if job.rule.name not in ("traces_batch", "traces")
    ]
    with message_only():
        CLAIM.begin(
            [Path(file) for job in jobs for file in job.output],
            [Path(file) for job in jobs for file in job.log],
            [Path(file) for job in jobs for file in job.input],
            lambda manifest: Provenance(RESULTS, manifest).made_otherwise(RULES),
            touching=workflow.touch,
        )
        write_study(STUDY, RESULTS)
    sign_locks(Path(".snakemake"))


def end():
    """Record what the jobs have written, and say what else there is."""
    CLAIM.end()
    say_what_else_is_there(RESULTS, files_of(RULES))


onstart:
    begin()


onsuccess:
    end()


onerror:
    end()
    print(
        "biogrip: not finished. Nothing that is done is lost: the same command goes on."
    )
