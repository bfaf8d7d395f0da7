"""How a figure declares itself."""

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
    sheet: str = "",
    when: Callable[[Study], bool] = lambda _: True,
    weight: Weight | None = None,
) -> Product:
    """Declare a figure of the study, or of each of its cases.

    Parameters
    ----------
    draw
        Draws it from its settings and, by keyword, from the files of `reads`.
    name
        Its name.
    file
        Name of its file, if that is another; of a case's figure, the case follows.
    caption
        What the report says of it.
    settings
        From the study; for a case's figure, from the study and the case (of a sweep, likewise).
    reads
        Files that it is made from.
    cases
        Which cases have one; if that is not given there is one for the study.
    sweeps
        Whether there is one for each sweep instead.
    sheet
        Figures of a sheet are drawn by one job.
    when
        Whether a study has it.
    weight
        How heavy its job is, if not as most.
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
        sheet=sheet,
        category="Figures",
        item=file or name,
        caption=caption,
    )
