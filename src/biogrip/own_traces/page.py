"""An HTML page of identified traces, self-contained: a table, distributions, and each trace.

Texts and tables are HTML; `traces.js` draws in the browser, from the numbers of `curves`.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import jinja2

from biogrip import __version__
from biogrip.digits import with_unit
from biogrip.files import write_text
from biogrip.identifiability.fit_status import DOUBTFUL, OK, REJECTED
from biogrip.own_traces.curves import normal_quantiles
from biogrip.own_traces.on_page import json_in_page
from biogrip.own_traces.outputs import WRITTEN_BY
from biogrip.own_traces.strips import strips_of
from biogrip.own_traces.words import in_unit, labels_of
from biogrip.terminal import visible, visible_lines

_STATUSES = {OK: "✓", DOUBTFUL: "!", REJECTED: "✕"}
"""Status of a fit, and its mark in the table."""
_STYLES = (Path(__file__).parents[1] / "products/report/report.css", "traces.css")


def write_page(
    traces: Sequence[Mapping[str, Any]],
    refused: Mapping[str, str],
    page: Path,
    groups: Mapping[str, Any] | None = None,
) -> None:
    """Write a page as HTML.

    Parameters
    ----------
    traces
        Results of `for_page`.
    refused
        Error messages of other traces, by file.
    page
        File to write.
    groups
        Result of `compare_groups` for groups of these traces, if they were compared.
    """
    here = Path(__file__).parent
    traces = [{**each, **_cell_and_factors(each)} for each in traces]
    environment = jinja2.Environment(
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        loader=jinja2.FileSystemLoader(here),
    )
    several = len(traces) != 1 or bool(refused)
    setups: dict[str, list[str]] = {}
    for each in traces:
        setups.setdefault(each["setup"], []).append(each["trace"])
    units = {q["quantity"]: q["unit"] for each in traces for q in each["quantities"]}
    counts = {status: sum(each["fit"] == status for each in traces) for status in _STATUSES}
    text = environment.get_template("traces.html.j2").render(
        traces=traces,
        refused={visible(trace): visible_lines(reason) for trace, reason in refused.items()},
        several=several,
        written_by=f"{WRITTEN_BY} {__version__}",
        style="".join((here / name).read_text(encoding="utf-8") for name in _STYLES),
        script=(here / "traces.js").read_text(encoding="utf-8"),
        normal=json_in_page(_normal(traces)),
        strips=json_in_page(strips_of(traces, groups)) if several and traces else "",
        columns={label: with_unit(label, units[label]) for label in labels_of(traces)},
        cells=any(each.get("cell") for each in traces),
        factors=_factors(traces),
        sorts_as=_sorts_as,
        marks=_STATUSES,
        counts=counts,
        setups=setups,
        in_unit=in_unit,
        compared=_compared(groups) if groups else None,
    )
    write_text(page, text)


def _cell_and_factors(trace: Mapping[str, Any]) -> dict[str, Any]:
    """Return cell and factors that a sheet says of a trace, or nothing."""
    if "cell" not in trace:
        return {}
    factors = {visible(name): visible(level) for name, level in trace["factors"].items()}
    return {"cell": visible(trace["cell"]), "factors": factors}


def _normal(traces: Sequence[Mapping[str, Any]]) -> dict[int, list[float]]:
    """Return the normal quantiles of residuals, by their number."""
    return {count: normal_quantiles(count) for count in {t["drawn_quantiles"] for t in traces}}


def _factors(traces: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the names of all factors of traces."""
    return list(dict.fromkeys(name for each in traces for name in each.get("factors") or {}))


def _sorts_as(quantity: Mapping[str, Any]) -> float | None:
    """Return the number by which a quantity is sorted: value or limit, or None without any."""
    low, high = quantity["low"], quantity["high"]
    found = quantity["value"] if low is not None and high is not None else low or high
    return None if found is None else float(f"{found:.6g}")


def _compared(groups: Mapping[str, Any]) -> dict[str, Any]:
    # Imported here: most pages are of traces alone.
    from biogrip.own_traces.groups_of_cells import difference_rows, group_rows

    percent = f"{100 * groups['confidence']:g} %"
    return {
        "medians": group_rows(groups["groups"], percent),
        "differences": difference_rows(groups["differences"], percent),
        "doubtful": groups["doubtful"],
        "without": difference_rows(groups["differences_without_doubtful"], percent),
        "limits": groups["limits"],
        "rejected": [
            (cell["cell"], cell["reasons"][0])
            for cell in groups["cells"]
            if cell["cell"] in groups["rejected"]
        ],
        "problem": groups.get("problem"),
    }
