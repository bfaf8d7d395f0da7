"""The study that all rules work on."""

import shlex
import sys
from pathlib import Path

from snakemake.settings.types import ExecMode

from biogrip.errors import BiogripError
from biogrip.products.catalogue import products
from biogrip.products.plan import Plan
from biogrip.products.stages.recording import check_traces
from biogrip.running.locks import sign_locks
from biogrip.running.provenance import Provenance
from biogrip.running.resolved import write_study
from biogrip.running.rules import files_of, make_rules
from biogrip.running.wholeness import Claim, hold_against_record
from biogrip.study.load import load_study
from biogrip.study.source import read_places
from biogrip.terminal import visible_lines

DEFAULT_CONFIG = Path(workflow.basedir) / "config" / "config.yaml"

# Rules find the biogrip command of the Python that runs Snakemake, activated or not.
COMMANDS = shlex.quote(str(Path(sys.executable).parent))
# A shell that is stopped ends after its command, not before.
shell.prefix(f"trap : TERM; set -euo pipefail; PATH={COMMANDS}:$PATH; ")

# Leaving with the message alone keeps Snakemake's stack out of it.
try:
    read_places([DEFAULT_CONFIG])
except BiogripError as error:
    sys.exit(f"biogrip: {visible_lines(error)}")


configfile: DEFAULT_CONFIG


try:
    STUDY = load_study(
        config,
        files=[DEFAULT_CONFIG, *workflow.overwrite_configfiles],
        command_line=workflow.config_settings.config,
    )
    if workflow.exec_mode == ExecMode.DEFAULT:
        check_traces(STUDY)
except BiogripError as error:
    sys.exit(f"biogrip: {visible_lines(error)}")

RESULTS = Path("results")

if workflow.exec_mode == ExecMode.DEFAULT:
    hold_against_record(
        workflow,
        RESULTS,
        requested=lambda: ALL_FILES,
        made_otherwise=lambda manifest: Provenance(RESULTS, manifest).made_otherwise(
            SHEETS
        ),
        begin=lambda: write_study(STUDY, RESULTS),
    )

CLAIM = Claim(RESULTS)


onstart:
    sign_locks(Path(".snakemake"))
    try:
        jobs = list(workflow.dag.needrun_jobs())
        CLAIM.begin(
            [Path(file) for job in jobs for file in job.output],
            [Path(file) for job in jobs for file in job.log],
        )
    except BiogripError as error:
        sys.exit(f"biogrip: {visible_lines(error)}")


onsuccess:
    CLAIM.end()


onerror:
    CLAIM.end()
    print(
        "biogrip: not finished. Nothing that is done is lost: the same command goes on."
    )


PLAN = Plan(STUDY, RESULTS)
SHEETS = make_rules(products().values(), PLAN)
ALL_FILES = files_of(SHEETS)
# The report's captions are looked up by rule: among the parameters, they would make things again.
config["captions"] = {rule.name: rule.caption for rule in SHEETS}
