"""Put tables, figures and the page in the place of those that are published."""

import shutil
from pathlib import Path
from typing import TYPE_CHECKING, Any

from biogrip.errors import BiogripError
from biogrip.files import write_text
from biogrip_study.stages.job import logged, paths
from biogrip_study.tables.layout import as_published

if TYPE_CHECKING:
    snakemake: Any

with logged(snakemake):
    published = Path(snakemake.params.published)
    tables, figures = paths(snakemake.input.tables), paths(snakemake.input.figures)
    if not [*tables, *figures]:
        raise BiogripError(f"{published}: holds nothing in whose place to put tables or figures.")
    for table in tables:
        name, text = as_published(table)
        write_text(published / "tables" / name, text)
    for figure in figures:
        shutil.copy(figure, published / "figures" / figure.name)
    for page in paths(snakemake.input.page):
        shutil.copy(page, published / page.name)
