"""Calibrate the gripper by a test without sample."""

from pathlib import Path

from biogrip.stages.job import job_case, logged
from biogrip.stages.targets import run

with logged(snakemake):
    run(
        job_case(snakemake),
        Path(snakemake.output.gripper),
        Path(snakemake.output.records),
    )
