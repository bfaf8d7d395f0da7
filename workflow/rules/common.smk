"""The study that all rules work on."""

import re
import shlex
import sys
from pathlib import Path

from snakemake.settings.types import ExecMode

import biogrip
from biogrip.errors import BiogripError
from biogrip.identify.methods import METHODS
from biogrip.running.locks import sign_locks
from biogrip.running.manifest import Manifest
from biogrip.running.wholeness import claim, held_against_record
from biogrip.study.config import load_study
from biogrip.study.modules import fingerprint, source_files
from biogrip.study.plan import Plan
from biogrip.study.source import read_places

DEFAULT_CONFIG = Path(workflow.basedir) / "config" / "config.yaml"

# Rules find the biogrip command of the Python that runs Snakemake, activated or not.
COMMANDS = shlex.quote(str(Path(sys.executable).parent))
shell.prefix(f"set -euo pipefail; PATH={COMMANDS}:$PATH; ")

# Leaving with the message alone keeps Snakemake's stack out of it.
try:
    read_places([DEFAULT_CONFIG])
except BiogripError as error:
    sys.exit(f"biogrip: {error}")


configfile: DEFAULT_CONFIG


try:
    STUDY = load_study(
        config,
        files=[DEFAULT_CONFIG, *workflow.overwrite_configfiles],
        command_line=workflow.config_settings.config,
    )
except BiogripError as error:
    sys.exit(f"biogrip: {error}")

RESULTS = Path("results")

if workflow.exec_mode == ExecMode.DEFAULT:
    workflow.execute = held_against_record(
        workflow.execute,
        RESULTS,
        asked=lambda: ALL_FILES,
        may_make=lambda file: any(rule.is_producer(file) for rule in workflow.rules),
    )


onstart:
    sign_locks(Path(".snakemake"))
    try:
        jobs = list(workflow.dag.needrun_jobs())
        claim(
            RESULTS,
            [Path(file) for job in jobs for file in job.output],
            [Path(file) for job in jobs for file in job.log],
        )
    except BiogripError as error:
        sys.exit(f"biogrip: {error}")


onsuccess:
    Manifest(RESULTS).save()


onerror:
    Manifest(RESULTS).save()
    print(
        "biogrip: not finished. Nothing that is done is lost: the same command goes on."
    )


# Matches no case.
NONE = "(?!)"
PLAN = Plan(STUDY, Path("results"))
CASES = list(STUDY.cases)
COMPARES_MODELS = bool(STUDY.config["model_selection"]["models"])
# Asked for by themselves, or one that is lost would be missed only when it is needed.
STAGES_IN_BATCHES = [
    *("measurements", "identifications", "histories", "timings"),
    *(["selection"] if COMPARES_MODELS else []),
    *(["coverage"] if PLAN.covered else []),
]
PUBLISHED_CASES = [name for name, case in STUDY.cases.items() if case.published]


def calibrations_of(case):
    """The calibration that a case relies on, if it does."""
    return [f"results/calibrations/{case}.yaml"] if PLAN.is_calibrated(case) else []


def expectation_of(case):
    """What the traces of a case should tell, where its truth is known."""
    known = case in PLAN.simulated
    return [f"results/identifiability/expected/{case}.json"] if known else []


wildcard_constraints:
    case="[A-Za-z][A-Za-z0-9_-]*",
    batch=r"seeds_\d+-\d+",
    method="[a-z_]+",
