"""The study's answers in sentences and in one table, written from its tables."""

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence

from biogrip.digits import with_unit
from biogrip.judging.verdicts import DETERMINED
from biogrip.tables.claim_rules import (
    FEWEST_SEEDS,
    IN_PART,
    NOT,
    REPLICATED,
    by_value,
)

Row = Mapping[str, str]


def compare_with_paper(
    errors: Iterable[Row], verdicts: Iterable[Row], names: Mapping[str, str]
) -> str:
    """Say which values of the paper the study replicates, in part or not; "" if it has none.

    A value is replicated if it is within the middle 90 % of the seeds, and the typical seed is as
    close to the target as the limits of a trace without noise; in part if it is only within.

    Parameters
    ----------
    errors, verdicts
        Rows of the tables of errors and verdicts.
    names
        Names of the cases in the sentence.
    """
    rows = [row for row in errors if row["paper_identified"]]
    if not rows:
        return ""
    fewest = min(int(row["seeds"]) for row in rows)
    if fewest < FEWEST_SEEDS:
        return (
            f"Which of the paper's values are replicated takes {FEWEST_SEEDS} seeds a case to "
            f"say, and this study has {fewest}."
        )
    limits = {(row["case"], row["quantity"]): row for row in verdicts}
    found: dict[str, dict[str, list[str]]] = {}
    for row in rows:
        low, value, high = (
            float(row[key]) for key in ("p05_identified", "paper_identified", "p95_identified")
        )
        close = _is_close(row["typical_identified"], limits[row["case"], row["parameter"]])
        kind = by_value(low, value, high, is_close=close)
        members = found.setdefault(kind, {})
        members.setdefault(names[row["case"]], []).append(row["parameter"])
    meanings = {
        REPLICATED: "replicated (within the middle 90 % of our seeds, of which the typical one "
        "is as close to the target as a trace allows)",
        IN_PART: "replicated in part (within, but the typical one is further off, or there are "
        "no such limits)",
        NOT: "not replicated",
    }
    parts = [_parts(meaning, found[kind]) for kind, meaning in meanings.items() if kind in found]
    return f"Of {len(rows)} values of the paper, sums included, {'; '.join(parts)}."


def say_what_traces_tell(verdicts: Iterable[Row]) -> str:
    """Say which quantities a trace determines always, never, or in some of the samples."""
    decided: dict[str, list[bool]] = defaultdict(list)
    for (_, quantity), determined in _determined(verdicts).items():
        decided[quantity].append(determined)
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
    """Say how often the surest method finds the best fit, and how often the study's own does.

    Parameters
    ----------
    methods
        Rows of the table of methods.
    shown
        Title of the study's own method.
    """
    of: dict[str, list[Row]] = defaultdict(list)
    for row in methods:
        of[row["method"]].append(row)
    if not of:
        return ""
    surest = max(of, key=lambda name: (min(_shares(of[name])), -max(_responses(of[name]))))
    first = f"{surest[:1].upper()}{surest[1:]} finds the best fit {_success(of[surest])}"
    others = [f"the {shown} {_success(of[shown])}"] if shown in of and shown != surest else []
    return f"{'; '.join([first, *others])}."


def compared_rows(errors: Iterable[Row], verdicts: Iterable[Row]) -> list[dict[str, str]]:
    """Return the paper's results beside the study's, without quantities that no trace determines.

    Parameters
    ----------
    errors, verdicts
        Rows of the tables of errors and verdicts.
    """
    decided = {
        quantity for (_, quantity), determined in _determined(verdicts).items() if determined
    }
    return [
        {
            "case": row["case"].replace("_", " "),
            "parameter": with_unit(row["parameter"], row["unit"]),
            "target": _number(row["target"], 4),
            "paper": _with_error(row["paper_identified"], row["paper_error_percent"], 4),
            "this study: typical seed": _with_error(
                row["typical_identified"], row["typical_error_percent"], 3
            ),
            "5-95 % of seeds": " to ".join(
                _number(row[key], 3) for key in ("p05_identified", "p95_identified")
            ),
            "seeds near the noise": f"{100 * float(row['near_noise_share']):.0f} %"
            if row["near_noise_share"]
            else "",
        }
        for row in errors
        if row["parameter"] in decided
    ]


def _determined(verdicts: Iterable[Row]) -> dict[tuple[str, str], bool]:
    return {(row["case"], row["quantity"]): row["verdict"] == DETERMINED for row in verdicts}


def _is_close(value: str, limits: Row) -> bool:
    """Return True if a value is within the limits of a trace without noise, on both sides."""
    low, high = limits["expected_low"], limits["expected_high"]
    return bool(low and high) and float(low) <= float(value) <= float(high)


def _parts(meaning: str, members: Mapping[str, Sequence[str]]) -> str:
    count = sum(map(len, members.values()))
    whose = ", ".join(f"{_listed(names)} of {case}" for case, names in members.items())
    return f"{count} {'is' if count == 1 else 'are'} {meaning}: {whose}"


def _listed(names: Sequence[str]) -> str:
    """Return names with commas, and an "and" before the last."""
    *others, last = names
    return f"{', '.join(others)} and {last}" if others else last


def _shares(rows: Iterable[Row]) -> list[float]:
    return [float(row["optimum_share"]) for row in rows]


def _responses(rows: Iterable[Row]) -> list[float]:
    return [float(row["median_evaluations"]) for row in rows]


def _success(rows: Sequence[Row]) -> str:
    shares, responses = _shares(rows), _responses(rows)
    return (
        f"of {_range([100 * share for share in shares])} % of the traces, with "
        f"{_range(responses)} simulated responses in the median"
    )


def _range(values: Sequence[float]) -> str:
    low, high = f"{min(values):.0f}", f"{max(values):.0f}"
    return low if low == high else f"{low} to {high}"


def _number(text: str, digits: int) -> str:
    return f"{float(text):.{digits}g}" if text else ""


def _with_error(value: str, error: str, digits: int) -> str:
    """Return a value with its error in brackets, if there are any."""
    return " ".join(
        [_number(value, digits), *([f"({_percent(error)})"] if error else [])] if value else []
    )


def _percent(text: str) -> str:
    try:
        return f"{float(f'{float(text):.2g}') + 0.0:g} %"
    except ValueError:
        return f"{text} %"
