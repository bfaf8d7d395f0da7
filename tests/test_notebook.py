"""The notebook: shows what it puts out when it is run from top to bottom."""

import re
from base64 import b64decode
from copy import deepcopy
from io import BytesIO

import numpy as np
import pytest
from matplotlib.image import imread
from nbformat import NotebookNode

from biogrip import library
from tests.helpers.notebook import NOTEBOOK, executed, read
from tests.products.figures.test_pinned import TOLERANCE, VERSION, VERSION_FILE


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> NotebookNode:
    return executed(tmp_path_factory.mktemp("notebook"))


def outputs(notebook: NotebookNode) -> list[NotebookNode]:
    return [output for cell in notebook.cells for output in cell.get("outputs", [])]


def without_pictures(notebook: NotebookNode) -> list[dict[str, object]]:
    cells = deepcopy(notebook.cells)
    for output in (output for cell in cells for output in cell.get("outputs", [])):
        output.get("data", {}).pop("image/png", None)
    return [dict(cell) for cell in cells]


def test_it_is_committed_with_what_it_puts_out(run: NotebookNode) -> None:
    """If this fails: make notebook."""
    assert without_pictures(read()) == without_pictures(run)
    kept, drawn = ([o.data["image/png"] for o in outputs(n) if "data" in o] for n in (read(), run))
    assert len(kept) == len(drawn) == 1
    if VERSION_FILE.read_text().strip() == VERSION:
        first, second = (imread(BytesIO(b64decode(text[0]))) for text in (kept, drawn))
        assert 255 * np.sqrt(np.mean((first - second) ** 2)) < TOLERANCE


def test_it_says_what_a_trace_tells(run: NotebookNode) -> None:
    said = "".join(output.text for output in outputs(run) if output.output_type == "stream")
    assert re.search(r"^k_p +determined: 5\.", said, re.MULTILINE)
    assert re.search(r"^c_p +only bounded above", said, re.MULTILINE)


def test_it_uses_the_library_and_nothing_below() -> None:
    text = NOTEBOOK.read_text(encoding="utf-8")
    assert set(re.findall(r"biogrip\.(\w+)\(", text)) <= set(library.__all__)
    assert "from biogrip" not in text
