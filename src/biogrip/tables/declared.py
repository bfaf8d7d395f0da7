"""Declaration of tables as products."""

from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Any

from biogrip.products.declared import shown
from biogrip.products.product import TABLE_KINDS, Product
from biogrip.tables.layout import Table, write


def table(
    make: Callable[..., Table], *, name: str = "", stem: str = "", **declared: Any
) -> Product:
    """Declare a table of the study, or of each of its cases or sweeps.

    A function makes it from what it uses and, by keyword, the files of `reads`. Its name is by
    default that of its module, and its path without suffix the name in ``results/tables/``. What
    else can be declared is said by `biogrip.products.declared.shown`.
    """

    @wraps(make)
    def written(given: object, *, csv: Path, **files: Any) -> None:
        inputs = {key: file for key, file in files.items() if f".{key}" not in TABLE_KINDS}
        write(make(given, **inputs), csv)

    name = name or make.__module__.rpartition(".")[2]
    stem, usual = stem or f"results/tables/{name}", {"item": name.replace("_", " ")}
    return shown(written, "Tables", TABLE_KINDS, stem, name=name, **usual | declared)
