"""An HTML page of identified traces, self-contained."""

import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import jinja2
import yaml
from matplotlib.figure import Figure

from biogrip import __version__
from biogrip.files import write_text
from biogrip.identifiability.fit_status import REJECTED
from biogrip.own_traces.one_trace import Identified
from biogrip.own_traces.outputs import WRITTEN_BY
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
from biogrip.products.figures.corner import draw_corner
from biogrip.products.figures.fit import draw_fit
from biogrip.products.figures.profiles import draw_profiles
from biogrip.products.figures.residual_diagnosis import draw_residuals
from biogrip.products.figures.results import fit_of
from biogrip.products.figures.style import save_png, styled
from biogrip.products.pages.png_address import png_address
from biogrip.terminal import visible, visible_lines


def for_page(identified: Identified) -> dict[str, Any]:
    """Return the numbers, sentences and figures of a trace on a page, as plain data."""
    data = identified.data
    compared = data["posterior"]["evidence"] if "posterior" in data else []
    with styled():
        figures = [(title, embedded(drawn)) for title, drawn in _figures(identified).items()]
    return {
        **data,
        "trace": visible(data["trace"]),
        "figures": figures,
        "noise_in_words": noise_in_words(data),
        "further_notes": further_notes(data),
        "for_a_paper": for_a_paper(data),
        "in_short": {q["quantity"]: limits_in_short(q) for q in data["quantities"]},
        "setup": yaml.safe_dump(data["assumed"], sort_keys=False, allow_unicode=True),
        "evidence_in_words": evidence_in_words(compared),
        "one_sided": " ".join(one_sided_in_words([data])),
        "granted": taken_for_granted(data) if data["by_default"] else None,
    }


def write_page(traces: Sequence[Mapping[str, Any]], refused: Mapping[str, str], page: Path) -> None:
    """Write a page as HTML.

    Parameters
    ----------
    traces
        Results of `for_page`.
    refused
        Error messages of other traces, by file.
    page
        File to write.
    """
    template = Path(__file__).with_name("traces.html.j2").read_text(encoding="utf-8")
    environment = jinja2.Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True)
    text = environment.from_string(template).render(
        traces=traces,
        refused={visible(trace): visible_lines(reason) for trace, reason in refused.items()},
        written_by=f"{WRITTEN_BY} {__version__}",
        labels=labels_of(traces),
        in_unit=in_unit,
        not_shown=POSTERIOR_OF_REJECTED,
    )
    write_text(page, text)


def _figures(identified: Identified) -> dict[str, Figure]:
    data, problem = identified.data, identified.problem
    found = {item["quantity"]: item["value"] for item in data["quantities"]}
    values = {name: found[name] for name in problem.searched.names}
    fit = fit_of(problem, {**problem.fixed, **values}, identified.recorded, 0)
    figures = {
        "Trace, best fit and residuals": draw_fit(fit, "best fit", ""),
        "Residuals: over time, autocorrelation, distribution": draw_residuals(fit),
        "Profile likelihoods": draw_profiles("", {}, data),
    }
    if identified.samples is not None and data["fit"] != REJECTED:
        figures["Posterior: marginals and pairs of parameters"] = draw_corner(
            problem.searched.parameters, identified.samples, data["posterior"], {}, ""
        )
    return figures


def embedded(drawn: Figure) -> str:
    """Return a figure as a data URL for an image on a page."""
    content = io.BytesIO()
    save_png(drawn, content)
    return png_address(content.getvalue())
