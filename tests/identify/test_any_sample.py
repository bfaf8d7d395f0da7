"""What is said of any linear sample: status, text, table, page and notebook."""

import re
from csv import DictReader
from pathlib import Path

import numpy as np
import pytest

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


def test_a_rejected_model_is_told_from_what_no_linear_sample_does() -> None:
    """Noise of 0.2 Pa, of which a second difference tells the scatter to a tenth."""
    found, hopeless = (told(SECONDS, own + SCATTER, **RELAXATION) for own in (SOFTENING, LOST))
    assert (found.status, hopeless.status) == ("rejected", "rejected")
    (times,) = re.findall(r"linear sample of another kind fits to (\S+) ", text := str(found))
    assert float(times.replace("the", "1")) == pytest.approx(1.0, abs=0.2)
    assert found.data["without_model"]["is_linear"]
    # First what holds, then what does not.
    assert text.index("Model-free, any linear viscoelastic sample") < text.index("limits:")
    assert "no linear sample gives this trace under this protocol" in str(hopeless)
    assert "no linear viscoelastic sample fits" in str(hopeless)
    assert hopeless.data["without_model"]["quantities"] == []


def test_a_sample_that_fits_no_better_is_no_other_kind() -> None:
    values = 50 + 60 * np.exp(-SECONDS / 5) + SCATTER
    text = str(told(SECONDS, values, noise=0.02, **RELAXATION))
    assert re.search(r"single readings are far off, the furthest at \S+ s, as no linear", text)
    assert "of another kind" not in text


def test_five_lines_follow_a_model_that_fits() -> None:
    fitted = told(SECONDS, 50 + 60 * np.exp(-SECONDS / 5) + SCATTER, **RELAXATION)
    assert fitted.status == "ok"
    _, limits, said = str(fitted).partition("limits:")
    _, ours, rest = said.partition("Model-free")
    assert limits
    assert ours
    names = [line.split("  ")[1] for line in rest.splitlines()[1:] if line.startswith("  ")]
    assert names == ["G(0.1 s)", "G(10 s)", "G(100 s)", "exponent(10 s)", "G''(0.1 rad/s)"]


def test_table_and_page_have_it(tmp_path: Path, few: Path) -> None:
    trace, page = tmp_path / "a.csv", tmp_path / "page.html"
    write_trace(trace, SECONDS, SOFTENING + SCATTER, header="time_s,modulus_Pa")
    given = ["--reading", "modulus", "--model", "zener_maxwell", "--at", "3,30"]
    given += ["--csv", str(tmp_path / "found.csv"), "--report", str(page), "--config", str(few)]
    status, _, complained = identify(trace, *given, "--set", "model_selection.models=[]")
    assert status == 0, complained
    (row,) = DictReader((tmp_path / "found.csv").read_text().splitlines())
    assert (row["fit"], row["linear"]) == ("rejected", "yes")
    assert float(row["G(3 s) low (Pa)"]) < AT_3_S < float(row["G(3 s) high (Pa)"])
    assert row["exponent(3 s) verdict"] == "determined"
    assert "tan delta(0.333 rad/s) value" in row
    assert page.read_text().index("Model-free") < page.read_text().index("Quantity</th>")
