from pathlib import Path

import numpy as np
import pytest

from biogrip.errors import BiogripError
from biogrip.records import traces
from biogrip.records.traces import (
    Measurements,
    column_names,
    each_trace,
    read_jaw_force,
    read_measurements,
    read_target,
    seeds_in,
    write_measurements,
    write_target,
)

TIMES = np.arange(5.0)
# Rounding is all that is in the second.
FORCE = np.array([0.0, -3.1e-23, 1e-6 / 3, -7e-7 / 3, 1e-12 / 7])


def written(tmp_path: Path) -> Path:
    write_target(tmp_path / "t.csv", TIMES, 1e-9 * np.ones(5), 1e-5 * TIMES / 3, FORCE)
    return tmp_path / "t.csv"


def test_a_target_is_read_back_to_nine_digits(tmp_path: Path) -> None:
    time_s, torque, rotation = read_target(written(tmp_path))
    np.testing.assert_array_equal(time_s, TIMES)
    np.testing.assert_array_equal(torque, 1e-9)
    np.testing.assert_allclose(rotation, 1e-5 * TIMES / 3, rtol=5e-9)
    force = read_jaw_force(written(tmp_path))[2]
    np.testing.assert_allclose(force, FORCE, rtol=0, atol=5e-16)
    assert force[1] == 0
    assert ",-0" not in written(tmp_path).read_text()


def test_no_force_at_all_is_written_as_none(tmp_path: Path) -> None:
    write_target(tmp_path / "t.csv", TIMES, TIMES, TIMES, np.zeros(5))
    assert np.all(read_jaw_force(tmp_path / "t.csv")[2] == 0)


@pytest.mark.parametrize(
    ("line", "text", "message"),
    [
        (3, "2,1e-9,nan,0", "line 4, rotation_rad: found nan, allowed is a finite number"),
        (2, "1,inf,1e-6,0", "line 3, torque_Nm: found inf, allowed is a finite number"),
        (1, "0,1e-9,abc,0", "cannot be read as a target: could not convert string"),
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


def test_traces_are_read_one_after_the_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """However many at once; those of all seeds, and no other column."""
    monkeypatch.setattr(traces, "_READ_AT_ONCE", 2)
    written = {seed: np.full(4, float(seed)) for seed in (3, 4, 5, 6, 7)}
    path = tmp_path / "seeds_3-7.parquet"
    write_measurements(path, Measurements(np.arange(4.0), np.zeros(4), written))
    assert seeds_in(path) == list(written)
    np.testing.assert_array_equal(list(each_trace(path)), list(written.values()))


def test_standard_deviations_are_kept(tmp_path: Path) -> None:
    path, trace = tmp_path / "seeds_0-0.parquet", {0: np.ones(4)}
    write_measurements(path, Measurements(np.arange(4.0), None, trace, sd_rad=np.full(4, 0.1)))
    for seeds in ([0], None):
        read = read_measurements(path, seeds)
        assert read.sd_rad is not None
        np.testing.assert_array_equal(read.sd_rad, 0.1)
        assert list(read.rotation_rad) == [0]
    assert seeds_in(path) == [0]


def test_columns_have_names_for_any_instrument(tmp_path: Path) -> None:
    trace, path = {0: np.arange(4.0)}, tmp_path / "t.parquet"
    noisy = Measurements(np.arange(4.0), np.ones(4), trace, sd_rad=np.full(4, 0.1))
    write_measurements(path, noisy)
    assert column_names(path) == ["time_s", "target", "sd", "seed_0"]
    np.testing.assert_array_equal(read_measurements(path).target_rad, 1.0)
