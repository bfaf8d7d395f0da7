"""What the traces of a case should tell, where its truth is known."""

from biogrip.products.files.verdicts import EXPECTED
from biogrip.products.product import Reads


def verdicts_expected() -> Reads:
    """Read what the traces of the job's case should tell; nobody knows of a recorded one."""
    return Reads(
        lambda plan, job: [] if plan.study.case(job["case"]).recorded else [EXPECTED.format(**job)]
    )
