"""Settings and inputs shared by the table and the heat maps of a sweep."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from biogrip.errors import BiogripError
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


def _shown(study: Study, axis: AxisBlock) -> ShownAxis:
    keys = {key for value in axis.levels for key in value.overrides}
    title = axis.title + ", reconstructed" * any(map(study.is_reconstructed, keys))
    return ShownAxis(title, {value.text: value.shown for value in axis.levels})


"""The input files with judged points, one per case of the job's sweep."""


def read_points(paths: list[Path], case: str) -> pd.DataFrame:
    """Read the judged points of a case."""
    for path in paths:
        if path.stem == case:
            return POINTS.read(path)
    raise BiogripError(f"{case}: no file of its points is given.")


def headlines_of(points: pd.DataFrame) -> list[str]:
    """Return the best and the worst determined quantity of a case, see `headlines`."""
    first = points[points["method"] == points["method"].iloc[0]]
    pairs = zip(first["quantity"], first["bound_percent"].astype(float), strict=True)
    return headlines(list(pairs))


CAPTION = (
    "How well every case is identified from point to point of the sweep. First the share of seeds "
    "that end in the basin of the truth: within a factor of two of it, or four times the bound if "
    "that is more, in both quantities below. Then, for the best and for the worst determined "
    "quantity, the median absolute error of these seeds, beside the standard deviation that noise "
    "leaves at least (the Cramer-Rao bound, to first order, rest known). A median over all seeds "
    "would jump with the share."
)
