import shutil
from pathlib import Path

import pytest


@pytest.fixture
def tiny_copy(tiny: Path, tmp_path: Path) -> Path:
    """The tiny study to be changed, file times kept."""
    return shutil.copytree(tiny, tmp_path / "study")
