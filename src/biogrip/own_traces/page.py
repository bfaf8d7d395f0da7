"""An HTML page of identified traces, self-contained: a table, distributions, and each trace.

Texts and tables are HTML; `traces.js` draws in the browser, from the numbers of `curves`.
"""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import jinja2
import yaml

from biogrip import __version__
from biogrip.digits import with_unit
from biogrip.files import write_text
from biogrip.identifiability.fit_status import DOUBTFUL, OK, REJECTED
from biogrip.own_traces.curves import curves_of, normal_quantiles
from biogrip.own_traces.one_trace import Identified
from biogrip.own_traces.outputs import WRITTEN_BY
from biogrip.own_traces.strips import strips_of
from biogrip.own_traces.words import (
    POSTERIOR_OF_REJECTED,
    evidence_in_words,
    for_a_paper,
    further_notes,
    in_unit,
    labels_of,
    limits_in_short,
    noise_in_words,
    one_sided_in_words,
    taken_for_granted,
)
from biogrip.terminal import visible, visible_lines

_STATUSES = {OK: "✓", DOUBTFUL: "!", REJECTED: "✕"}
"""Status of a fit, and its mark in the table."""
_STYLES = (Path(__file__).parents[1] / "products/report/report.css", "traces.css")


def for_page(identified: Identified) -> dict[str, Any]:
    """Return the numbers and sentences of a trace on a page, as plain data."""
    data = identified.data
    compared = data["posterior"]["evidence"] if "posterior" in data else []
    assumed = dict(data["assumed"])
    # The page names the trace, and says once what several assume alike.
    assumed["measurement"] = {**assumed["measurement"]}
    assumed["measurement"].pop("file", None)
    dumper: Any = getattr(yaml, "CSafeDumper", yaml.SafeDumper)
    curves = curves_of(identified)
    return {
        **data,
        "trace": visible(data["trace"]),
        **_cell_and_factors(data),
        "curves": _json(curves),
        "drawn_quantiles": len(curves["quantiles"]),
        "corner": _corner(identified),
        "noise_in_words": noise_in_words(data),
        "further_notes": further_notes(data),
        "for_a_paper": for_a_paper(data),
        "in_short": {q["quantity"]: limits_in_short(q) for q in data["quantities"]},
        "setup": yaml.dump(assumed, Dumper=dumper, sort_keys=False, allow_unicode=True),
        "evidence_in_words": evidence_in_words(compared),
        "one_sided": " ".join(one_sided_in_words([data])),
        "granted": taken_for_granted(data) if data["by_default"] else None,
    }


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
        normal=_json(_normal(traces)),
        strips=_json(strips_of(traces, groups)) if several and traces else "",
        columns={label: with_unit(label, units[label]) for label in labels_of(traces)},
        cells=any(each.get("cell") for each in traces),
        factors=_factors(traces),
        sorts_as=_sorts_as,
        marks=_STATUSES,
        counts=counts,
        setups=setups,
        in_unit=in_unit,
        not_shown=POSTERIOR_OF_REJECTED,
        compared=_compared(groups) if groups else None,
    )
    write_text(page, text)


def _cell_and_factors(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return cell and factors that a sheet says of a trace, or nothing."""
    if "cell" not in data:
        return {}
    factors = {visible(name): visible(level) for name, level in data["factors"].items()}
    return {"cell": visible(data["cell"]), "factors": factors}


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


def _corner(identified: Identified) -> str | None:
    """Return a drawing of the posterior as a data URL, if there is one to be shown."""
    data = identified.data
    if identified.samples is None or data["fit"] == REJECTED:
        return None
    # Imported here: loading Matplotlib takes long.
    from biogrip.products.figures.corner import draw_corner
    from biogrip.products.figures.style import styled
    from biogrip.products.pages.figure_address import figure_address

    parameters = identified.problem.searched.parameters
    with styled():
        return figure_address(
            draw_corner(parameters, identified.samples, data["posterior"], {}, "")
        )


def _json(data: Any) -> str:
    """Return plain data as JSON that cannot close the script element around it."""
    text = json.dumps(data, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    return text.replace("<", "\\u003c")
