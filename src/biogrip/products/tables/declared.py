"""How a table declares itself."""

from collections.abc import Callable, Iterable, Mapping
from functools import partial, wraps
from pathlib import Path
from typing import Any

from biogrip.products.product import LIGHT, TABLE_KINDS, Product, Reads, Scope, Weight
from biogrip.products.tables.layout import Table, write
from biogrip.study.study import Study


def table(
    make: Callable[..., Table],
    *,
    name: str,
    caption: str,
    item: str,
    settings: Callable[..., object],
    reads: Mapping[str, Reads] | None = None,
    cases: Callable[[Study], Iterable[str]] | None = None,
    sweeps: bool = False,
    sheet: str = "",
    when: Callable[[Study], bool] = lambda _: True,
    weight: Weight = LIGHT,
    stem: str = "results/tables/{name}",
) -> Product:
    """Declare a table of the study, or of each of its cases.

    Parameters
    ----------
    make
        Makes it from its settings and, by keyword, from the files of `reads`.
    name
        Its name; of a case's table, the case follows in the file.
    caption, item
        What the report says of it.
    settings
        From the study; for a case's table, from the study and the case (of a sweep, likewise).
    reads
        Files that it is made from.
    cases
        Which cases have one; if that is not given there is one for the study.
    sweeps
        Whether there is one for each sweep instead.
    sheet
        Tables of a sheet are made by one job.
    when
        Whether a study has it.
    weight
        How heavy its job is.
    stem
        Path but for the ending.
    """
    scope = Scope(cases, sweeps, when)
    whose = scope.whose
    path = stem.format(name=name) + (f"_{whose}" if whose else "")
    writes = {kind[1:]: path + kind for kind in TABLE_KINDS}

    @wraps(make)
    def written(given: object, *, csv: Path, **files: Any) -> None:
        inputs = {key: file for key, file in files.items() if key not in writes}
        write(make(given, **inputs), csv)

    return Product(
        name,
        writes,
        written,
        partial(scope.settings, settings),
        scope.jobs,
        message=f"Writing the table {name}" + (f" of {whose}" if whose else ""),
        reads=reads or {},
        weight=weight,
        sheet=sheet,
        category="Tables",
        item=item,
        caption=caption,
    )
