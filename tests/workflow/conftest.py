import shutil
from pathlib import Path

import pytest

from tests.helpers.places import ROOT as ROOT


@pytest.fixture
def finished_copy(finished: Path, tmp_path: Path) -> Path:
    """The finished study to be changed, file times kept."""
    return shutil.copytree(finished, tmp_path / "study")


@pytest.fixture
def tiny_copy(tiny: Path, tmp_path: Path) -> Path:
    """The study of two seeds to be changed, file times kept."""
    return shutil.copytree(tiny, tmp_path / "study")
