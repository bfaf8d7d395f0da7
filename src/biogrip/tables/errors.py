"""Tables 5 to 7: target, the paper's identification and ours."""

from pathlib import Path
from typing import Any

import numpy as np

from biogrip.arrays import Array
from biogrip.identify.identifications import at_noise_floor, lowest_misfit, read_identifications
from biogrip.study import build
from biogrip.tables.layout import Column, Table

TABLE_COLUMNS = (
    Column("case", "Case"),
    Column("parameter", "Parameter"),
    Column("unit", "Unit"),
    Column("target", "Target", 4),
    Column("paper_identified", "Paper", 4),
    Column("paper_error_percent", "Paper error %", 2),
    Column("best_seed", "Best seed"),
    Column("best_identified", "Best", 3),
    Column("best_error_percent", "Best error %", 2),
    Column("median_identified", "Median", 3),
    Column("p05_identified", "5 %", 3),
    Column("p95_identified", "95 %", 3),
    Column("median_absolute_error_percent", "Median abs. error %", 2),
    Column("seeds", "Seeds"),
    Column("noise_floor_share", "Share at noise floor", 2),
)


def errors(settings: dict[str, Any], inputs: list[Path]) -> Table:
    """Compare target and identified values of one case.

    Parameters
    ----------
    settings
        ``case``, ``method``, ``title``, ``model``, ``branches``, ``parameters``, ``published``,
        ``noise_floor_tolerance``.
    inputs
        The identifications of the case, CSV.
    """
    found = read_identifications(inputs[0], settings["method"])
    model = build.sample_model(settings)
    best = found.index.get_loc(lowest_misfit(found).name)
    known = bool(found["noise_rms_rad"].notna().all())
    reached = at_noise_floor(found, settings["noise_floor_tolerance"])
    share = float(np.mean(reached)) if known else None
    published = settings["published"]
    rows = []
    for names in model.quantities:
        label = " + ".join(parameter.name for parameter in names)
        target = _target(settings["parameters"], [parameter.name for parameter in names])
        values = found[[parameter.column for parameter in names]].sum(axis=1).to_numpy(float)
        error = error_percent(target, values)
        low, median, high = np.percentile(values, [5, 50, 95])
        rows.append(
            (
                settings["case"],
                label,
                names[0].unit,
                target,
                *_paper(published, [parameter.name for parameter in names], target),
                int(found["seed"].iloc[best]),
                float(values[best]),
                float(error[best]),
                float(median),
                float(low),
                float(high),
                float(np.median(np.abs(error))),
                len(found),
                share,
            )
        )
    number = f"Table {published['table']}. " if "table" in published else ""
    caption = (
        f"{number}{settings['title']}: target and identified parameters over {len(found)} seeds. "
        "Best is the seed of lowest misfit. Error = (target - identified) / target."
        if settings["parameters"]
        else f"{settings['title']}: parameters identified in the recorded trace."
    )
    return Table(caption, TABLE_COLUMNS, rows)


def error_percent(target: float | None, identified: Array) -> Array:
    """Signed error (target - identified) / target in percent; NaN for a target of zero or none."""
    if not target:
        return np.full_like(identified, np.nan)
    return 100 * (target - identified) / target


def _target(parameters: dict[str, float], names: list[str]) -> float | None:
    """Return the true value of a parameter or a sum, unless the trace was recorded."""
    return sum(parameters[name] for name in names) if parameters else None


def _paper(
    published: dict[str, Any], names: list[str], target: float | None
) -> tuple[float | None, str | float | None]:
    """Return the paper's value and error; the error of a sum is computed from its values."""
    identified = published.get("identified", {})
    if not all(name in identified for name in names):
        return None, None
    value = float(sum(identified[name] for name in names))
    if len(names) == 1:
        return value, published["error_percent"].get(names[0])
    return value, float(error_percent(target, np.array([value]))[0])
