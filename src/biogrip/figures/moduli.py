"""Moduli of all fits over frequency, and sensitivities over time."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from biogrip.arrays import Array, BoolArray
from biogrip.figures.results import first_seeds
from biogrip.figures.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PAGE_IN,
    PURPLE,
    SHADE,
    SKY,
    figure,
    line_of,
    panel,
)
from biogrip.physics.noise import standard_deviation
from biogrip.physics.sample_model import Network, SampleModel, complex_modulus
from biogrip.records.identifications import read_identifications
from biogrip.records.success import near_noise
from biogrip.records.traces import read_target
from biogrip.study.study import Case, Study

NEAR = 0.1
"""Relative spread of nine tenths of the fits below which the experiment determines a modulus."""

_POINTS = 121
_TITLE_LETTERS = 28
_STYLES: tuple[dict[str, Any], ...] = (
    *({"color": colour} for colour in (BLUE, ORANGE, GREEN)),
    *({"color": colour, "linestyle": (0, (2, 2))} for colour in (PURPLE, SKY, GREY)),
)


def draw_moduli(study: Study, identifications: list[Path], targets: list[Path]) -> Figure:
    """Draw moduli over frequency, and sensitivities over time."""
    drawn = figure(PAGE_IN, 4.4)
    axes = drawn.subplots(2, len(study.cases), squeeze=False, height_ratios=[1.35, 1])
    files = zip(study.cases.values(), identifications, targets, strict=True)
    for column, (case, identified, target) in enumerate(files):
        time_s, _, rotation = read_target(target)
        logs = case.experiment.logs(case.parameters)
        _, sensitivity = case.experiment.of(time_s, rotation).residuals(logs)
        sigma = standard_deviation(rotation, case.noise)
        # Without noise there is nothing to compare with: NaN.
        relative = sensitivity / np.where(sigma > 0, sigma, np.nan)
        _moduli(axes[0, column], study, case, identified, time_s)
        _sensitivities(axes[1, column], case.experiment.searched, time_s, relative)
        panel(axes[0, column], "abc"[column], case.title, _TITLE_LETTERS)
        panel(axes[1, column], "def"[column], "when each parameter shows", _TITLE_LETTERS)
    units = [case.experiment.model.stiffness_unit for case in study.cases.values()]
    for column, unit in enumerate(units):
        if column == 0 or unit != units[column - 1]:
            axes[0, column].set_ylabel(f"modulus ({unit})")
    axes[1, 0].set_ylabel("sensitivity / noise")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    drawn.legend(handles, labels, loc="outside upper center", ncols=len(labels))
    return drawn


def _moduli(axes: Axes, study: Study, case: Case, identified: Path, time_s: Array) -> None:
    """Draw G' and G'' of all fits and of the truth, and shade where the fits agree."""
    between = np.diff(time_s)
    slowest, fastest = 1 / (time_s[-1] - time_s[0]), 1 / float(np.min(between))
    omega = np.geomspace(slowest / 30, 30 * fastest, _POINTS)
    model = case.experiment.model
    near = []
    for method in {m.name: m for m in (study.shown_method, study.fitting_method)}.values():
        found = first_seeds(read_identifications(identified, method.name))
        fits = found[[p.column for p in model.parameters]].to_numpy(float)
        moduli = _modulus(model.network(fits), omega)
        near.append(moduli[near_noise(found, study.near_noise_tolerance)])
        style = line_of(method) | {"linewidth": 0.4, "alpha": 0.45}
        for index, modulus in enumerate(moduli):
            label = method.title if index == 0 else None
            for part, dashed in ((modulus.real, "-"), (modulus.imag, "--")):
                axes.plot(omega, part, **style | {"linestyle": dashed}, label=label)
                label = None
    fitting = np.concatenate(near)
    shown = np.flatnonzero(_agreed(fitting)) if len(fitting) else np.array([], dtype=np.int64)
    for run in np.split(shown, np.flatnonzero(np.diff(shown) > 1) + 1) if len(shown) else []:
        axes.axvspan(
            omega[run[0]], omega[run[-1]], color=SHADE, linewidth=0, zorder=0,
            label="seen by the experiment" if run[0] == shown[0] else None,
        )  # fmt: skip
    truth = _modulus(model.sample(case.parameters), omega)[0]
    axes.plot(omega, truth.real, color=BLACK, label="truth, $G'$")
    axes.plot(omega, truth.imag, "--", color=BLACK, label="truth, $G''$")
    axes.set(xscale="log", yscale="log")
    largest = float(np.max(np.abs(truth)))
    axes.set_ylim(1e-5 * largest, 5 * largest)
    axes.set_xlim(omega[0], omega[-1])
    axes.set_xlabel("angular frequency (rad/s)")


def _sensitivities(axes: Axes, model: SampleModel, time_s: Array, relative: Array) -> None:
    # Decreasing widths and dashes keep coinciding curves visible.
    widths = np.linspace(2.2, 1.0, len(model.parameters))
    for parameter, row, style, width in zip(
        model.parameters, relative, _STYLES, widths, strict=False
    ):
        axes.plot(time_s, row, linewidth=width, label=parameter.symbol, **style)
    axes.axhspan(-1, 1, color=SHADE, linewidth=0, zorder=0)
    axes.set(xlim=(time_s[0], time_s[-1]), xlabel="time (s)")
    if not np.any(np.isfinite(relative)):
        axes.text(0.5, 0.5, "no noise", ha="center", transform=axes.transAxes)
    axes.legend(ncols=2, columnspacing=0.8, handlelength=1)


def _modulus(network: Network, omega: Array) -> Array:
    """Return complex moduli of n samples, in N/m or Pa, (n, n_omega)."""
    storage, loss = complex_modulus(network, omega)
    return storage + 1j * loss


def _agreed(moduli: Array) -> BoolArray:
    """Return True at frequencies where nine tenths of fits, (n, n_omega), agree on the modulus."""
    low, high = np.quantile(np.abs(moduli), (0.05, 0.95), axis=0)
    return high < (1 + NEAR) * low
