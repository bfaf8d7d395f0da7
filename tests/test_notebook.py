"""The notebook: runs from top to bottom, and is committed without what it put out."""

import os
import re
from pathlib import Path

import pytest
from nbclient import NotebookClient
from nbformat import NotebookNode, reads

from biogrip import library
from tests.helpers.places import ROOT

NOTEBOOK = ROOT / "docs" / "notebook.ipynb"


def test_it_is_committed_without_outputs() -> None:
    cells = _notebook().cells
    assert [c for c in cells if c.cell_type == "code" and (c.outputs or c.execution_count)] == []


def test_it_runs_and_says_what_a_trace_tells(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Neither does a kernel belong to the user, nor what it keeps.
    monkeypatch.setenv("IPYTHONDIR", str(tmp_path))
    monkeypatch.setenv("JUPYTER_RUNTIME_DIR", str(tmp_path))
    notebook = _notebook()
    NotebookClient(notebook, timeout=300, kernel_name="python3").execute(cwd=os.fspath(tmp_path))
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    said = "".join(output.text for output in outputs if output.output_type == "stream")
    assert re.search(r"^k_p +determined: 5\.", said, re.MULTILINE)
    assert re.search(r"^c_p +only bounded above", said, re.MULTILINE)
    drawn = [output for output in outputs if "image/png" in output.get("data", {})]
    assert len(drawn) == 1


def test_it_uses_the_library_and_nothing_below() -> None:
    text = NOTEBOOK.read_text(encoding="utf-8")
    assert set(re.findall(r"biogrip\.(\w+)\(", text)) <= set(library.__all__)
    assert "from biogrip" not in text


def _notebook() -> NotebookNode:
    return reads(NOTEBOOK.read_text(encoding="utf-8"), as_version=4)  # type: ignore[no-untyped-call]
