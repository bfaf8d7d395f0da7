"""The notebook as it is run from top to bottom; as a program, it keeps what is put out."""

import os
from pathlib import Path
from tempfile import TemporaryDirectory

import nbformat
import pytest
from nbclient import NotebookClient

from tests.helpers.places import ROOT

NOTEBOOK = ROOT / "docs" / "notebook.ipynb"


def read() -> nbformat.NotebookNode:
    """The notebook as it is committed."""
    return nbformat.read(NOTEBOOK, as_version=4)  # type: ignore[no-untyped-call]


def executed(folder: Path) -> nbformat.NotebookNode:
    """Run the notebook in a folder, and leave out what is of this run alone."""
    notebook = read()
    client = NotebookClient(notebook, timeout=300, kernel_name="python3", record_timing=False)
    with pytest.MonkeyPatch.context() as patch:
        # Neither does a kernel belong to the user, nor what it keeps.
        patch.setenv("IPYTHONDIR", str(folder))
        patch.setenv("JUPYTER_RUNTIME_DIR", str(folder))
        client.execute(cwd=os.fspath(folder))
    # The version of Python.
    notebook.metadata.language_info = {"name": "python"}
    return notebook


if __name__ == "__main__":
    with TemporaryDirectory() as place:
        nbformat.write(executed(Path(place)), NOTEBOOK)  # type: ignore[no-untyped-call]
