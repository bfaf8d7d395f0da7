"""Stage 5: a figure, by name."""

from importlib import import_module
from pathlib import Path
from typing import Any

from biogrip.errors import BiogripError, nearest

MODULES = (
    *("overview", "torque", "linkage", "comb"),
    *("convergence", "fit", "evolution", "linearisation"),
    *("waterfall", "scatter", "profiles", "valley"),
    "robustness",
)
"""Each module draws the figure of its name in its function ``draw``."""


def run(name: str, settings: dict[str, Any], inputs: list[Path], output: Path) -> None:
    """Draw a figure and write it as `output` (PNG), with a PDF beside it.

    Raises
    ------
    BiogripError
        If there is no such figure, or an input cannot be read.
    """
    if name not in MODULES:
        allowed = ", ".join(MODULES)
        raise BiogripError(f"no figure '{name}'.{nearest(name, MODULES)} Allowed: {allowed}.")
    from biogrip.figures.style import save, styled

    with styled():
        save(import_module(f"biogrip.figures.{name}").draw(settings, inputs), output)
