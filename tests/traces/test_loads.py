"""A recorded load as ramps: few of them, and near it, whatever its noise, rounding and clock."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.command.settings import Asked, Setting, case_of
from biogrip.errors import BiogripError
from biogrip.physics.protocol import evaluate
from biogrip.traces.loads import ramps
from biogrip.traces.reader import read_recording

EVEN = np.linspace(0.0, 90.0, 2001)
CLOCKS = {"even": EVEN, "late": EVEN + 1e6, "log": np.r_[0.0, np.geomspace(1e-3, 90.0, 2000)]}
CORNERS = [0.0, 2.0, 8.0, 50.0, 53.0, 90.0], [0.0, 0.0, 1.0, 1.0, -0.5, -0.5]


def load_at(time_s: Array) -> Array:
    return np.interp(time_s - time_s[0], *CORNERS)


@pytest.mark.parametrize("clock", CLOCKS)
@pytest.mark.parametrize(("noise", "step"), [(0.0, 0.0), (2e-3, 0.0), (0.0, 1e-2)])
def test_a_load_is_few_ramps_within_its_noise(clock: str, noise: float, step: float) -> None:
    time_s = CLOCKS[clock]
    true = load_at(time_s)
    read = true + noise * np.random.default_rng(1).normal(size=len(true))
    read = np.round(read / step) * step if step else read
    ends, off = ramps(time_s, 3e-9 * read)
    found = np.interp(time_s, *ends.T) / 3e-9
    assert len(ends) <= (15 if noise else 201 if step else 12)
    assert ends[[0, -1], 0].tolist() == time_s[[0, -1]].tolist()
    assert ends[0, 1] == 0
    assert np.sqrt(np.mean((found - true) ** 2)) < max(noise, 0.5 * step, 2e-4)
    assert off / 3e-9 == pytest.approx(np.max(np.abs(found - read)), abs=1e-2)


@pytest.mark.parametrize("name", ["step", "sinusoid", "constant"])
def test_other_histories_are_ramps_too(name: str) -> None:
    """A step is one between two readings; of what would be endless ramps, it is told how near."""
    courses = {
        "step": np.where(EVEN < 30, 0.0, 2.0),
        "sinusoid": np.sin(2 * EVEN),
        "constant": np.full_like(EVEN, 3.0),
    }
    ends, off = ramps(EVEN, courses[name])
    assert len(ends) == {"step": 4, "constant": 2}.get(name, len(ends)) <= 201
    assert off == pytest.approx(np.max(np.abs(np.interp(EVEN, *ends.T) - courses[name])))
    assert off < (0.1 if name == "sinusoid" else 1e-9)


def written(path: Path, start_s: float = 0.0) -> Asked:
    """Forces at a displacement that is approached, held and taken back, in a file of segments."""
    time_s, load = EVEN + start_s, 5.0 * load_at(EVEN)
    part = np.select([EVEN < 8, EVEN < 50], ["approach", "dwell"], "retract")
    rows = [
        f"{t!r},{x + 0.1!r},{x!r},{s}"
        for t, x, s in zip(time_s.tolist(), load.tolist(), part, strict=True)
    ]
    path.write_text("\n".join(["Time_S,Fn in mN,Displacement [µm],Segment", *rows]))
    options = {"time": "Time_S", "force": "Fn in mN", "load": "Displacement [µm]"}
    return Asked(
        path,
        None,
        tuple(Setting(f"--{key}", ("measurement", key), it) for key, it in options.items()),
    )


@pytest.mark.parametrize("start_s", [0.0, 100.0])
def test_a_column_of_the_load_is_the_protocol_of_all_rows(tmp_path: Path, start_s: float) -> None:
    asked = written(tmp_path / "t.csv", start_s)
    rows = Setting("--set", ("measurement", "rows"), {"Segment": "dwell"})
    case = case_of(Asked(asked.trace, None, (*asked.settings, rows)))
    history = case.experiment.torque
    assert history.deforms
    np.testing.assert_allclose(evaluate(history, EVEN[:-1]), 5e-6 * load_at(EVEN[:-1]), atol=2e-9)
    assert not [start for start, order, _ in history.jumps if order == 0]
    assert case.columns.start_s == (start_s or None)
    found = read_recording(asked.trace, case.columns)
    dwell = (EVEN >= 8) & (EVEN < 50)
    np.testing.assert_allclose(found.time_s, EVEN[dwell] + start_s)
    assert found.form["others"] == np.count_nonzero(~dwell)


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("load", "Force", "column 'Force': found no such column, allowed are Time_S, Fn in mN"),
        ("load", "Segment", "column 'Segment': found no unit, neither stated (by --set measure"),
        ("load_unit", "V", "measurement.load_unit: found 'V', allowed are m, cm, mm, um, nm."),
        ("rows", {"Segment": "dwel"}, "found no row with 'dwel', allowed are approach"),
        ("rows", {"Part": 2}, "column 'Part': found no such column, allowed are Time_S"),
        ("fit_start", True, "measurement.fit_start: does not go with load; allowed is one of"),
    ],
)
def test_a_load_or_rows_that_are_not_there_are_explained(
    tmp_path: Path, key: str, value: object, said: str
) -> None:
    asked = written(tmp_path / "t.csv")
    settings = (*asked.settings, Setting("--set", ("measurement", key), value))

    def read() -> None:
        case = case_of(Asked(asked.trace, None, settings))
        read_recording(asked.trace, replace(case.columns, by_options=True))

    with pytest.raises(BiogripError) as error:
        read()
    assert said in str(error.value)
