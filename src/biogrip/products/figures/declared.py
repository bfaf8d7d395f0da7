"""Declaration of figures as products."""

from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from biogrip.products.declared import shown
from biogrip.products.figures.style import save, styled
from biogrip.products.product import EVALUATION, FIGURE_KINDS, LIGHT, Product


def drawing(
    draw: Callable[..., Figure], *, name: str = "", file: str = "", **declared: Any
) -> Product:
    """Declare a figure of the study, or of each of its cases or sweeps.

    Parameters
    ----------
    draw
        Function that draws the figure from what it uses and, by keyword, from the files of `reads`.
    name
        Name of the product; by default that of its module.
    file
        Name of the file, if it differs from `name`.
    declared
        What else `biogrip.products.declared.shown` takes.
    """

    @wraps(draw)
    def saved(given: object, *, png: Path, pdf: Path, **files: Any) -> None:
        with styled():
            save(draw(given, **files), png)

    name = name or draw.__module__.rpartition(".")[2]
    file = file or name
    usual: dict[str, Any] = {"item": file, "weight": EVALUATION if "cases" in declared else LIGHT}
    return shown(
        saved, "Figures", FIGURE_KINDS, f"results/figures/{file}", name=name, **usual | declared
    )
