"""HTML page of designed experiments, self-contained."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jinja2
import numpy as np

from biogrip import __version__
from biogrip.design.schedule import Plan
from biogrip.design.several import Several
from biogrip.digits import with_unit
from biogrip.experiment.protocol import Harmonic, Phase
from biogrip.files import write_text
from biogrip.instrument.actuator import CombDrive, voltage
from biogrip.instrument.instrument import Instrument
from biogrip.own_design.at_a_price import (
    WAYS,
    aim,
    costs,
    in_print,
    judged_in_words,
    price_in_words,
    set_in_words,
)
from biogrip.own_design.designed import (
    Designed,
    best_in_words,
    in_numbers,
    kind,
    left_out,
    noise_in_words,
    percent,
    shown_unit,
)
from biogrip.own_design.drawings import drawings
from biogrip.own_traces.outputs import WRITTEN_BY
from biogrip.products.figures.style import styled
from biogrip.products.pages.figure_address import figure_address

_SHOWN = 12


@dataclass(frozen=True)
class _Column:
    """A column of what to set: heading, formatter, and the kind of phase it is for."""

    head: str
    cell: Callable[[Phase, CombDrive], str]
    only: str | None = None


def _volts(phase: Phase, comb: CombDrive) -> str:
    """Return voltages at the ends of a phase, or the lowest and the highest of a sinusoid."""
    load = phase.left
    swing = sum(harmonic.amplitude_Nm for harmonic in load.harmonics)
    ends = [load.value_Nm - swing, load.value_Nm + swing]
    if kind(phase) == "ramp":
        ends[1] += load.slope_Nm_per_s * phase.duration_s
    first, last = (f"{volt:.3f}" for volt in voltage(comb, np.maximum(ends, 0.0)))
    return first if kind(phase) == "step" else f"{first} to {last}"


def _swing(phase: Phase, of: Callable[[Harmonic], float]) -> str:
    return "".join(f"{of(harmonic):.6g}" for harmonic in phase.left.harmonics)


def _columns(instrument: Instrument) -> Iterator[_Column]:
    """Yield the columns of what an instrument holds."""
    scale, unit = shown_unit(instrument)
    yield _Column("for (s)", lambda phase, _: f"{phase.duration_s:.6g}")
    yield _Column(
        with_unit(instrument.controlled.name, unit),
        lambda phase, _: f"{scale * phase.left.value_Nm:.4g}",
    )
    yield _Column(
        with_unit("to", unit),
        lambda phase, _: (
            f"{scale * float(phase.left.at(phase.duration_s)):.4g}" if kind(phase) == "ramp" else ""
        ),
        "ramp",
    )
    yield _Column(
        with_unit("amplitude", unit),
        lambda phase, _: _swing(phase, lambda harmonic: scale * harmonic.amplitude_Nm),
        "sinusoid",
    )
    yield _Column(
        "frequency (Hz)",
        lambda phase, _: _swing(phase, lambda harmonic: harmonic.frequency_Hz),
        "sinusoid",
    )
    if instrument.has_jaws:
        yield _Column("voltage (V)", _volts)


def write_page(designs: Iterable[Designed], page: Path) -> None:
    """Write the page as HTML."""
    template = Path(__file__).with_name("designed.html.j2").read_text(encoding="utf-8")
    environment = jinja2.Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True)
    text = environment.from_string(template).render(
        designs=[_describe(found) for found in designs],
        written_by=f"{WRITTEN_BY} {__version__}",
    )
    write_text(page, text)


def _describe(found: Designed) -> dict[str, Any]:
    plan, inputs, instrument = found.plan, found.inputs, found.inputs.instrument
    with styled():
        figures = [(title, figure_address(drawn)) for title, drawn in drawings(found)]
    return {
        "title": found.case.title,
        "names": inputs.model.names,
        "in_print": [f"{p.name} ({p.unit})" if p.unit else p.name for p in inputs.model.parameters],
        "samples": [
            {
                "values": [f"{value:.3g}" for value in values],
                "before": [percent(bound) for bound in before],
                "after": [percent(bound) for bound in after],
            }
            for values, before, after in zip(
                inputs.parameters, found.before, found.after, strict=True
            )
        ],
        "left_out": left_out(inputs) if inputs.out_of_reach else "",
        "figures": figures,
        "best": best_in_words(found).capitalize(),
        "has_jaws": instrument.has_jaws,
        "force_uN": f"{1e6 * found.force_N.max(initial=0.0):.3g}",
        "noise": noise_in_words(inputs),
        "readings": len(plan.time_s),
        "end_s": f"{plan.torque.end_s:g}",
        "to_set": _to_set(found, plan),
        "several": _several(found, found.several) if found.several else None,
        "shown": _SHOWN,
    }


def _to_set(found: Designed, plan: Plan) -> dict[str, Any]:
    """Describe what to set for an experiment."""
    kinds = {kind(phase) for phase in plan.phases}
    columns = _columns(found.inputs.instrument)
    shown = [column for column in columns if column.only in (None, *kinds)]
    return {
        "in_numbers": in_numbers(plan.phases),
        "follows_root": kinds != {"step"},
        "columns": [column.head for column in shown],
        "steps": [
            [column.cell(phase, found.case.actuator) for column in shown] for phase in plan.phases
        ],
        "bursts": [
            (f"{burst.from_s:.6g}", f"{burst.rate_Hz:.6g}", str(burst.samples))
            for burst in plan.bursts
        ],
    }


def _several(found: Designed, several: Several) -> dict[str, Any]:
    """Describe several experiments with each cell."""
    chosen = several.chosen
    titles = set_in_words(several, chosen) if chosen else []
    plans = several.plans_of(chosen) if chosen else []
    return {
        "price": price_in_words(several.settings),
        "aim": aim(found.case, several),
        "offers": len(several.offers),
        "judged": judged_in_words(several),
        "ways": WAYS,
        "rows": [(f"{100 * share:g}", *map(in_print, row)) for share, row in costs(several)],
        "chosen": [
            {"title": title, **_to_set(found, plan)}
            for title, plan in zip(titles, plans, strict=True)
        ],
    }
