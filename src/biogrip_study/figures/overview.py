"""Figures of a study: fits and identifications about the truth, moduli, its answer at a glance."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

import biogrip_study.records.identifications as records
from biogrip.arrays import Array
from biogrip.digits import with_unit
from biogrip.figures import style
from biogrip.figures.fit import draw_traces
from biogrip.figures.likelihood import draw_profile
from biogrip.judging.likelihood import parameters_and_sum, quantity_value
from biogrip.judging.profiles import BOUNDED_ABOVE
from biogrip.physics.noise import standard_deviation
from biogrip.physics.sample_model import Network, complex_modulus
from biogrip_study.config.study import Case, Study
from biogrip_study.figures import case_fit
from biogrip_study.methods.registry import METHODS
from biogrip_study.records.traces import read_target

# End of the axis of identified over target values.
_WORST = 1e3
_TITLE_LETTERS = 19


def draw_overview(
    study: Study, identifications: list[Path], expected: list[Path], measurements: list[Path]
) -> Figure:
    """Draw a fit of each basin of the first case, and identified over target values of some."""
    cases = list(study.cases.values())
    drawn = style.figure(style.PAGE_IN, 3.0)
    axes = drawn.subplots(1, 1 + len(cases), width_ratios=[2] + [1.05] * len(cases))
    fits = case_fit.fits_of_basins(cases[0], identifications[0], measurements)
    factor, _ = draw_traces(axes[0], fits)
    fit = next(iter(fits.values()))
    axes[0].set_ylim(top=1.65 * factor * fit.measured.max())
    axes[0].set(xlim=(fit.time_s[0], fit.time_s[-1]), xlabel="time (s)")
    axes[0].legend(loc="upper right")
    style.panel(axes[0], "a", cases[0].title)
    files = zip(axes[1:], cases, identifications, expected, strict=True)
    for index, (scatter, case, path, judged) in enumerate(files):
        identified = records.read_identifications(path, case, study.shown_method.name)
        quantities = records.read_verdicts(judged)["quantities"]
        bounded = {item["quantity"] for item in quantities if item["verdict"] != BOUNDED_ABOVE}
        _draw_ratios(scatter, case, case_fit.first_seeds(identified), bounded)
        scatter.tick_params(labelleft=index == 0)
        style.panel(scatter, "bcd"[index], case.title, most_letters=_TITLE_LETTERS)
    axes[1].set_ylabel("identified / target")
    # Not every case is the paper's.
    entries = [scatter.get_legend_handles_labels() for scatter in axes[1:]]
    handles, labels = max(entries, key=lambda entry: len(entry[1]))
    few = len(identified) > case_fit.SHOWN_SEEDS
    title = case_fit.seeds_in_words(len(identified)) if few else None
    place: dict[str, Any] = {"loc": "outside lower right", "ncols": 5, "markerscale": 2.5}
    drawn.legend(handles, labels, title=title, **place)
    return drawn


def _draw_ratios(axes: Axes, case: Case, fits: pd.DataFrame, bounded: set[str]) -> None:
    """Draw identified over target values of what is determined or bounded below."""
    reached = records.near_noise(fits, case.study)
    looks = {
        f"fit {records.near_noise_words(case.study)}": (reached, style.FITTED),
        "other fits": (~reached, style.ALL_SEEDS),
    }
    for label, (_, color) in looks.items():
        axes.plot([], [], **case_fit.DOTS | {"color": color}, label=label)
    axes.plot([], [], "^", color=style.TARGET, markersize=1.6, label="beyond the axis")
    axes.axhline(1, color=style.TARGET, linewidth=0.8, label="truth")
    if case.published.identified:
        axes.plot([], [], color=style.PAPER, label="paper")
    ticks: list[str] = []
    found = records.values_by_quantity(fits, case.sample.model)
    for quantity in parameters_and_sum(case.sample.model):
        label, values = quantity.label, found[quantity.label]
        target = quantity_value(label, case.parameters)
        if not target or label not in bounded:
            continue
        x = len(ticks)
        ticks.append(quantity.symbol.replace(" ", ""))
        ratios = values.to_numpy(float) / target
        for which, color in reversed(looks.values()):
            case_fit.draw_runs(axes, x, ratios[which], (1 / _WORST, _WORST), color)
        if (paper := quantity_value(label, case.published.identified)) is not None:
            shown = np.clip(paper / target, 1 / _WORST, _WORST)
            axes.plot([x - 0.4, x + 0.4], [shown, shown], color=style.PAPER)
    axes.set(yscale="log", ylim=(1 / (2 * _WORST), 2 * _WORST))
    axes.set_xticks(range(len(ticks)), ticks)


def draw_answer(study: Study, verdicts: Path, measurements: Path) -> Figure:
    """Draw a gripper, the judged trace of the only case, and what it tells of two dampers."""
    (case,) = study.cases.values()
    judged = records.read_verdicts(verdicts)
    items = {item["quantity"]: item for item in judged["quantities"]}
    drawn = style.figure(style.COLUMN_IN, 3.4)
    (device, trace), profiles = drawn.subplots(2, 2)
    _device(device)
    style.panel(device, "1", "two arms squeeze")
    fit = case_fit.judged_fit(case, judged, measurements)
    factor, unit = draw_traces(trace, {"fit": fit})
    trace.set_ylim(top=1.45 * factor * fit.measured.max())
    trace.set(xlabel="time (s)", ylabel=with_unit("rotation", unit))
    handles, _ = trace.get_legend_handles_labels()
    trace.legend(handles[::2], ["trace", "fit"], loc="upper right", ncols=2, columnspacing=1)
    style.panel(trace, "2", "one of them turns")
    names = [name for name in case.sample.model.names if name in case.sample.model.exchangeable]
    for number, axes, name in zip("34", profiles, (" + ".join(names), names[1]), strict=True):
        draw_profile(axes, items[name])
        axes.axhline(judged["threshold"], color=style.BLACK, linestyle="--", linewidth=0.7)
        place = (0.02, judged["threshold"] + 0.2, f"{100 * judged['confidence']:g} %")
        axes.text(*place, transform=axes.get_yaxis_transform(), fontsize=7)
        style.panel(axes, number, f"{items[name]['symbol']}: {items[name]['verdict']}")
    profiles[0].set_ylabel("rise of χ²")
    return drawn


def _device(axes: Axes) -> None:
    axes.add_patch(Circle((0, 3.0), 0.34, color=style.ORANGE))
    for side in (-1, 1):
        axes.plot([side * 1.2, side * 0.32], [0, 3.1], color=style.BLUE, linewidth=4)
        axes.plot(side * 1.2, 0, "o", color="white", markeredgecolor=style.BLACK, markersize=6)
        arrow = {"arrowstyle": "->", "lw": 1.0, "color": style.BLACK}
        axes.annotate("", (side * 0.65, 1.5), (side * 1.5, 1.5), arrowprops=arrow)
    axes.annotate("torque", (0, 1.5), ha="center", va="center", fontsize=7)
    axes.set(xlim=(-1.8, 1.8), ylim=(-0.3, 3.5), aspect="equal")
    axes.set_axis_off()


NEAR = 0.1
"""Relative spread of nine tenths of the fits below which the experiment determines a modulus."""

_MODULI_DRAWN = 121
_PANEL_LETTERS = 28
_COLORS = style.BLUE, style.ORANGE, style.GREEN, style.PURPLE, style.SKY, style.GREY


def draw_moduli(study: Study, identifications: list[Path], targets: list[Path]) -> Figure:
    """Draw moduli over frequency, and sensitivities over time."""
    drawn = style.figure(style.PAGE_IN, 4.4)
    axes = drawn.subplots(2, len(study.cases), squeeze=False, height_ratios=[1.35, 1])
    files = zip(study.cases.values(), identifications, targets, strict=True)
    for column, (case, identified, target) in enumerate(files):
        time_s, _, rotation = read_target(target, case.times_s)
        _draw_moduli_of_case(axes[0, column], study, case, identified, time_s)
        _draw_sensitivities(axes[1, column], case, time_s, rotation)
        style.panel(axes[0, column], "abc"[column], case.title, _PANEL_LETTERS)
        style.panel(axes[1, column], "def"[column], "when each parameter shows", _PANEL_LETTERS)
    axes[1, 0].set_ylabel("sensitivity / noise")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    drawn.legend(handles, labels, loc="outside upper center", ncols=len(labels))
    return drawn


def _draw_moduli_of_case(
    axes: Axes, study: Study, case: Case, identified: Path, time_s: Array
) -> None:
    """Draw G' and G'' of all fits and of the truth, and shade where the fits agree."""
    slowest, fastest = 1 / (time_s[-1] - time_s[0]), 1 / float(np.min(np.diff(time_s)))
    omega = np.geomspace(slowest / 30, 30 * fastest, _MODULI_DRAWN)
    model = case.experiment.model
    near = []
    # The first method, and least squares if the study has it.
    names = dict.fromkeys([*study.config.methods[:1], "least_squares"])
    for method in [METHODS[name] for name in names if name in study.config.methods]:
        runs = case_fit.first_seeds(records.read_identifications(identified, case, method.name))
        fits = runs[[p.column for p in model.parameters]].to_numpy(float)
        moduli = _modulus(model.network(fits), omega)
        near.append(moduli[records.near_noise(runs, study)])
        look: dict[str, Any] = {"color": style.COLORS[method.color], "alpha": 0.45}
        axes.plot(omega, moduli.real.T, linewidth=0.4, **look)
        axes.plot(omega, moduli.imag.T, "--", linewidth=0.4, **look)
        axes.plot([], [], label=method.title, **look)
    fitting = np.concatenate(near)
    # In the upper half and, hatched, in the lower one.
    hatched = {"facecolor": "none", "edgecolor": style.SHADE, "hatch": "////"}
    _shade_agreement(axes, omega, fitting.real, 0.5, label="storage seen", color=style.SHADE)
    _shade_agreement(axes, omega, fitting.imag, 0.0, label="loss seen", **hatched)
    truth = _modulus(model.sample(case.parameters), omega)[0]
    axes.plot(omega, truth.real, color=style.BLACK, label="truth, storage")
    axes.plot(omega, truth.imag, "--", color=style.BLACK, label="truth, loss")
    largest, unit = float(np.max(np.abs(truth))), model.stiffness_unit
    axes.set(xscale="log", yscale="log", ylim=(1e-5 * largest, 5 * largest))
    axes.set(xlim=(omega[0], omega[-1]), xlabel="angular frequency (rad/s)")
    axes.set_ylabel(f"{'stiffness' if unit == 'N/m' else 'modulus'} ({unit})")


def _shade_agreement(axes: Axes, omega: Array, moduli: Array, bottom: float, **look: Any) -> None:
    """Shade where nine tenths of the fits, (n, n_omega), agree, over half of the height."""
    if len(moduli):
        least, most = np.quantile(moduli, (0.05, 0.95), axis=0)
        look |= {"transform": axes.get_xaxis_transform(), "linewidth": 0, "zorder": 0}
        axes.fill_between(omega, bottom, bottom + 0.5, where=most < (1 + NEAR) * least, **look)


def _draw_sensitivities(axes: Axes, case: Case, time_s: Array, rotation: Array) -> None:
    """Draw how each parameter changes the response, in standard deviations of the noise."""
    logs = case.experiment.logs(case.parameters)
    _, sensitivity = case.experiment.of(time_s, rotation).residuals(logs)
    sigma = standard_deviation(rotation, case.noise)
    # Without noise there is nothing to compare with: NaN.
    relative = sensitivity / np.where(sigma > 0, sigma, np.nan)
    parameters = case.experiment.searched.parameters
    # Decreasing widths keep coinciding curves visible.
    widths = np.linspace(2.2, 1.0, len(parameters))
    for parameter, row, color, width in zip(parameters, relative, _COLORS, widths, strict=False):
        axes.plot(time_s, row, linewidth=width, color=color, label=parameter.symbol)
    axes.axhspan(-1, 1, color=style.SHADE, linewidth=0, zorder=0)
    axes.set(xlim=(time_s[0], time_s[-1]), xlabel="time (s)")
    if case.noise.absent:
        axes.text(0.5, 0.5, "no noise", ha="center", transform=axes.transAxes)
    axes.legend(ncols=2, columnspacing=0.8, handlelength=1)


def _modulus(network: Network, omega: Array) -> Array:
    """Return complex moduli of n samples, in N/m or Pa, (n, n_omega)."""
    storage, loss = complex_modulus(network, omega)
    return storage + 1j * loss
