"""The command ``biogrip clean``."""

from pathlib import Path

from biogrip.digits import counted
from biogrip.errors import BiogripError
from biogrip.running.journal import JOURNALS
from biogrip.running.locks import is_locked, is_locked_by_dead
from biogrip.running.manifest import Manifest


def clean(results: Path) -> str:
    """Remove the files that a study wrote, and folders that are then empty.

    Parameters
    ----------
    results
        Results folder, below the folder that Snakemake ran in.

    Returns
    -------
    str
        Summary of what was removed and kept.

    Raises
    ------
    BiogripError
        If a run is active, or the record is invalid. Nothing is removed then.
    """
    if results.is_symlink():
        raise BiogripError(f"{results}: is a link, and nothing is removed through links.")
    folder = results.absolute()
    manifest = Manifest(results)
    snakemake = folder.parent / ".snakemake"
    locked = is_locked(snakemake) and not is_locked_by_dead(snakemake)
    if locked or manifest.is_written_to:
        raise BiogripError(
            f"{results}: a run is going on, or was killed on another computer; allowed is to clean "
            "after its end. Its locks are taken away by snakemake --unlock."
        )
    written: list[Path] = []
    left: list[Path] = []
    for path in manifest.paths:
        file = results / path
        if file.is_file() and not file.is_symlink():
            (written if manifest.was_written(path) else left).append(file)
    for file in written:
        file.unlink()
    manifest.discard()
    folders = {parent for path in manifest.paths for parent in (results / path).parents}
    folders &= {results, *(folder for folder in folders if results in folder.parents)}
    for place in sorted({*folders, results / JOURNALS}, key=lambda f: -len(f.parts)):
        if place.absolute() != Path.cwd() and place.is_dir() and not any(place.iterdir()):
            place.rmdir()
    kept = f" Kept, as they were edited: {', '.join(map(str, left))}." if left else ""
    return f"{counted(len(written), 'file')} of {results} removed.{kept}"
