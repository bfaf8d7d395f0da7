"""Tables 5 to 7: target, the paper's identification and ours."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from biogrip.arrays import Array
from biogrip.errors import BiogripError
from biogrip.identify.records import LEADING, TRAILING
from biogrip.sample import Parameter, SampleModel
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
        ``case``, ``title``, ``model``, ``branches``, ``parameters``, ``published``,
        ``noise_floor_tolerance``.
    inputs
        The identifications of the case, CSV.
    """
    found = read_identifications(inputs[0])
    model = build.sample_model(settings)
    best = int(found["misfit_rad"].to_numpy().argmin())
    share = float(np.mean(at_noise_floor(found, settings["noise_floor_tolerance"])))
    published = settings["published"]
    rows = []
    for names in quantities(model):
        label = " + ".join(parameter.name for parameter in names)
        target = sum(settings["parameters"][parameter.name] for parameter in names)
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
    )
    return Table(caption, TABLE_COLUMNS, rows)


def read_identifications(path: Path) -> pd.DataFrame:
    """Read a file of identifications.

    Raises
    ------
    BiogripError
        If it is missing or is not one.
    """
    try:
        frame = pd.read_csv(path)
    except (OSError, ValueError) as error:
        raise BiogripError(f"{path}: cannot be read as identifications: {error}.") from error
    wanted = [*LEADING, *TRAILING]
    if not set(wanted) <= set(frame.columns):
        raise BiogripError(f"{path}, line 1: wanted the columns {', '.join(wanted)}.")
    return frame


def at_noise_floor(found: pd.DataFrame, tolerance: float) -> Array:
    """Whether each seed's misfit reaches the RMS of the noise in its trace, (n_seeds,).

    A fit of a few parameters to thousands of samples comes out at that RMS or a
    hair below it if, and only if, it is as good as the truth.
    """
    misfit, noise = (
        found["misfit_rad"].to_numpy(float),
        found["noise_rms_rad"].to_numpy(float),
    )
    return np.asarray(misfit <= (1 + tolerance) * noise, dtype=float)


def error_percent(target: float, identified: Array) -> Array:
    """Signed error (target - identified) / target in percent; NaN for a target of zero."""
    if target == 0:
        return np.full_like(identified, np.nan)
    return 100 * (target - identified) / target


def quantities(model: SampleModel) -> list[list[Parameter]]:
    """Every parameter, and together those that trade against each other."""
    singles = [[parameter] for parameter in model.parameters]
    together = [p for p in model.parameters if p.name in model.exchangeable]
    return [*singles, together] if together else singles


def _paper(
    published: dict[str, Any], names: list[str], target: float
) -> tuple[float | None, str | float | None]:
    """Return the paper's value and error; the error of a sum is computed from its values."""
    identified = published.get("identified", {})
    if not all(name in identified for name in names):
        return None, None
    value = float(sum(identified[name] for name in names))
    if len(names) == 1:
        return value, published["error_percent"].get(names[0])
    return value, float(error_percent(target, np.array([value]))[0])
