"""Put tables and figures in the place of those that are published."""

import shutil
from pathlib import Path

from biogrip.errors import BiogripError
from biogrip.stages.job import logged, paths

with logged(snakemake):
    published = Path(snakemake.params.published)
    if not snakemake.input:
        raise BiogripError(f"{published}: holds nothing in whose place to put tables or figures.")
    for file in paths(snakemake.input):
        shutil.copy(file, published / file.parent.name / file.name)
