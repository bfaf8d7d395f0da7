"""The calibration that a case relies on, if it does."""

from biogrip.instrument.calibrated_gripper import CALIBRATIONS
from biogrip.products.plan import Plan, Wildcards
from biogrip.products.product import Reads


def calibration_of() -> Reads:
    """Read the calibration of the job's case, where its gripper is to be a calibrated one."""
    return Reads(_files)


def _files(plan: Plan, job: Wildcards) -> list[str]:
    return [CALIBRATIONS.format(**job)] if plan.study.case(job["case"]).is_calibrated else []
