"""Checks of output files, so that files of others are not overwritten."""

import json
import os
import re
from pathlib import Path
from typing import Any

from biogrip.errors import BiogripError
from biogrip.files import scratch_path
from biogrip.physics.instruments import Quantity
from biogrip.terminal import visible

WRITTEN_BY = "written_by_biogrip"
"""Mark in every file that biogrip writes; files without it are not replaced."""

_HEAD_BYTES = 500
_LONGEST = 100_000


def check_output(output: Path, *, force: bool) -> None:
    """Refuse an output that cannot be written, or that biogrip did not write.

    Parameters
    ----------
    output
        The file.
    force
        If true, replace even a file that biogrip did not write.

    Raises
    ------
    BiogripError
        If the file cannot be written or must not be replaced.
    """
    folder = output.parent
    if os.path.isdir(output) or not os.path.isdir(folder) or not os.access(folder, os.W_OK):
        raise BiogripError(
            f"{visible(output)}: cannot be written; allowed is a file in a folder that you "
            "may write to."
        )
    for place in (output, scratch_path(output)):
        try:
            os.lstat(place)
        except FileNotFoundError:
            continue
        except OSError as error:
            raise BiogripError(
                f"{visible(output)}: cannot be written: {error.strerror}."
            ) from error
    if os.path.exists(output) and not output.is_symlink() and not output.is_file():
        raise BiogripError(f"{visible(output)}: is no regular file; allowed is one.")
    if os.path.lexists(output) and not force and not _is_ours(output):
        raise BiogripError(
            f"{visible(output)}: is there, and biogrip did not write it; allowed is another name, "
            "or --force to replace it."
        )


def _is_ours(output: Path) -> bool:
    if output.is_symlink():
        return False
    try:
        if output.suffix == ".json":
            return WRITTEN_BY in json.loads(output.read_bytes())
        with output.open("rb") as stream:
            # The mark is in the header of a table, however long, and in the first lines of a page.
            head = (
                stream.readline(_LONGEST) if output.suffix == ".csv" else stream.read(_HEAD_BYTES)
            )
            return WRITTEN_BY.encode() in head
    except (OSError, ValueError, TypeError, RecursionError):
        return False


_RADIANS = re.compile("_rad(?=$|_per_s$)")


def in_own_units(data: Any, read: Quantity) -> Any:
    """Return data whose keys end with the unit of what is read, instead of radians."""
    if isinstance(data, list):
        return [in_own_units(each, read) for each in data]
    if not isinstance(data, dict):
        return data
    return {name_in_units(key, read): in_own_units(each, read) for key, each in data.items()}


def name_in_units(name: str, read: Quantity) -> str:
    """Return a name of a key or column that ends with the unit of what is read."""
    return _RADIANS.sub(read.suffix, name)
