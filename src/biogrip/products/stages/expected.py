"""Input of jobs that use the expected verdicts of a simulated case."""

from biogrip.products.files.verdicts import EXPECTED
from biogrip.products.product import Reads


def verdicts_expected() -> Reads:
    """Return the input with the expected verdicts of the job's case; no file if it was recorded."""
    return Reads(
        lambda plan, job: [] if plan.study.case(job["case"]).recorded else [EXPECTED.format(**job)]
    )
