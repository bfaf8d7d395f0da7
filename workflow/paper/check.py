"""Compare the tables of a study with those that are published in this repository."""

from difflib import unified_diff
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

from biogrip.digits import counted
from biogrip.errors import BiogripError
from biogrip_study.stages.job import logged, paths
from biogrip_study.tables.layout import as_published

if TYPE_CHECKING:
    snakemake: Any

_MOST_LINES = 40


def compare(published: Path, made: list[Path]) -> None:
    """Compare tables, CSV and HTML, with those that are published, and print how many agree.

    It is an error, which shows the lines that differ, if one has other bytes or is not published.
    """
    if not made:
        raise BiogripError(f"{published}: holds no tables to compare with.")
    differing: list[str] = []
    for table in made:
        name, now = as_published(table)
        before = published / name
        if not before.exists():
            differing.append(f"{name}: is not published.")
        elif before.read_bytes() != now.encode():
            old = before.read_text(encoding="utf-8").splitlines()
            differing += unified_diff(
                old, now.splitlines(), str(before), str(table), n=0, lineterm=""
            )
    if differing:
        shown = "\n".join(islice(differing, _MOST_LINES))
        raise BiogripError(f"the regenerated tables differ from {published}.\n{shown}")
    print(f"{counted(len(made), 'file')} of tables compared with {published}: the same bytes.")


if __name__ == "__main__":
    with logged(snakemake):
        compare(Path(snakemake.params.published), paths(snakemake.input.made))
