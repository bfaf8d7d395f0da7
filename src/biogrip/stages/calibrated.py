"""Input of jobs that use a calibrated gripper."""

from biogrip.instrument.calibrated_gripper import CALIBRATIONS
from biogrip.products.plan import Plan, Wildcards
from biogrip.products.product import Reads


def _files(plan: Plan, job: Wildcards) -> list[str]:
    return [CALIBRATIONS.format(**job)] if plan.study.case(job["case"]).is_calibrated else []


CALIBRATED = Reads(_files)
"""The calibration of the job's case; no file if it uses none."""
