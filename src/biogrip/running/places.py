"""Refuses to write where something else is in the place of a folder, or behind a link."""

import os
from collections.abc import Iterable
from pathlib import Path

from biogrip.errors import BiogripError


def refuse_links(folder: Path, places: Iterable[Path]) -> None:
    """Refuse places in a folder, and the folder itself, if they or what is above are links.

    Raises
    ------
    BiogripError
        Names the first link.
    """
    inside = {folder}
    for place in places:
        inside.update((place, *place.parents))
    for place in sorted(inside):
        if (place == folder or folder in place.parents) and place.is_symlink():
            raise BiogripError(
                f"{place}: is a link, and nothing is written, replaced or removed through links. "
                "Put a folder or nothing in its place; a study elsewhere is run with --directory."
            )


def refuse_files_as_folders(folder: Path, files: Iterable[Path]) -> None:
    """Refuse files that are in the place of a folder which files are written to.

    Raises
    ------
    BiogripError
        Names the first.
    """
    above = {parent for file in files for parent in file.parents}
    for place in sorted(place for place in above if place == folder or folder in place.parents):
        refuse_other_than_folder(place)


def refuse_other_than_folder(place: Path) -> None:
    """Refuse what is in the place of a folder of biogrip's.

    Raises
    ------
    BiogripError
        If it is a link, or anything but a folder.
    """
    if os.path.lexists(place) and (place.is_symlink() or not place.is_dir()):
        found = "a link" if place.is_symlink() else "a file"
        raise BiogripError(
            f"{place}: found {found}, allowed is a folder or nothing. Nothing was touched. "
            "Move it away and try again."
        )
