"""Declaration of tables as products."""

from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Any

from biogrip.products.declared import shown
from biogrip.products.product import TABLE_KINDS, Product
from biogrip.products.tables.layout import Table, write


def table(
    make: Callable[..., Table], *, name: str, stem: str = "results/tables/{name}", **declared: Any
) -> Product:
    """Declare a table of the study, or of each of its cases or sweeps.

    Parameters
    ----------
    make
        Function that makes the table from what it uses and, by keyword, the files of `reads`.
    name
        Name of the product.
    stem
        Path without suffix.
    declared
        What else `biogrip.products.declared.shown` takes.
    """

    @wraps(make)
    def written(given: object, *, csv: Path, **files: Any) -> None:
        inputs = {key: file for key, file in files.items() if f".{key}" not in TABLE_KINDS}
        write(make(given, **inputs), csv)

    return shown(written, "Tables", TABLE_KINDS, stem.format(name=name), name=name, **declared)
