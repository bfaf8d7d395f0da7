"""The study's answers in sentences and in one table, written from rows of its tables."""

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress

from biogrip.digits import with_unit
from biogrip.fit.methods import ALL, share_in_words
from biogrip.judging.verdicts import DETERMINED
from biogrip.tables.claim_rules import FEWEST_SEEDS, IN_PART, NOT, REPLICATED, by_value

Row = Mapping[str, str]

_MEANINGS = {
    REPLICATED: "replicated (within the middle 90 % of our seeds, whose median is as close "
    "to the target as a trace allows)",
    IN_PART: "replicated in part (within, but the median is further off, or there are no such "
    "limits)",
    NOT: "not replicated",
}


def compare_with_paper(
    errors: Iterable[Row], verdicts: Iterable[Row], names: Mapping[str, str]
) -> str:
    """Say which values of the paper the study replicates, in part or not; "" if it has none.

    The rule is `by_value`; limits are those of a trace without noise, on both sides.

    Parameters
    ----------
    errors, verdicts
        Rows of the tables of errors and verdicts.
    names
        Names of the cases in the sentence.
    """
    rows = [row for row in errors if row["paper_identified"] and row["basin"] == ALL]
    if not rows:
        return ""
    fewest = min(int(row["seeds"]) for row in rows)
    if fewest < FEWEST_SEEDS:
        return (
            f"Which of the paper's values are replicated takes {FEWEST_SEEDS} seeds a case to "
            f"say, and this study has {fewest}."
        )
    limits = {(row["case"], row["quantity"]): row for row in verdicts}
    found: dict[str, dict[str, list[str]]] = {verdict: {} for verdict in _MEANINGS}
    for row in rows:
        low, median, printed, high = (
            float(row[f"{which}_identified"]) for which in ("p05", "median", "paper", "p95")
        )
        expected = limits[row["case"], row["parameter"]]
        ends = expected["expected_low"], expected["expected_high"]
        close = all(ends) and float(ends[0]) <= median <= float(ends[1])
        of_case = found[by_value(low, printed, high, is_close=close)]
        of_case.setdefault(names[row["case"]], []).append(row["parameter"])
    parts = []
    for verdict, members in found.items():
        if members:
            count = sum(map(len, members.values()))
            whose = ", ".join(f"{_listed(own)} of {case}" for case, own in members.items())
            verb = "is" if count == 1 else "are"
            parts.append(f"{count} {verb} {_MEANINGS[verdict]}: {whose}")
    return f"Of {len(rows)} values of the paper, sums included, {'; '.join(parts)}."


def say_what_traces_tell(verdicts: Iterable[Row]) -> str:
    """Say which quantities a trace determines always, never, or in some of the samples."""
    decided: dict[str, list[bool]] = defaultdict(list)
    for row in verdicts:
        decided[row["quantity"]].append(row["verdict"] == DETERMINED)
    always = [name for name, each in decided.items() if all(each)]
    never = [name for name, each in decided.items() if not any(each)]
    some = [
        f"{name} in {sum(each)} of {len(each)}"
        for name, each in decided.items()
        if any(each) and not all(each)
    ]
    parts = [f"always determines {_listed(always)}"] if always else []
    if never:
        parts.append(f"never {'' if always else 'determines '}{_listed(never)}")
    if some:
        parts.append(f"{'the rest' if parts else 'determines each'} sometimes")
    samples = f": {_listed(some)} samples" if some else ""
    return f"A trace {_listed(parts)}{samples}." if parts else ""


def say_which_method_finds_it(methods: Iterable[Row], shown: str) -> str:
    """Say how often the surest method, and the study's own, reach the best encodable point.

    Parameters
    ----------
    methods
        Rows of the table of methods.
    shown
        Title of the study's own method.
    """
    shares: dict[str, list[float]] = defaultdict(list)
    responses: dict[str, list[float]] = defaultdict(list)
    for row in methods:
        shares[row["method"]].append(100 * float(row["reached_share"]))
        responses[row["method"]].append(float(row["median_evaluations"]))
    if not shares:
        return ""

    def success(name: str) -> str:
        return (
            f"in {_range(shares[name])} % of the traces, with {_range(responses[name])} simulated "
            "responses in the median"
        )

    surest = max(shares, key=lambda name: (min(shares[name]), -max(responses[name])))
    said = f"{surest[:1].upper()}{surest[1:]} reaches the best encodable fit {success(surest)}"
    if shown in shares and shown != surest:
        said += f"; the {shown} {success(shown)}"
    return f"{said}."


def compared_rows(errors: Iterable[Row], verdicts: Iterable[Row]) -> list[dict[str, str]]:
    """Return the paper's results beside the study's, by basin where there are two.

    Quantities that no trace determines are left out.

    Parameters
    ----------
    errors, verdicts
        Rows of the tables of errors and verdicts.
    """
    decided = {row["quantity"] for row in verdicts if row["verdict"] == DETERMINED}
    rows = list(errors)
    split = {row["case"] for row in rows if row["basin"] != ALL}
    seeds = {row["case"]: int(row["seeds"]) for row in rows if row["basin"] == ALL}
    return [
        {
            "case": row["case"].replace("_", " "),
            "parameter": with_unit(row["parameter"], row["unit"]),
            "target": _number(row["target"], 4),
            "paper": _with_error(row, "paper", 4),
            "runs": ALL
            if row["basin"] == ALL
            else f"{share_in_words(int(row['seeds']), seeds[row['case']])} {row['basin']}",
            "this study: median": _with_error(row, "median", 3),
            "quartiles": " to ".join(
                _number(row[key], 3) for key in ("p25_identified", "p75_identified")
            ),
        }
        for row in rows
        if row["parameter"] in decided and (row["basin"] == ALL) != (row["case"] in split)
    ]


def _listed(names: Sequence[str]) -> str:
    """Return names with commas, and an "and" before the last."""
    *others, last = names
    return f"{', '.join(others)} and {last}" if others else last


def _range(values: Sequence[float]) -> str:
    low, high = f"{min(values):.0f}", f"{max(values):.0f}"
    return low if low == high else f"{low} to {high}"


def _number(text: str, digits: int) -> str:
    return f"{float(text):.{digits}g}" if text else ""


def _with_error(row: Row, whose: str, digits: int) -> str:
    """Return a value with its error in brackets, which the paper may give in words, as ">100"."""
    value, error = row[f"{whose}_identified"], row[f"{whose}_error_percent"]
    with suppress(ValueError):
        error = f"{float(f'{float(error):.2g}') + 0.0:g}"
    return _number(value, digits) + (f" ({error} %)" if value and error else "")
