"""What is said of any linear sample: status, text, table, page and notebook."""

from csv import DictReader
from pathlib import Path

import numpy as np
import pytest

from biogrip.library import TraceResult
from tests.helpers.identified import identify, told, write_trace

SECONDS = np.geomspace(0.1, 100.0, 150)
# Three springs that forget at their own times beside a fourth that does not.
SOFTENING = 50 + sum(
    stiff * np.exp(-SECONDS / forgets) for stiff, forgets in ((60, 0.5), (40, 5.0), (30, 50.0))
)
SCATTER = 0.2 * np.random.default_rng(4).standard_normal(len(SECONDS))
# Contact is lost, and found again.
LOST = SOFTENING - 40 * ((SECONDS > 10) & (SECONDS < 50))
AT_3_S = 50 + 60 * np.exp(-6) + 40 * np.exp(-0.6) + 30 * np.exp(-0.06)
RELAXATION = {"reads": "modulus", "model": "zener_maxwell"}


@pytest.fixture(scope="module")
def inadequate() -> TraceResult:
    return told(SECONDS, SOFTENING + SCATTER, **RELAXATION)


def test_a_rejected_model_is_told_from_what_no_linear_sample_does(inadequate: TraceResult) -> None:
    """Noise of 0.2 Pa, of which a second difference tells the scatter to a tenth."""
    text = str(inadequate)
    assert inadequate.status == "rejected"
    _, found, rest = text.partition("linear sample of another kind fits to ")
    assert found
    assert float(rest.split(" ")[0]) == pytest.approx(1.0, abs=0.2)
    assert inadequate.data["without_model"]["is_linear"]
    # First what holds, then what does not.
    assert text.index("Any linear sample that fits, whatever its model") < text.index("limits:")
    hopeless = told(SECONDS, LOST + SCATTER, **RELAXATION)
    assert hopeless.status == "rejected"
    assert "no linear sample gives this trace under this protocol" in str(hopeless)
    assert "No linear sample fits, whatever its model" in str(hopeless)
    assert hopeless.data["without_model"]["quantities"] == []


def test_five_lines_follow_a_model_that_fits() -> None:
    fitted = told(SECONDS, 50 + 60 * np.exp(-SECONDS / 5) + SCATTER, **RELAXATION)
    assert fitted.status == "ok"
    lines = str(fitted).splitlines()
    start = next(n for n, line in enumerate(lines) if line.startswith("Any linear sample"))
    assert start > next(n for n, line in enumerate(lines) if "limits:" in line)
    names = [line.split("  ")[1] for line in lines[start + 1 : start + 6]]
    assert names == ["G(0.1 s)", "G(10 s)", "G(100 s)", "exponent(10 s)", "G''(0.1 rad/s)"]
    assert not lines[start + 6].startswith("  ")


def test_table_and_page_have_it(tmp_path: Path) -> None:
    trace = tmp_path / "a.csv"
    write_trace(trace, SECONDS, SOFTENING + SCATTER, header="time_s,modulus_Pa")
    files = "--csv", tmp_path / "found.csv", "--report", tmp_path / "page.html"
    given = ["--reading", "modulus=modulus_Pa", "--model", "zener_maxwell"]
    given += ["--set", "model_selection.models=[maxwell]"]
    status, _, complained = identify(trace, *files, *given, "--at", "3,30")
    assert status == 0, complained
    with (tmp_path / "found.csv").open() as stream:
        (row,) = DictReader(stream)
    assert row["fit"] == "rejected"
    assert row["linear"] == "yes"
    assert float(row["G(3 s) low (Pa)"]) < AT_3_S < float(row["G(3 s) high (Pa)"])
    assert row["exponent(3 s) verdict"] == "determined"
    assert "tan delta(0.333 rad/s) value" in row
    page = (tmp_path / "page.html").read_text()
    assert page.index("Whatever the model") < page.index("Quantity</th>")
    assert page.count("limits over all linear samples") == 1
