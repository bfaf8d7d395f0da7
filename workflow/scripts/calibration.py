"""Calibrate the gripper by a test without sample."""

from pathlib import Path

from biogrip.stages.calibration import run
from biogrip.stages.job import job_case, logged

with logged(snakemake):
    run(
        job_case(snakemake),
        Path(snakemake.output.gripper),
        Path(snakemake.output.records),
    )
