"""The study's answers in sentences and in one table, written from rows of its tables."""

from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress

from biogrip.digits import legible, plain, with_unit
from biogrip.judging.quantities import PROVIDED
from biogrip.judging.verdicts import DETERMINED
from biogrip.records.success import ALL, share_with_limits

Row = Mapping[str, str]


def say_what_the_study_gives(
    methods: Iterable[Row], shown: str, titles: Mapping[str, str], who: str
) -> str:
    """Say in which share of each case's traces the study's own method finds what genes can encode.

    Rows are those of the table of methods; `shown` is the title of that method, which `who` stands
    before. It is "" if no case is simulated.
    """
    rows = [row for row in methods if row["method"] == shown]
    shares = [f"{share_of(row)} on “{titles[row['case']]}”" for row in rows]
    if not rows:
        return ""
    shares[0] = shares[0].replace("(", f"of {rows[0]['seeds']} runs (95 % interval: ", 1)
    return f"{who} {shown} finds the best fit that its digits can express in {_listed(shares)}."


def say_what_traces_tell(verdicts: Iterable[Row]) -> str:
    """Say which quantities a trace determines always, never, or in some of the samples."""
    decided: dict[str, list[bool]] = defaultdict(list)
    for row in verdicts:
        decided[row["quantity"]].append(row["verdict"] == DETERMINED)
    always = [name for name, each in decided.items() if all(each)]
    never = [name for name, each in decided.items() if not any(each)]
    some = {name: each for name, each in decided.items() if any(each) and not all(each)}
    provided = f", {PROVIDED}" * any(" + " in name for name in always)
    parts = [f"It always determines {_listed(always)}{provided}"] if always else []
    parts += [f"It never determines {_listed(never)}"] if never else []
    if some:
        counts = [f"{name} in {sum(each)}" for name, each in some.items()]
        parts.append(f"It determines {_listed(counts)} of {max(map(len, some.values()))} samples")
    return "".join(f"{part}. " for part in parts).strip().replace("It", "A trace", 1)


def say_which_method_finds_it(methods: Iterable[Row], shown: str) -> str:
    """Say how often the surest method reaches that, and what it takes beside the study's own.

    Parameters are those of `say_what_the_study_gives`.
    """
    found: dict[str, list[Row]] = defaultdict(list)
    for row in methods:
        found[row["method"]].append(row)
    if not found:
        return ""

    def worst(name: str) -> tuple[float, float]:
        lowest = min(float(row["reached_share"]) for row in found[name])
        return lowest, -max(float(row["median_evaluations"]) for row in found[name])

    surest = max(found, key=worst)
    least, *more = sorted(found[surest], key=lambda row: float(row["reached_share"]))
    at_least = "at least " * (more != [] and share_of(least) != share_of(more[-1]))
    said = (
        f"{surest[:1].upper()}{surest[1:]} finds that fit, or a better one, in {at_least}"
        f"{share_of(least)} of the runs on {'each' if more else 'the'} sample, with "
        f"{_responses(found[surest])} simulated responses"
    )
    if shown in found and shown != surest:
        said += f"; the {shown} takes {_responses(found[shown])}"
    return f"{said}."


def say_what_claims_are(claims: Iterable[Row]) -> str:
    """Say how many of the paper's claims have each verdict; "" if there are none."""
    counts = Counter(row["verdict"] for row in claims)
    if not counts:
        return ""
    return (
        f"Of the paper's {counts.total()} claims {counts['replicated']} are replicated, "
        f"{counts['in part']} in part, {counts['not']} not; "
        f"{counts['outside the printed encoding']} are outside the printed encoding, and "
        f"{counts['cannot be told']} cannot be told."
    )


def compared_rows(
    errors: Iterable[Row], verdicts: Iterable[Row], titles: Mapping[str, str]
) -> list[dict[str, str]]:
    """Return the paper's results beside the study's, of `basins` where there are two.

    Quantities that no case determines are left out. Rows are those of the tables of errors and
    verdicts, titles those of the cases.
    """
    decided = {row["quantity"] for row in verdicts if row["verdict"] == DETERMINED}
    rows = list(errors)
    split = {row["case"] for row in rows if row["basin"] != ALL}
    seeds = {row["case"]: int(row["seeds"]) for row in rows if row["basin"] == ALL}
    return [
        {
            "sample": titles[row["case"]],
            "quantity": legible(with_unit(row["parameter"], row["unit"])),
            "target": _number(row["target"]),
            "paper": _with_error(row["paper_identified"], row["paper_error_percent"]),
            "runs": _runs(row, seeds[row["case"]]),
            "this study: median": _with_error(row["median_identified"], _error(row)),
            "quartiles": " to ".join(
                _number(row[key]) for key in ("p25_identified", "p75_identified")
            ),
        }
        for row in rows
        if row["parameter"] in decided and (row["basin"] == ALL) != (row["case"] in split)
    ]


def _runs(row: Row, runs: int) -> str:
    if row["basin"] == ALL:
        return ALL
    return f"{_percent(*share_with_limits(int(row['seeds']), runs))} {row['basin']}"


def share_of(row: Row) -> str:
    """Return a row's share of runs that reach the best encodable point, with its interval."""
    return _percent(*(float(row[f"reached_{key}"]) for key in ("share", "low", "high")))


def _percent(share: float, low: float, high: float) -> str:
    return legible(f"{100 * share:.0f} % ({100 * low:.0f} to {100 * high:.0f} %)")


def _responses(rows: Iterable[Row]) -> str:
    values = [float(row["median_evaluations"]) for row in rows]
    low, high = (f"{float(f'{end:.2g}'):,.0f}" for end in (min(values), max(values)))
    return low if low == high else f"{low} to {high}"


def _listed(names: Sequence[str]) -> str:
    *others, last = names
    return f"{', '.join(others)} and {last}" if others else last


def _number(text: str) -> str:
    return legible(plain(float(text), 4)) if text else ""


def _error(row: Row) -> str:
    target, found = row["target"], row["median_identified"]
    return str(100 * (1 - float(found) / float(target))) if target and float(target) else ""


def _with_error(value: str, error: str) -> str:
    """Return a value with its error in brackets, which the paper may give in words, as ">100"."""
    with suppress(ValueError):
        error = plain(float(f"{float(error):.2g}") + 0.0)
    return _number(value) + (legible(f" ({error} %)") if value and error else "")
