"""Declaration of figures as products."""

from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from biogrip.figures.style import save, styled
from biogrip.products.declared import shown
from biogrip.products.product import EVALUATION, FIGURE_KINDS, LIGHT, Product


def drawing(
    draw: Callable[..., Figure], *, name: str = "", file: str = "", **declared: Any
) -> Product:
    """Declare a figure of the study, or of each of its cases or sweeps.

    A function draws it from what it uses and, by keyword, the files of `reads`. Its name is by
    default that of its module, and that of the file the same. What else can be declared is said by
    `biogrip.products.declared.shown`.
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
