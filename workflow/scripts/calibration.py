"""Calibrate the gripper by a test without sample."""

from biogrip.stages.job import logged, run
from biogrip.stages.targets import calibrate_gripper

with logged(snakemake):
    run(snakemake, calibrate_gripper)
