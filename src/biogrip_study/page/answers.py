"""The study's answers in sentences and in one table, written from rows of its tables."""

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence

from biogrip.digits import legible, plain, with_unit
from biogrip.judging.profiles import DETERMINED

TableRow = Mapping[str, str]


def say_what_the_study_gives(
    methods: Iterable[TableRow], shown: str, titles: Mapping[str, str], who: str, tolerance: float
) -> str:
    """Say in which share of each case's traces the study's own method finds what genes can encode.

    Rows are those of the table of methods; `shown` is the title of that method, which `who` stands
    before; the tolerance is of chi-squared. It is "" if no case is simulated.
    """
    rows = [row for row in methods if row["method"] == shown]
    shares = [f"{share_of(row)} on “{titles[row['case']]}”" for row in rows]
    if not rows:
        return ""
    shares[0] = shares[0].replace("(", f"of {rows[0]['seeds']} runs (95 % interval: ", 1)
    fit = f"finds the best fit that its digits can express (χ² within {tolerance:g})"
    return f"{who} {shown} {fit}, in {_enumerated(shares)}."


def rows_of_determined(
    counts: Iterable[TableRow], titles: Mapping[str, str]
) -> list[dict[str, str]]:
    """Return in how many traces of each sample each quantity is determined, a row a sample.

    Rows are those of the table of verdict counts.
    """
    rows: dict[str, dict[str, str]] = defaultdict(dict)
    for row in counts:
        told, runs = rows[row["case"]], int(row["seeds"])
        told.setdefault(row["quantity"], f"none: 0 of {runs}")
        if row["verdict"] == DETERMINED:
            word = "all" if int(row["reached"]) == runs else "some"
            told[row["quantity"]] = f"{word}: {row['reached']} of {runs}"
    names = dict.fromkeys(name for row in rows.values() for name in row)
    return [
        {"sample": titles[case], **{name: row.get(name, "") for name in names}}
        for case, row in rows.items()
    ]


def say_which_method_finds_it(methods: Iterable[TableRow], shown: str) -> str:
    """Say how often the surest method reaches that, and what it takes beside the study's own.

    Parameters are those of `say_what_the_study_gives`.
    """
    by_method: dict[str, list[TableRow]] = defaultdict(list)
    for row in methods:
        by_method[row["method"]].append(row)
    if not by_method:
        return ""

    def worst(name: str) -> tuple[float, float]:
        lowest = min(float(row["reached_share"]) for row in by_method[name])
        return lowest, -max(float(row["median_evaluations"]) for row in by_method[name])

    surest = max(by_method, key=worst)
    least, *more = sorted(by_method[surest], key=lambda row: float(row["reached_share"]))
    at_least = "at least " * (more != [] and share_of(least) != share_of(more[-1]))
    said = (
        f"{surest[:1].upper()}{surest[1:]} comes as low, or lower, in {at_least}"
        f"{share_of(least)} of the runs on {'each' if more else 'the'} sample, with "
        f"{_range_of_responses(by_method[surest])} simulated responses"
    )
    if shown in by_method and shown != surest:
        said += f"; the {shown} takes {_range_of_responses(by_method[shown])}"
    return f"{said}."


def rows_beside_the_paper(
    compared: Iterable[TableRow], titles: Mapping[str, str]
) -> list[dict[str, str]]:
    """Return the paper's Tables 5 to 7 beside the study's runs.

    Quantities of which no sample's trace tells anything are left out. Rows are those of the table
    of that name.
    """
    rows = list(compared)
    told = {row["quantity"] for row in rows if row["verdict"] != "not identifiable"}
    return [
        {
            "sample": titles[row["case"]],
            "quantity": legible(with_unit(row["quantity"], row["unit"])),
            "target": _legible_number(row["target"]),
            "paper": _ends(row, "printed_from", "printed_to")
            + f" ({_ends(row, 'error_from_percent', 'error_to_percent', ' %', 3)})",
            "runs": f"{row['runs']}, {row['reading']}",
            "error of a run": legible(f"{_legible_number(row['median_error_percent'], 2)} %")
            + f" ({_ends(row, 'median_from_percent', 'median_to_percent', ' %', 2)})",
            "runs near the paper's value": _percent(
                *(float(row[f"near_{end}"]) for end in ("share", "from", "to"))
            )
            + f": {row['verdict']}",
        }
        for row in rows
        if row["quantity"] in told
    ]


def _ends(row: TableRow, low: str, high: str, unit: str = "", digits: int = 4) -> str:
    return legible(
        f"{_legible_number(row[low], digits)} to {_legible_number(row[high], digits)}{unit}"
    )


def share_of(row: TableRow) -> str:
    """Return a row's share of runs that reach the best encodable point, with its interval."""
    return _percent(*(float(row[f"reached_{key}"]) for key in ("share", "low", "high")))


def _percent(share: float, low: float, high: float) -> str:
    return legible(f"{100 * share:.0f} % ({100 * low:.0f} to {100 * high:.0f} %)")


def _range_of_responses(rows: Iterable[TableRow]) -> str:
    values = [float(row["median_evaluations"]) for row in rows]
    low, high = (f"{float(f'{end:.2g}'):,.0f}" for end in (min(values), max(values)))
    return low if low == high else f"{low} to {high}"


def _enumerated(names: Sequence[str]) -> str:
    *others, last = names
    return f"{', '.join(others)} and {last}" if others else last


def _legible_number(text: str, digits: int = 4) -> str:
    return legible(plain(float(f"{float(text):.{digits}g}"), digits)) if text else ""
