"""Declaration of figures as products."""

from collections.abc import Callable, Iterable, Mapping
from functools import partial, wraps
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from biogrip.products.figures.style import save, styled
from biogrip.products.product import (
    EVALUATION,
    FIGURE_KINDS,
    LIGHT,
    Product,
    Reads,
    Scope,
    Weight,
)
from biogrip.study.study import Study


def drawing(
    draw: Callable[..., Figure],
    *,
    name: str,
    file: str = "",
    caption: str,
    settings: Callable[..., object],
    reads: Mapping[str, Reads] | None = None,
    cases: Callable[[Study], Iterable[str]] | None = None,
    sweeps: bool = False,
    rule: str = "",
    when: Callable[[Study], bool] = lambda _: True,
    weight: Weight | None = None,
) -> Product:
    """Declare a figure of the study, or of each of its cases.

    Parameters
    ----------
    draw
        Function that draws the figure from its settings and, by keyword, from the files of `reads`.
    name
        Name of the product.
    file
        Name of the file, if it differs from `name`; the case's name is appended.
    caption
        Caption in the report.
    settings
        Function of the study, of study and case, or of study and sweep.
    reads
        Input files.
    cases
        Names of the cases that have the figure; if not given, there is one for the study.
    sweeps
        If true, there is one figure for each sweep.
    rule
        Name of a group of figures that one job draws.
    when
        Condition for a study to have the figure.
    weight
        Resources of the job, if not the default.
    """
    scope = Scope(cases, sweeps, when)
    whose = scope.whose
    path = f"results/figures/{file or name}" + (f"_{whose}" if whose else "")

    @wraps(draw)
    def saved(given: object, *, png: Path, pdf: Path, **files: Any) -> None:
        with styled():
            save(draw(given, **files), png)

    return Product(
        name,
        {kind[1:]: path + kind for kind in FIGURE_KINDS},
        saved,
        partial(scope.settings, settings),
        scope.jobs,
        message=f"Drawing {name}" + (f" of {whose}" if whose else ""),
        reads=reads or {},
        weight=weight or (EVALUATION if cases else LIGHT),
        rule=rule,
        category="Figures",
        item=file or name,
        caption=caption,
    )
