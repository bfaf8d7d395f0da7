"""The results that are committed: renewed from a fresh run, and nothing else in their folder."""

import os
import shutil
from fnmatch import fnmatch
from pathlib import Path

from biogrip.errors import BiogripError
from biogrip.files import write_text
from biogrip.products.product import FIGURE_KINDS, PUBLISHED_TABLE_KINDS
from biogrip.running.journal import sha256_of
from biogrip.running.manifest import set_aside

SUMS = "SHA256SUMS"
"""Names of what was published and its hashes; ``sha256sum --check`` reads it."""

FOLDERS = {"tables": PUBLISHED_TABLE_KINDS, "figures": FIGURE_KINDS}


def publish(results: Path, published: Path, only: str = "*") -> str:
    """Replace published tables and figures by those of a finished study.

    Only what was published before, and is still as it was, is replaced or removed.

    Parameters
    ----------
    results
        Results of the study.
    published
        Folder to publish in.
    only
        Which of them, as a pattern of their names without ending.

    Returns
    -------
    str
        What was done.

    Raises
    ------
    BiogripError
        If there is nothing to publish, or a file in the way that was not published.
    """
    new = [
        file.relative_to(results)
        for folder, kinds in FOLDERS.items()
        for file in sorted((results / folder).glob("*.*"))
        if file.suffix in kinds and fnmatch(file.stem, only)
    ]
    if not new:
        raise BiogripError(f"{results}: holds no tables and figures to publish.")
    old = _sums(published / SUMS)
    for name in new:
        if os.path.lexists(published / name) and str(name) not in old:
            raise BiogripError(
                f"{published / name}: in the way, and not in {SUMS}. Move it away and try again."
            )
    for known, digest in old.items():
        file = published / known
        if os.path.lexists(file):
            if file.is_symlink() or sha256_of(file) != digest:
                set_aside(file)
            else:
                file.unlink()
    sums = []
    for name in new:
        (published / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(results / name, published / name)
        sums.append(f"{sha256_of(published / name)}  {name}\n")
    write_text(published / SUMS, "".join(sums))
    return f"{len(new)} files published in {published}."


def _sums(path: Path) -> dict[str, str]:
    if not path.exists():
        return {}
    lines = (line.split("  ", 1) for line in path.read_text(encoding="utf-8").splitlines())
    return {name: digest for digest, name in lines}
