"""Input of jobs that use the expected verdicts of a simulated case."""

from biogrip.products.product import Reads
from biogrip.records.verdicts import EXPECTED

VERDICTS_EXPECTED = Reads(
    lambda plan, job: [] if plan.study.case(job["case"]).recorded else [EXPECTED.format(**job)]
)
"""The expected verdicts of the job's case; no file if it was recorded."""
