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
from biogrip.identify.curves import normal_quantiles
from biogrip.identify.on_page import json_in_page
from biogrip.identify.outputs import WRITTEN_BY
from biogrip.identify.strips import strips_of
from biogrip.identify.words import in_unit, labels_of
from biogrip.judging.doubts import DOUBTFUL, OK, REJECTED
from biogrip.terminal import visible, visible_lines

_STATUSES = {OK: "✓", DOUBTFUL: "!", REJECTED: "✕"}
"""Status of a fit, and its mark in the table."""
_STYLES = (Path(__file__).parents[1] / "page/report.css", "traces.css")


def write_page(
    traces: Sequence[Mapping[str, Any]],
    refused: Mapping[str, str],
    page: Path,
    copied: Mapping[str, Mapping[str, str]] | None = None,
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
    copied
        Cells to copy of each trace, by file and column. By default none.
    """
    here = Path(__file__).parent
    words = {visible(trace): _shown(own) for trace, own in (copied or {}).items()}
    traces = [{**each, "copied": words.get(each["trace"], {})} for each in traces]
    columns = list(dict.fromkeys(name for own in words.values() for name in own))
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
        refused=[
            (visible(trace), words.get(visible(trace), {}), visible_lines(reason))
            for trace, reason in refused.items()
        ],
        several=several,
        written_by=f"{WRITTEN_BY} {__version__}",
        style="".join((here / name).read_text(encoding="utf-8") for name in _STYLES),
        script=(here / "traces.js").read_text(encoding="utf-8"),
        normal=json_in_page(_normal(traces)),
        strips=json_in_page(strips_of(traces, columns)) if several and traces else "",
        columns={label: with_unit(label, units[label]) for label in labels_of(traces)},
        copied=columns,
        sorts_as=_sorts_as,
        marks=_STATUSES,
        counts=counts,
        setups=setups,
        in_unit=in_unit,
    )
    write_text(page, text)


def _shown(words: Mapping[str, str]) -> dict[str, str]:
    return {visible(name): visible(word) for name, word in words.items()}


def _normal(traces: Sequence[Mapping[str, Any]]) -> dict[int, list[float]]:
    """Return the normal quantiles of residuals, by their number."""
    return {count: normal_quantiles(count) for count in {t["drawn_quantiles"] for t in traces}}


def _sorts_as(quantity: Mapping[str, Any]) -> float | None:
    """Return the number by which a quantity is sorted: value or limit, or None without any."""
    low, high = quantity["low"], quantity["high"]
    found = quantity["value"] if low is not None and high is not None else low or high
    return None if found is None else float(f"{found:.6g}")
