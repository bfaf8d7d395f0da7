"""Declaration of tables as products."""

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
    rule: str = "",
    when: Callable[[Study], bool] = lambda _: True,
    weight: Weight = LIGHT,
    stem: str = "results/tables/{name}",
) -> Product:
    """Declare a table of the study, or of each of its cases.

    Parameters
    ----------
    make
        Function that makes the table from its settings and, by keyword, the files of `reads`.
    name
        Name of the product; the case's name is appended for files.
    caption, item
        Caption and place in the report.
    settings
        Function of the study, of study and case, or of study and sweep.
    reads
        Input files.
    cases
        Names of the cases that have the table; if not given, there is one for the study.
    sweeps
        If true, there is one table for each sweep.
    rule
        Name of a group of tables that one job makes.
    when
        Condition for a study to have the table.
    weight
        Resources of the job.
    stem
        Path without suffix.
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
        rule=rule,
        category="Tables",
        item=item,
        caption=caption,
    )
