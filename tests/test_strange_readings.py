"""`biogrip identify` of few and strange readings: an answer or one message."""

from pathlib import Path

import numpy as np
import pytest

from biogrip.arrays import Array
from tests.helpers.identified import FEW, identified, identify, write_trace

SINCE = np.linspace(0.05, 20, 400)
NOISY = 500 + 300 * np.exp(-SINCE / 2) + np.random.default_rng(1).normal(0, 5, len(SINCE))


def trace(folder: Path, times: Array, values: Array) -> Path:
    return write_trace(folder / "trace.csv", times, values, "time_s,modulus_Pa")


@pytest.mark.parametrize(
    ("times", "values", "model", "said"),
    [
        (SINCE[:10], NOISY[:10], "generalized_maxwell_5", "found 10 readings for 12 unknown"),
        (SINCE[:3], NOISY[:3], "kelvin_voigt", "found 3 rows with a number"),
        (SINCE, np.full(400, 1.0), "zener_maxwell", "but 1 Pa throughout"),
        (SINCE, np.zeros(400), "zener_maxwell", "but 0 Pa throughout"),
        (1e-12 * SINCE, NOISY, "zener_maxwell", "Is the unit of time right?"),
        (1e12 * SINCE, NOISY, "zener_maxwell", "Is the unit of time right?"),
    ],
)
def test_what_tells_nothing_is_refused_in_one_message(
    tmp_path: Path, times: Array, values: Array, model: str, said: str
) -> None:
    file = trace(tmp_path, times, values)
    status, _, text = identify(file, "--reading", "modulus=modulus_Pa", "--model", model)
    assert status == 1
    assert said in text
    assert text.count("\n") == 1


@pytest.mark.parametrize(
    ("times", "values", "cut"),
    [
        (SINCE[::40], NOISY[::40], None),
        (SINCE, NOISY.clip(max=600), "largest, 600 Pa"),
        (SINCE, NOISY.clip(min=510), "smallest, 510 Pa"),
        (SINCE, NOISY.round(-1), None),
        (SINCE, 500 + 300 * np.exp(-SINCE / 2), None),
        (SINCE, 1e-12 * NOISY, None),
        (SINCE, 1e12 * NOISY, None),
        pytest.param(
            np.linspace(1e-4, 20, 200_000),
            500 + np.random.default_rng(1).normal(0, 5, 200_000),
            None,
            marks=pytest.mark.nightly,
        ),
    ],
)
@pytest.mark.filterwarnings("error")
def test_strange_readings_are_answered_and_saturated_ones_told(
    tmp_path: Path, times: Array, values: Array, cut: str | None
) -> None:
    rich = FEW.replace("damper, maxwell", "zener_maxwell, generalized_maxwell_5")
    file = trace(tmp_path, times, values)
    given = ("--reading", "modulus=modulus_Pa", "--model", "zener_maxwell")
    found = identified(tmp_path, file, *given, config=rich if len(times) == 10 else FEW)
    told = [text for text in map(str, found["notes"]) if "saturated" in text]
    assert len(told) == (cut is not None)
    assert all(f"exactly the {cut}" in text for text in told)
    assert "generalized_maxwell_5" not in str(found["models"])
