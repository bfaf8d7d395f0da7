"""Settings and inputs shared by the table and the heat maps of a sweep."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from biogrip.fit.methods import Method
from biogrip.judging.at_truth import headlines
from biogrip.stages.sweep_points import POINTS
from biogrip.study.study import Study
from biogrip.study.sweeps import AxisBlock


@dataclass(frozen=True)
class ShownAxis:
    """An axis of a sweep as it is shown."""

    title: str
    """Title with the unit, marked if the paper does not give the values."""
    values: Mapping[str, str]
    """Values as shown, by their text in files."""


@dataclass(frozen=True)
class HeatMaps:
    """Titles, axes and tolerances of a sweep's table and heat maps."""

    name: str
    """Name of the sweep."""
    title: str
    """Title of the sweep."""
    cases: Mapping[str, str]
    """Titles of the cases, by name."""
    methods: Mapping[str, Method]
    """Identifiers by name."""
    rows: ShownAxis
    columns: ShownAxis
    near_noise_tolerance: float
    """Share by which a misfit may exceed the noise to count as near it."""
    reconstructed: tuple[str, ...]
    """Keys of the gripper that the paper does not give."""


def heat_maps(study: Study, name: str) -> HeatMaps:
    """Return the settings that the table and the heat maps of a sweep depend on."""
    sweep = study.sweeps[name]
    return HeatMaps(
        name,
        sweep.title or name,
        {case: study.cases[case].title for case in sweep.cases},
        study.identifiers,
        _shown(study, sweep.rows),
        _shown(study, sweep.columns),
        study.near_noise_tolerance,
        tuple(key for key in study.reconstructed if key.split(".")[0] == "gripper"),
    )


def _shown(study: Study, axis: AxisBlock) -> ShownAxis:
    keys = {f"{key}." for value in axis.levels for key in value.overrides}
    reconstructed = tuple(f"{name}." for name in study.reconstructed)
    title = axis.title + ", reconstructed" * any(key.startswith(reconstructed) for key in keys)
    return ShownAxis(title, {value.text: value.shown for value in axis.levels})


def read_points(path: Path, sweep: str, case: str) -> pd.DataFrame:
    """Read the judged points of a case in a sweep."""
    found = POINTS.read(path)
    return found[found["point"].str.startswith(f"{case}--{sweep}--")]


def headlines_of(points: pd.DataFrame) -> list[str]:
    """Return the best and the worst determined quantity of a case, see `headlines`."""
    first = points[points["method"] == points["method"].iloc[0]]
    pairs = zip(first["quantity"], first["bound_percent"].astype(float), strict=True)
    return headlines(list(pairs))
