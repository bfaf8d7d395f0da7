from pathlib import Path

import numpy as np
import pytest

from biogrip.errors import BiogripError
from biogrip.products.files.traces import read_target, write_target

TIMES = np.arange(5.0)


def written(tmp_path: Path) -> Path:
    write_target(tmp_path / "t.csv", TIMES, 1e-9 * np.ones(5), 1e-5 * TIMES / 3)
    return tmp_path / "t.csv"


def test_a_target_is_read_back_to_nine_digits(tmp_path: Path) -> None:
    time_s, torque, rotation = read_target(written(tmp_path))
    np.testing.assert_array_equal(time_s, TIMES)
    np.testing.assert_array_equal(torque, 1e-9)
    np.testing.assert_allclose(rotation, 1e-5 * TIMES / 3, rtol=5e-9)


@pytest.mark.parametrize(
    ("line", "text", "message"),
    [
        (3, "2,1e-9,nan", "line 4, rotation_rad: found nan, allowed is a finite number"),
        (2, "1,inf,1e-6", "line 3, torque_Nm: found inf, allowed is a finite number"),
        (1, "0,1e-9,abc", "cannot be read as a target: could not convert string"),
        (0, "t,tau,phi", "line 1: found the columns t, tau, phi"),
    ],
)
def test_a_damaged_target_is_explained(tmp_path: Path, line: int, text: str, message: str) -> None:
    path = written(tmp_path)
    lines = path.read_text().splitlines()
    lines[line] = text
    path.write_text("\n".join(lines))
    with pytest.raises(BiogripError, match=message):
        read_target(path)
