import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.errors import BiogripError
from biogrip.library import TraceResult
from tests.helpers.identified import told, write_trace

SINCE = np.linspace(0.05, 20, 400)
NOISY = 500 + 300 * np.exp(-SINCE / 2) + np.random.default_rng(1).normal(0, 5, len(SINCE))


def modulus(times: Array, values: Array, model: str, *models: str, **given: Any) -> TraceResult:
    return told(times, values, models, reads="modulus", model=model, **given)


def test_what_tells_nothing_is_refused_in_one_message() -> None:
    for times, values, model, said in (
        (SINCE[:10], NOISY[:10], "generalized_maxwell_5", "found 10 readings for 12 unknown"),
        (SINCE[:3], NOISY[:3], "kelvin_voigt", "found 3 rows with a number"),
        (SINCE, np.full(400, 1.0), "zener_maxwell", "but 1 Pa throughout"),
        (SINCE, np.zeros(400), "zener_maxwell", "but 0 Pa throughout"),
        (1e-12 * SINCE, NOISY, "zener_maxwell", "Is the unit of time right?"),
        (1e12 * SINCE, NOISY, "zener_maxwell", "Is the unit of time right?"),
    ):
        with pytest.raises(BiogripError) as error:
            modulus(times, values, model)
        assert said in str(error.value)
        assert "\n" not in str(error.value)


# Without noise, in another unit, and very many.
ODD = [
    (SINCE[::10], 500 + 300 * np.exp(-SINCE[::10] / 2)),
    (SINCE, 1e-12 * NOISY),
    (np.linspace(1e-4, 20, 200_000), 500 + np.random.default_rng(1).normal(0, 5, 200_000)),
]


@pytest.mark.parametrize(
    ("times", "values", "cut"),
    [
        (SINCE[::40], NOISY[::40], []),
        (SINCE, NOISY.clip(510, 600), ["largest, 600 Pa", "smallest, 510 Pa"]),
        (SINCE, NOISY.round(-1), []),
        *(pytest.param(*each, [], marks=pytest.mark.nightly) for each in ODD),
    ],
)
@pytest.mark.filterwarnings("error")
def test_strange_readings_are_answered_and_saturated_ones_told(
    times: Array, values: Array, cut: list[str]
) -> None:
    richer = ["zener_maxwell", "generalized_maxwell_5"] if len(times) == 10 else []
    found = modulus(times, values, "zener_maxwell", *richer)
    said = [text for text in map(str, found.data["notes"]) if "saturated" in text]
    assert len(said) == len(cut)
    assert all(f"exactly the {each}" in text for each, text in zip(cut, said, strict=True))
    assert "generalized_maxwell_5" not in str(found.data["models"])


def test_readings_that_are_averaged_or_left_out_are_counted() -> None:
    clock = np.floor(SINCE)[20:]
    config = {"measurement": {"average_repeated": True, "until_s": 15}}
    found = modulus(clock, NOISY[20:], "zener_maxwell", config=config)
    for text in (
        f"Averaged at repeated times: {np.sum(clock <= 15)} readings.",
        f"Left out by from_s and until_s: {np.sum(clock > 15)} readings.",
    ):
        assert {"weight": "harmless", "text": text} in found.data["notes"]
    assert found.data["samples"] == 15


@pytest.mark.nightly
def test_what_lies_in_the_folder_and_a_name_of_marks_change_no_result(tmp_path: Path) -> None:
    told, named = [], "a$x$ \\frac{$ %#&<b>_\x1b[31m\n.csv"
    for folder in (tmp_path / "empty", tmp_path / "theirs"):
        folder.mkdir()
        write_trace(folder / named, SINCE, NOISY, header="time_s,modulus_Pa")
        (folder / "sheet.csv").write_text(f'file,dose <b> &\n"{named}",<b>$\\frac{{$\n')
        if folder.name == "theirs":
            (folder / "matplotlibrc").write_text("text.usetex: True\ntext.color: red\n")
            for name in ("yaml", "numpy", "signal"):
                (folder / f"{name}.py").write_text("raise SystemExit(1)\n")
        command = [str(Path(sys.executable).with_name("biogrip")), "identify", "sheet.csv"]
        given = ["--reading", "modulus=modulus_Pa", "--csv", "o.csv", "--report", "o.html"]
        said = subprocess.run([*command, *given], cwd=folder, check=True, capture_output=True)
        assert b"\x1b" not in said.stdout + said.stderr
        told.append((said.stdout, *((folder / f"o.{end}").read_bytes() for end in ("csv", "html"))))
    assert told[0] == told[1]
    assert b"<b>" not in told[0][2]
    assert b"\x1b" not in told[0][2]
