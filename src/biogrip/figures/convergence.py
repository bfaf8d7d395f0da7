"""Figure 8: how the best misfit falls from step to step."""

from pathlib import Path
from typing import Any

import pandas as pd
from matplotlib.figure import Figure

from biogrip.figures.results import read_history, seeds_in_words
from biogrip.figures.style import ALL_SEEDS, COLUMN_IN, FITTED, TARGET, figure
from biogrip.identify.identifications import at_noise_floor, lowest_misfit, read_identifications

_TICKS = (0, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000)


def draw(settings: dict[str, Any], inputs: list[Path]) -> Figure:
    """Draw by how much the seeds' misfits exceed their noise, and that of the best.

    Parameters
    ----------
    settings
        ``method``, its ``step``, ``title``, ``noise_floor_tolerance``, ``mutation_start``, None for
        a method without.
    inputs
        Identifications (CSV) and histories (Parquet) of the case.
    """
    found = read_identifications(inputs[0], settings["method"])
    noise = found.set_index("seed")["noise_rms_rad"]
    noisy = bool((noise > 0).all())
    unit = noise if noisy else pd.Series(found["misfit_rad"].min(), index=noise.index)
    best = int(lowest_misfit(found)["seed"])
    history = read_history(inputs[1], settings["method"], best)
    reached = at_noise_floor(found, settings["noise_floor_tolerance"])
    drawn = figure(COLUMN_IN, 2.5)
    axes = drawn.subplots()
    for seed, rows in history.groupby("seed"):
        excess = 100 * (rows["best_misfit_rad"] / unit[seed] - 1)
        style: dict[str, Any] = {"color": ALL_SEEDS, "linewidth": 0.4, "alpha": 0.7}
        if seed == best:
            style = {"color": FITTED, "linewidth": 1.5, "zorder": 3}
        axes.plot(rows["generation"], excess, **style)
    axes.plot([], [], color=ALL_SEEDS, linewidth=0.8, label=seeds_in_words(len(found)))
    axes.plot([], [], color=FITTED, label=f"seed {best}, lowest misfit")
    label = "noise in the trace" if noisy else "lowest misfit"
    axes.axhline(0, color=TARGET, linestyle="--", linewidth=0.8, label=label)
    if settings["mutation_start"] is not None:
        axes.axvline(settings["mutation_start"], color=TARGET, linestyle=":", linewidth=0.8)
        axes.annotate(
            "mutation starts",
            (settings["mutation_start"], 0.62),
            xycoords=("data", "axes fraction"),
            xytext=(3, 0),
            textcoords="offset points",
            fontsize=7,
        )
    axes.set_yscale("symlog", linthresh=1, linscale=0.5)
    axes.set_ylim(bottom=-0.8)
    ticks = [tick for tick in _TICKS if tick < axes.get_ylim()[1]]
    axes.set_yticks(ticks, [f"{tick:g}" for tick in ticks])
    axes.minorticks_off()
    axes.set_xlim(0, history["generation"].max())
    axes.set_xlabel(settings["step"])
    axes.set_ylabel(f"best misfit above {'noise' if noisy else 'the lowest'} (%)")
    share = f": {reached.sum()} of {len(found)} at the noise floor" if noisy else ""
    axes.set_title(settings["title"] + share)
    axes.legend(loc="upper right")
    return drawn
