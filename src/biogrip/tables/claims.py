"""Every claim of the paper that results can speak to, with a verdict and the evidence."""

from collections import Counter
from collections.abc import Iterable

# They are imported for the claims that they add to `CLAIMS`, in the order of the paper.
from biogrip.tables import claims_on_method, claims_on_results  # noqa: F401
from biogrip.tables.claim_rules import (
    CLAIMS,
    IN_PART,
    NOT,
    OUTSIDE,
    REPLICATED,
    RULES,
    UNDECIDED,
    Judged,
    LackingError,
    Results,
)
from biogrip.tables.layout import Column, Table

_COLUMNS = (
    Column("place", "Place"),
    Column("claim", "Claim of the paper"),
    Column("verdict", "Verdict"),
    Column("evidence", "Evidence"),
)


def claims(results: Results) -> Table:
    """Judge every claim by the study's results."""
    rows = []
    for claim in CLAIMS:
        try:
            found = claim.judge(results)
        except LackingError as lacking:
            found = Judged(UNDECIDED, f"Not here: {lacking}.")
        head = {"place": claim.place, "claim": claim.words}
        rows.append(head | {"verdict": found.verdict, "evidence": found.evidence})
    caption = (
        "Claims of the paper on its method and results, and what this study says of each. Claims "
        f"of novelty and on related work are left out. {RULES} Sweeps are the published ones."
    )
    return Table(caption, _COLUMNS, rows)


def count_verdicts(verdicts: Iterable[str]) -> str:
    """Say how many claims have each verdict; "" if there are none."""
    counts = Counter(verdicts)
    if not counts:
        return ""
    return (
        f"Of the paper's {counts.total()} claims {counts[REPLICATED]} are replicated, "
        f"{counts[IN_PART]} in part, {counts[NOT]} not; {counts[OUTSIDE]} are {OUTSIDE}, and "
        f"{counts[UNDECIDED]} {UNDECIDED}."
    )
