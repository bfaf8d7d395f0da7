"""The paper's samples under its protocol and under others: a table, and one figure of both.

Another protocol is that of a case with the parameters of one of the paper's cases.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from biogrip.arrays import Array
from biogrip.figures.style import BLACK, BLUE, ORANGE, PAGE_IN, SHADE, figure, panel, save, styled
from biogrip.levels import DETERMINED_PERCENT
from biogrip.physics.response import compute_grip
from biogrip_study.config.study import Case, Study
from biogrip_study.gripper.nonlinear import jaw_force
from biogrip_study.records.identifications import read_batch, share_with_limits
from biogrip_study.stages.job import job_study, logged, paths
from biogrip_study.stages.targets import noise_of_readings
from biogrip_study.tables.layout import Column, Row, ShownTable, titled, write
from biogrip_study.tables.study import bounds_at_truth

if TYPE_CHECKING:
    snakemake: Any

_ENOUGH = 10.0
"""Error in percent within which an estimate is good enough."""
_COLUMNS = (
    *titled("case", "quantity", "unit"),
    Column("target", "Target", 4),
    Column("lowest_force_uN", "Lowest jaw force (µN)", 2),
    Column("readings", "Readings"),
    Column("noise_urad", "Noise (µrad)"),
    Column("density_nrad", "Noise density (nrad/√Hz)", 3),
    Column("bound_percent", "Bound, rest known %", 2),
    Column("bound_same_density_percent", "at the paper's noise density", 2),
    Column("seeds", "Seeds"),
    Column("median_error_percent", "Median abs. error %", 2),
    Column("enough_share", f"Share within {_ENOUGH:g} %", 3),
    Column("enough_from", "95 % from", 3),
    Column("enough_to", "to", 3),
)


def protocols(study: Study, identifications: list[Path]) -> ShownTable:
    """Compare what traces of every protocol tell, by bounds and by blind identifications."""
    rows, density = list[Row](), 1.0
    for case, found in _pairs(study, identifications):
        noise = _noise_rad(case) / np.sqrt(case.block.measurement.rate_Hz)
        density = noise if case.published.table else density
        rows += _rows(case, found, noise, density)
    caption = (
        "The paper's samples under its own protocol and under others: the lowest force of the "
        "jaws, negative where they would have to pull; the Cramér-Rao bound at the case's noise, "
        "parameters without information known, and at the noise density that the sample's trace "
        "has under the paper's protocol, whatever the rate; "
        f"and blind identifications by {study.shown_method.title}, all parameters unknown. "
        "Left out: quantities that have no bound under any protocol."
    )
    return ShownTable(caption, _COLUMNS, rows)


def _pairs(study: Study, identifications: list[Path]) -> list[tuple[Case, pd.DataFrame]]:
    """Return cases with their identifications, each of the paper's before those of its sample.

    Files are batches in folders of the case and the method.
    """
    known = [case.parameters for case in study.cases.values() if case.published.table]
    found: dict[str, list[pd.DataFrame]] = {}
    for path in identifications:
        name = path.parts[-3]
        found.setdefault(name, []).append(read_batch(path, study.cases[name]))
    both = [(study.cases[name], pd.concat(batches)) for name, batches in found.items()]
    return sorted(both, key=lambda it: (known.index(it[0].parameters), not it[0].published.table))


def _noise_rad(case: Case) -> float:
    """Return the standard deviation of a reading's noise."""
    return float(np.mean(noise_of_readings(case, case.times_s)))


def _rows(case: Case, found: pd.DataFrame, density: float, papers: float) -> Iterator[Row]:
    """Yield a row of every quantity that traces may determine.

    Densities of the noise, rad/√Hz, are the case's and that under the paper's protocol.
    """
    grip = compute_grip(case.gripper, case.network, case.torque)
    searched = case.experiment.searched.parameters
    for quantity, bound in bounds_at_truth(case):
        if not bound < DETERMINED_PERCENT:
            continue
        members = [searched[index] for index in quantity.members]
        truth = sum(case.parameters[member.name] for member in members)
        values = found[[member.column for member in members]].sum(axis=1).to_numpy(float)
        errors = 100 * np.abs(values / truth - 1)
        shares = share_with_limits(int(np.sum(errors <= _ENOUGH)), len(errors))
        yield {
            "case": case.title,
            "quantity": quantity.label,
            "unit": members[0].unit,
            "target": truth,
            "lowest_force_uN": 1e6 * grip.lowest_N,
            "readings": len(case.times_s),
            "noise_urad": 1e6 * _noise_rad(case),
            "density_nrad": 1e9 * density,
            "bound_percent": bound,
            "bound_same_density_percent": bound * papers / density,
            "seeds": len(errors),
            "median_error_percent": np.median(errors),
            **dict(zip(("enough_share", "enough_from", "enough_to"), shares, strict=True)),
        }


_DASHES = ":", "-", "--", "-."


def draw_protocols(study: Study, identifications: list[Path]) -> Figure:
    """Draw jaw forces, and how the identified k of all seeds lies about the truth."""
    pairs = _pairs(study, identifications)
    papers = [case for case, _ in pairs if case.published.table]
    drawn = figure(PAGE_IN, 4.2)
    panels = drawn.subplots(2, len(papers), squeeze=False, sharey="row")
    for column, paper in enumerate(papers):
        forces, estimates = panels[:, column]
        forces.axhline(0, color=BLACK, linewidth=0.6)
        estimates.axvspan(1 - _ENOUGH / 100, 1 + _ENOUGH / 100, color=SHADE)
        mine = [(case, found) for case, found in pairs if case.parameters == paper.parameters]
        for number, (case, found) in enumerate(mine):
            label = case.title.removeprefix(paper.title).lstrip(", ") or "the paper's"
            color, dashes = (BLUE, _DASHES[number % len(_DASHES)]) if number else (ORANGE, "-")
            if number < 2:
                forces.plot(*_force(case), color=color, label=label)
            ratios = found["k_N_per_m"].to_numpy(float) / case.parameters["k"]
            ratios = np.sort(np.clip(ratios, 0.3, 3))
            shares = np.arange(1, len(ratios) + 1) / len(ratios)
            estimates.step(ratios, shares, where="post", color=color, linestyle=dashes, label=label)
        estimates.set_xscale("log")
        estimates.set_xlim(0.29, 3.1)
        estimates.set_xticks([0.3, 0.5, 1, 2, 3], ["0.3", "0.5", "1", "2", "3"])
        estimates.minorticks_off()
        estimates.set_xlabel("identified over true k")
        forces.set_xlabel("time / duration")
        panel(forces, "abc"[column % 3], paper.title)
    panels[0, 0].set_ylabel("jaw force (µN)")
    panels[1, 0].set_ylabel("share of seeds below")
    panels[0, 0].legend(loc="lower left")
    max(panels[1], key=lambda axes: len(axes.lines)).legend(loc="upper left")
    return drawn


def _force(case: Case) -> tuple[Array, Array]:
    """Return times as shares of the duration, and the jaw force in µN without ringing."""
    time_s = np.linspace(0, case.torque.end_s, 4001)
    force = jaw_force(
        case.gripper, case.network, case.torque, time_s, nonlinear=False, inertia=False
    )
    return time_s / case.torque.end_s, 1e6 * force[0]


if __name__ == "__main__":
    with logged(snakemake):
        files = paths(snakemake.input.identifications)
        compared = job_study(snakemake)
        compared = compared.of(dict.fromkeys(file.parts[-3] for file in files))
        write(protocols(compared, files), Path(snakemake.output.table))
        with styled():
            save(draw_protocols(compared, files), *paths(snakemake.output.figure))
