"""How far the paper's linear model of the gripper is from the nonlinear one.

The difference of both, without noise, at several angles of the arms and multiples of the protocol's
torque; the torque up to which it is small, as a table; and maps of it, as a figure.
"""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from biogrip.arrays import Array
from biogrip.figures.style import BLUE, COLUMN_IN, TARGET, figure, panel, save, styled
from biogrip.physics.gripper import Gripper
from biogrip.physics.protocol import Course
from biogrip.physics.response import step_response, superpose
from biogrip.physics.sample_model import Network
from biogrip_study.config.study import Case, Study
from biogrip_study.gripper.nonlinear import correction
from biogrip_study.records.rows import RowFile
from biogrip_study.stages.job import job_study, logged, paths
from biogrip_study.tables.layout import Column, ShownTable, write

if TYPE_CHECKING:
    snakemake: Any

DIFFERENCES = RowFile(
    "a comparison",
    ("case", "reference_angle_deg", "torque_factor", "difference_over_peak"),
    words=("case",),
)
_ANGLES_DEG = np.arange(40.0, 91.0, 5.0)
_FACTORS = np.geomspace(0.25, 32.0, 15)


def compare(study: Study, differences: Path) -> None:
    """Write a row per case, angle and torque factor, CSV."""
    DIFFERENCES.write(differences, _rows(study))


def _rows(study: Study) -> Iterator[tuple[str, ...]]:
    for name, case in study.cases.items():
        model = case.sample.model
        values = [case.parameters[p] for p in model.names]
        network = model.network(np.tile(values, (len(_FACTORS), 1)))
        for angle in _ANGLES_DEG:
            turned = replace(case.gripper, reference_angle_deg=float(angle))
            shares = difference_over_peak(turned, network, case.torque, _FACTORS)
            for factor, share in zip(_FACTORS, shares, strict=True):
                yield name, f"{angle:g}", f"{factor:.4g}", f"{share:.4g}"


def difference_over_peak(
    gripper: Gripper, network: Network, torque: Course, factors: Array
) -> Array:
    """Return the largest difference of the models as a share of the nonlinear peak rotation, (n,).

    Factors of the torque are one per sample, (n,). NaN where the torque closes the arms beyond the
    model's validity.
    """
    time_s = _times(torque)
    found = correction(gripper, network, torque, factors)
    response = step_response(gripper, network, inertia=False)
    difference = found.at(time_s)
    nonlinear = factors[:, None] * superpose(response, torque, time_s) + difference
    share = np.max(np.abs(difference), axis=1) / np.max(np.abs(nonlinear), axis=1)
    return np.where(found.converged, share, np.nan)


def _times(torque: Course) -> Array:
    """Return times that are dense after every jump and reach up to the next."""
    ends = np.append(torque.time_s[1:], torque.end_s)
    lasting = zip(torque.time_s, ends - torque.time_s, strict=True)
    return np.concatenate(
        [start + np.geomspace(min(0.1, lasts / 2), lasts, 60) for start, lasts in lasting]
    )


LIMIT_PERCENT = 1.0
"""Difference up to which the linear model counts as accurate, as a share of the peak."""

_LINEARISATION_COLUMNS = (
    Column("case", "Case"),
    Column("reference_angle_deg", "Reference angle (deg)"),
    Column("difference_percent", "Difference at the protocol's torque (%)", 2),
    Column(f"factor_for_{LIMIT_PERCENT:g}_percent", f"Torque factor for {LIMIT_PERCENT:g} %", 3),
)


def linearisation(differences: Path) -> ShownTable:
    """Return, for every case and angle, the torque factor that reaches `LIMIT_PERCENT`."""
    rows = []
    for (case, angle), group in DIFFERENCES.read(differences).groupby(
        ["case", "reference_angle_deg"], sort=False
    ):
        factor = group["torque_factor"].to_numpy(float)
        share = group["difference_over_peak"].to_numpy(float)
        known = np.isfinite(share)
        at_one = np.exp(np.interp(0.0, np.log(factor[known]), np.log(share[known])))
        cells = case, float(angle), 100 * at_one, _crossing(factor, share)
        rows.append({c.name: x for c, x in zip(_LINEARISATION_COLUMNS, cells, strict=True)})
    caption = (
        "Largest difference of the linear from the nonlinear model, as a share of the peak, at the "
        "torque of the case's protocol, and the multiple of that torque at which it reaches "
        f"{LIMIT_PERCENT:g} % (empty: not up to {factor[-1]:g})."
    )
    return ShownTable(caption, _LINEARISATION_COLUMNS, rows)


def _crossing(factor: Array, share: Array) -> float | None:
    """Return the factor at which a share first reaches the limit, interpolated in logarithms."""
    limit = LIMIT_PERCENT / 100
    above = np.flatnonzero(share >= limit)
    if not len(above) or above[0] == 0:
        return float(factor[0]) if len(above) else None
    pair = slice(above[0] - 1, above[0] + 1)
    return float(np.exp(np.interp(np.log(limit), np.log(share[pair]), np.log(factor[pair]))))


_SHOWN_FACTOR = 20.0
_MOST_CASES = 3


def draw_linearisation(study: Study, differences: Path) -> Figure:
    """Draw the difference for the last case at twenty times the torque, and maps of a few."""
    comparison = DIFFERENCES.read(differences)
    cases = dict(list(study.cases.items())[:_MOST_CASES])
    drawn = figure(COLUMN_IN, 4.0)
    traces, *maps = drawn.subplots(2, 2).ravel()
    for axes in maps[len(cases) :]:
        axes.set_axis_off()
    last = list(cases)[-1]
    _difference(traces, cases[last])
    panel(traces, "a", f"{_SHOWN_FACTOR:g} × torque")
    for index, name in enumerate(cases):
        rows = comparison[comparison["case"] == name]
        grid = rows.pivot(
            index="torque_factor", columns="reference_angle_deg", values="difference_over_peak"
        )
        shares = 100 * grid.to_numpy(float)
        axes = maps[index]
        values, style = (grid.columns, grid.index, shares), {"cmap": "cividis_r"}
        mesh = axes.pcolormesh(*values, norm=LogNorm(1e-5, 30), shading="nearest", **style)
        if np.nanmax(shares) > LIMIT_PERCENT:
            lines = axes.contour(*values, [LIMIT_PERCENT], colors="white", linewidths=1.2)
            axes.clabel(lines, fmt=f"{LIMIT_PERCENT:g} %%", fontsize=7)
        axes.set_yscale("log")
        ticks = [0.3, 1, 3, 10, 30]
        axes.set_yticks(ticks, [f"{tick:g}" for tick in ticks])
        axes.minorticks_off()
        axes.set_xlabel(r"$\hat\theta_2$ (deg)")
        axes.set_ylabel("torque / protocol's" if index < 2 else "")
        panel(axes, "bcd"[index], cases[name].title, most_letters=22)
    label, below = "difference (% of peak)", [traces, *maps]
    drawn.colorbar(mesh, ax=below, label=label, location="bottom", aspect=40, pad=0.02)
    return drawn


def _difference(axes: Axes, case: Case) -> None:
    """Draw the nonlinear minus the linear rotation, as the curves themselves look the same."""
    gripper, network, torque = case.gripper, case.network, case.torque.times(_SHOWN_FACTOR)
    time_s = np.linspace(0, torque.end_s, 1001)
    response = step_response(gripper, network, inertia=False)
    linear = superpose(response, torque, time_s)[0]
    difference = correction(gripper, network, torque).at(time_s)[0]
    axes.plot(time_s, 1e3 * difference, color=BLUE)
    axes.axhline(0, color=TARGET, linewidth=0.6)
    axes.set(xlabel="time (s)", ylabel="nonlinear - linear (mrad)")
    bottom, top = axes.get_ylim()
    # Leave room for text above the curve.
    axes.set_ylim(bottom, top + 0.35 * (top - bottom))
    peak = f"{case.title}:\n{1e3 * np.max(np.abs(linear)):.3g} mrad at most"
    axes.annotate(peak, (0.98, 0.99), xycoords="axes fraction", ha="right", va="top", fontsize=7)


if __name__ == "__main__":
    with logged(snakemake):
        all_cases = job_study(snakemake)
        gripped, made = all_cases.of(all_cases.gripped), snakemake.output
        compare(gripped, Path(made.differences))
        write(linearisation(Path(made.differences)), Path(made.table))
        with styled():
            save(draw_linearisation(gripped, Path(made.differences)), *paths(made.figure))
