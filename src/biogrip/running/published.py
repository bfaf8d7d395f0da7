"""The command ``biogrip publish``: committed tables and figures, renewed from a finished run."""

import os
import shutil
from collections.abc import Container, Iterable
from contextlib import suppress
from pathlib import Path

from biogrip.digits import counted
from biogrip.errors import BiogripError
from biogrip.files import write_text
from biogrip.products.product import FIGURE_KINDS, PUBLISHED_TABLE_KINDS
from biogrip.running.journal import hash_file
from biogrip.running.manifest import Manifest, set_aside
from biogrip.running.places import refuse_files_as_folders, refuse_links
from biogrip.running.provenance import finished
from biogrip.running.records import read_sums
from biogrip.stopping import uninterrupted

SUMS = "SHA256SUMS"
"""File with names and hashes of all published files, in the format of ``sha256sum --check``."""

FOLDERS = {"tables": PUBLISHED_TABLE_KINDS, "figures": FIGURE_KINDS}


def publish(results: Path, published: Path, only: str = "*") -> str:
    """Replace published tables and figures by those of a finished study.

    Only unchanged published files are replaced or removed. All new files are copied beside their
    places before the first is moved into place.

    Parameters
    ----------
    results
        Results folder of the study.
    published
        Folder to publish in.
    only
        Pattern for file names without suffix.

    Returns
    -------
    str
        Summary of what was published.

    Raises
    ------
    BiogripError
        If the study is not finished, an unpublished file is in the way, or a path has a link.
        Nothing is changed then.
    """
    manifest = Manifest(results)
    new = {
        name: manifest.last(name).sha256
        for name in finished(results, manifest, only)
        if Path(name).suffix in FOLDERS.get(Path(name).parts[0], ())
    }
    if not new:
        raise BiogripError(f"{results}: holds no tables and figures to publish.")
    old = read_sums(published / SUMS)
    _check_places(published, [*new, *old], old)
    for name in old:
        # A publication that was killed may have left them.
        _beside(published / name).unlink(missing_ok=True)
    _copy(results, published, [*new])
    # Old and new hashes are recorded together, so that after a kill publishing can be repeated.
    both = [(name, digest) for name, digests in old.items() for digest in digests]
    _write_sums(published, [*both, *(item for item in new.items() if item not in both)])
    with uninterrupted():
        for name, digests in old.items():
            _clear(published / name, [*digests, new.get(name, "")], replaced=name in new)
        for name in new:
            os.replace(_beside(published / name), published / name)
        _write_sums(published, new.items())
    return f"{counted(len(new), 'file')} published in {published}."


def _check_places(published: Path, names: list[str], old: Container[str]) -> None:
    """Refuse paths through links, and paths of existing files that were not published.

    Raises
    ------
    BiogripError
        Names the first such path.
    """
    places = [published / name for name in names]
    refuse_links(published, [place.parent for place in places])
    refuse_files_as_folders(published, places)
    for name in names:
        file = published / name
        other = os.path.lexists(file) and not (file.is_file() or file.is_symlink())
        if other or (os.path.lexists(file) and name not in old):
            raise BiogripError(
                f"{file}: in the way, and not published by biogrip. Move it away and try again."
            )


def _copy(results: Path, published: Path, names: list[str]) -> None:
    """Copy files beside their final places, all or none."""
    copies = [_beside(published / name) for name in names]
    try:
        for name, copy in zip(names, copies, strict=True):
            copy.parent.mkdir(parents=True, exist_ok=True)
            copy.unlink(missing_ok=True)
            shutil.copyfile(results / name, copy)
    except OSError:
        for copy in copies:
            with suppress(OSError):
                copy.unlink(missing_ok=True)
        raise


def _clear(file: Path, digests: list[str], *, replaced: bool) -> None:
    """Set aside a file edited since it was published; remove one that is not to be replaced."""
    if os.path.lexists(file):
        if file.is_symlink() or hash_file(file) not in digests:
            set_aside(file)
        elif not replaced:
            file.unlink()


def _beside(file: Path) -> Path:
    return file.with_name(f".{file.name}.published.part")


def _write_sums(published: Path, sums: Iterable[tuple[str, str]]) -> None:
    write_text(published / SUMS, "".join(f"{digest}  {name}\n" for name, digest in sums))
