"""Designed experiments on one page that needs nothing else."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import jinja2

from biogrip import __version__
from biogrip.files import write_text
from biogrip.instrument.actuator import voltage
from biogrip.own_design.designed import Designed, percent
from biogrip.own_design.drawings import drawings
from biogrip.own_traces.outputs import WRITTEN_BY
from biogrip.own_traces.page import embedded
from biogrip.products.figures.style import styled

_SHOWN = 12


def write_page(designs: Iterable[Designed], page: Path) -> None:
    """Write the page, HTML."""
    template = Path(__file__).with_name("designed.html.j2").read_text(encoding="utf-8")
    environment = jinja2.Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True)
    text = environment.from_string(template).render(
        designs=[_told(found) for found in designs], written_by=f"{WRITTEN_BY} {__version__}"
    )
    write_text(page, text)


def _told(found: Designed) -> dict[str, Any]:
    plan, wanted = found.plan, found.wanted
    with styled():
        figures = [(title, embedded(drawn)) for title, drawn in drawings(found)]
    torques = [phase.left.value_Nm for phase in plan.phases]
    volts = voltage(found.case.actuator, torques)
    steps = zip(plan.phases, torques, volts, strict=True)
    return {
        "title": found.case.title,
        "names": wanted.model.names,
        "in_print": [f"{p.name} ({p.unit})" if p.unit else p.name for p in wanted.model.parameters],
        "samples": [
            {
                "values": [f"{value:.3g}" for value in values],
                "before": [percent(bound) for bound in before],
                "after": [percent(bound) for bound in after],
            }
            for values, before, after in zip(
                wanted.parameters, found.before, found.after, strict=True
            )
        ],
        "figures": figures,
        "gap": f"{100 * plan.gap:.2g}",
        "force_uN": f"{1e6 * found.force_N.max():.3g}",
        "noise_urad": f"{1e6 * wanted.noise_rad:.3g}",
        "readings": len(plan.time_s),
        "end_s": f"{plan.torque.end_s:g}",
        "steps": [
            (f"{phase.duration_s:.6g}", f"{1e9 * torque:.4g}", f"{volt:.3f}")
            for phase, torque, volt in steps
        ],
        "bursts": [
            (f"{burst.from_s:.6g}", f"{burst.rate_Hz:.6g}", str(burst.samples))
            for burst in plan.bursts
        ],
        "shown": _SHOWN,
    }
