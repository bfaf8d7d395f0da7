"""The resolved study in ``study.json``: all configs merged, read by the jobs."""

import json
import os
from pathlib import Path

from biogrip.errors import BiogripError
from biogrip.files import write_text
from biogrip.running.journal import recorded_in
from biogrip.running.manifest import STUDY, Manifest
from biogrip.running.wholeness import make_room
from biogrip.study.config import StudyConfig
from biogrip.study.plain import plain
from biogrip.study.study import Study


def write_study(study: Study, results: Path) -> None:
    """Write a study to its results folder, unless it is there already.

    Raises
    ------
    BiogripError
        If a file is in the way that no study wrote.
    """
    file = results / STUDY
    text = json.dumps(plain(study.config), indent=1) + "\n"
    if os.path.lexists(file):
        manifest = Manifest(results)
        if file.is_symlink() or not file.is_file() or not manifest.knows(STUDY):
            raise BiogripError(
                f"{file}: in the way, and not written by a study. Move it away and run again."
            )
        if file.read_text(encoding="utf-8", errors="replace") == text:
            return
        if not manifest.was_written(STUDY):
            make_room(manifest, results, STUDY, changing=True)
    with recorded_in(results):
        write_text(file, text)


def read_study(results: Path) -> Study:
    """Read the study whose results are in a folder.

    Raises
    ------
    BiogripError
        If no study was run there, or its file is damaged.
    """
    file = results / STUDY
    try:
        study = Study(StudyConfig.model_validate_json(file.read_bytes()))
        # Access all derived properties, so that a damaged file is reported here.
        _ = study.cases, study.points, study.sweeps, study.shown, study.study_seed
        return study
    except FileNotFoundError as error:
        raise BiogripError(
            f"{file}: there is none, as no study was run here; allowed is what a run has begun."
        ) from error
    except (OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError) as error:
        found = " ".join(repr(error).split())
        raise BiogripError(f"{file}: cannot be read as a study: {found}.") from error
