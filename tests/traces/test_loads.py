"""What was held or loaded: its unit, and a column of it, which is the protocol of all rows."""

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.command.options import Setting
from biogrip.command.settings import Asked, case_of, read_trace
from biogrip.command.words import load_in_words
from biogrip.config.source import HOLD
from biogrip.errors import BiogripError
from biogrip.identify.data import trace_data
from biogrip.identify.identify import identify
from biogrip.identify.prepare import prepare
from biogrip.identify.recorded_load import smoothed
from biogrip.judging.diagnosis import Diagnosis
from biogrip.physics.instruments import CONTROLLED
from biogrip.physics.protocol import evaluate
from biogrip.traces.columns import held_unit
from biogrip.traces.reader import read_recording
from tests.helpers.columns import columns_of
from tests.helpers.identified import write_trace

EVEN = np.linspace(0.0, 90.0, 2001)
CORNERS = [0.0, 2.0, 8.0, 50.0, 53.0, 90.0], [0.0, 0.0, 1.0, 1.0, -0.5, -0.5]


def load_at(time_s: Array) -> Array:
    return np.interp(time_s - time_s[0], *CORNERS)


def test_what_was_held_may_have_its_unit() -> None:
    for text, name, expected in (
        ("20pN", "force", 20e-12),
        ("1e-3N", "force", 1e-3),
        ("3 gf", "force", 3 * 9.80665e-3),
        (".5 ‰", "strain", 5e-4),
        ("0.1", "strain", 0.1),
        ("-5 mbar", "stress", -500.0),
        ("10 cm H2O", "stress", 980.665),
        ("1 mmHg", "stress", 133.322387415),
    ):
        controlled = next(each for each in CONTROLLED if each.name == name)
        number, unit = held_unit(text, controlled)
        assert number * controlled.units[unit] == pytest.approx(expected, rel=1e-12)


def test_readings_beside_the_record_of_the_load_are_gaps(tmp_path: Path) -> None:
    """Rows between two of the record keep their readings."""
    there = {*range(3, 10), *range(12, 17)}
    rows = [f"{i},{5 if i in there else ''},{i}" for i in range(20)]
    (path := tmp_path / "t.csv").write_text("\n".join(["time_s,stress_Pa,strain", *rows]))
    columns = columns_of("time_s", "strain", "strain", load="stress_Pa")
    recorded = read_recording(path, columns)
    assert (recorded.time_s.tolist(), recorded.gaps) == ([*range(3, 17)], 6)


CLOCK = np.arange(400) / 10


def loaded(path: Path, *columns: Array, more: Sequence[Setting] = ()) -> Asked:
    """Times, strains and stresses in a file whose course of the stress is its load."""
    write_trace(path, *columns, header="time_s,strain,stress_Pa")
    given = {"strain": "strain", "load": "stress_Pa"}
    settings = (Setting("--set", ("measurement", key), value) for key, value in given.items())
    return Asked(path, None, (*settings, *more))


def crept(stress: Array, seed: int) -> Array:
    """Strain of a Zener solid (500, 300 Pa, 10 s) step by step, with noise of 1e-4."""
    voigt = np.zeros(len(stress))
    for row in range(1, len(stress)):
        rest = 0.5 * (stress[row] + stress[row - 1]) / 300
        voigt[row] = rest + (voigt[row - 1] - rest) * np.exp(-0.01)
    return stress / 500 + voigt + np.random.default_rng(seed).normal(0, 1e-4, len(stress))


@pytest.mark.parametrize(("felt", "smoothed"), [(False, True), (True, False)])
def test_scatter_that_readings_do_not_follow_is_smoothed_out(
    tmp_path: Path, felt: bool, smoothed: bool
) -> None:
    """A step to 5 Pa, and 0.05 Pa of noise, of the sensor or of the stress itself."""
    true = np.where(CLOCK < 10, 0.0, 5.0)
    read = true + np.random.default_rng(2).normal(0, 0.05, len(CLOCK))
    asked = loaded(tmp_path / "t.csv", CLOCK, crept(read if felt else true, 3), read)
    recording, case = read_trace(asked)
    recording, experiment = prepare(recording, case.judged_experiment)
    assert recording.load_noise == pytest.approx(0.01 * smoothed, rel=0.1)
    assert experiment.record is not None
    # Without both rows of the step.
    rows = np.delete(experiment.record[:, 1], [100, 101])
    off = rows - (true if smoothed else read)
    assert np.sqrt(np.mean(off**2)) < (0.02 if smoothed else 1e-12)
    said = load_in_words((recording, experiment), case, {})
    assert said.endswith("from 0 s (column stress_Pa, 400 rows).")


def judged(path: Path, *columns: Array) -> Diagnosis:
    """What such a file tells of a Zener solid, beside no other models."""
    model = Setting("--model", ("sample", "model"), "zener_kelvin")
    recording, case = read_trace(loaded(path, *columns, more=[model]))
    return identify(recording, replace(case.judged_experiment, models=(), usual_models=False))


@pytest.mark.parametrize("at_s", [(9.05,), (9.0, 60.0)])
def test_limits_allow_for_steps_anywhere_between_two_rows(
    tmp_path: Path, at_s: tuple[float, ...]
) -> None:
    """A Zener solid's creep and recovery, in closed form, under 5 Pa that a log of 1 s has."""
    log_s = np.arange(100.0)
    strain = np.random.default_rng(6).normal(0, 1e-4, len(log_s))
    stress = np.zeros(len(log_s))
    for sign, step_s in zip((1, -1), at_s, strict=False):
        since = np.maximum(log_s - step_s, 0.0)
        crept = 1 / 500 + (1 - np.exp(-since / 10)) / 300
        strain += np.where(log_s >= step_s, sign * 5 * crept, 0.0)
        stress += np.where(log_s >= step_s, sign * 5.0, 0.0)
    diagnosis = judged(tmp_path / "log.csv", log_s, strain, stress)
    assert diagnosis.status == "ok"
    width = []
    for finding, truth in zip(diagnosis.findings, (500.0, 300.0, 3000.0, 10.0), strict=True):
        low, high = finding.low or 0.0, finding.high or np.inf
        assert low < truth < high
        width.append(np.log(high / low))
    # By as much as the step may be earlier or later; the retardation time does not hang on it.
    assert 0.1 < width[0] < 0.3
    assert width[3] < 0.05
    assert trace_data(diagnosis)["limits"].startswith(f"Limits allow for {len(at_s)} step")


@pytest.mark.parametrize("late_rows", [0.0, 0.5, -0.5])
def test_the_clock_of_a_smooth_load_is_doubted(tmp_path: Path, late_rows: float) -> None:
    """The creep of a Zener solid under 5 Pa sin(pi t), from its equation, and rows of 0.05 s."""
    clock, tau_s = np.arange(0.0, 30.0, 0.05), 0.5
    turn = np.pi * clock
    delayed = np.sin(turn) - np.pi * tau_s * (np.cos(turn) - np.exp(-clock / tau_s))
    strain = 5 * (np.sin(turn) / 500 + delayed / 300 / (1 + (np.pi * tau_s) ** 2))
    strain += np.random.default_rng(2).normal(0, 1e-4, len(clock))
    logged = 5 * np.sin(np.maximum(turn - np.pi * 0.05 * late_rows, 0.0))
    diagnosis = judged(tmp_path / "log.csv", clock, strain, logged)
    k_s = diagnosis.findings[0]
    assert ((k_s.low or 0.0) < 500 < (k_s.high or np.inf)) == (not late_rows)
    said = [note.text for note in diagnosis.notes if "seems to be logged" in note.text]
    assert diagnosis.status == ("doubtful" if said else "ok")
    assert len(said) == bool(late_rows)
    for text in said:
        (late_s,) = re.findall(
            r"logged ([\d.]+) s too " + ("late" if late_rows > 0 else "early"), text
        )
        assert float(late_s) == pytest.approx(0.025, rel=0.3)


@pytest.mark.nightly
def test_a_load_that_tells_no_clock_is_left_alone(tmp_path: Path) -> None:
    """Under a ramp an earlier load is a little more of what is there, whatever the sample."""
    clock, load = np.arange(0.0, 30.0, 0.1), 0.2 * np.arange(0.0, 30.0, 0.1)
    strain = load / 500 + (load - 0.1 * (1 - np.exp(-clock / 0.5))) / 300
    strain += 0.01 * strain.max() * np.random.default_rng(1).standard_normal(len(clock))
    diagnosis = judged(tmp_path / "log.csv", clock, strain, load)
    assert diagnosis.status == "ok"
    assert not [note for note in diagnosis.notes if "seems to be logged" in note.text]


@pytest.mark.parametrize("first_s", [0.5, 0.0])
def test_a_load_that_is_there_in_the_first_row_came_before_it(
    tmp_path: Path, first_s: float
) -> None:
    clock = first_s + CLOCK
    case, _ = case_of(loaded(tmp_path / "late.csv", clock, clock, np.full(len(clock), 5.0)))
    assert case.block.protocol.phases[0].duration_s == pytest.approx(clock[-1])
    experiment = case.judged_experiment
    assert not experiment.start_given
    assert evaluate(experiment.torque, [0.0, first_s, 9.0]).tolist() == [5.0, 5.0, 5.0]


@pytest.mark.parametrize("begins", ["smoothly", "by a step"])
def test_a_load_whose_first_row_is_missing_goes_on_in_a_line(tmp_path: Path, begins: str) -> None:
    """A sine of 25 rows a period, held up to its first row, moves limits by two of their widths."""
    clock = CLOCK[1:]
    load = np.sin(0.8 * np.pi * clock) if begins == "smoothly" else np.where(clock < 0.15, 5.0, 2.0)
    record = case_of(loaded(tmp_path / "sine.csv", clock, clock, load))[0].record
    assert record is not None
    # A line from row to row is off by (omega h)^3 = 0.016.
    expected = 0.0 if begins == "smoothly" else 5.0
    assert record[0].tolist() == [0.0, pytest.approx(expected, abs=0.016)]


@pytest.mark.parametrize(("since_s", "taken_off"), [(0.0, 0.0), (5.05, 0.3)])
def test_what_readings_do_not_follow_is_taken_off_the_load(
    tmp_path: Path, since_s: float, taken_off: float
) -> None:
    """Creep by 1/2 at once, and by 1/3 with 4 s; 0.3 Pa from 0 on are held, or a tare."""

    def strain(after_s: Array) -> Array:
        return np.where(after_s > 0, 1 / 2 + -np.expm1(-after_s / 4) / 3, 0.0)

    stress = np.where(CLOCK > 5.05, 1.3, 0.3)
    values = strain(CLOCK - 5.05) + 0.3 * strain(CLOCK + 1e-9) * (since_s == 0)
    values += 1e-3 * np.random.default_rng(1).standard_normal(len(CLOCK))
    trace, case = read_trace(loaded(tmp_path / "t.csv", CLOCK, values, stress))
    recording, experiment = prepare(trace, case.experiment)
    assert experiment.record is not None
    assert experiment.record[[0, -1], 1] == pytest.approx([0.3 - taken_off, 1.3 - taken_off])
    said = " ".join(recording.remarks())
    assert ("a tare that readings do not follow: 0.3 Pa" in said) == bool(taken_off)


def test_of_a_clean_course_nothing_is_smoothed_out() -> None:
    """Of a sinusoid with 25 rows a period 3e-4, and nothing of a constant or of steps."""
    course = np.sin(2 * np.pi * np.arange(500) / 25)
    np.testing.assert_allclose(smoothed(course)[0], course, atol=3e-4)
    for still in (np.full(100, 3.0), np.repeat([0.0, 2.0, 1.0], 50)):
        np.testing.assert_allclose(smoothed(still)[0], still, atol=1e-12)


@pytest.mark.parametrize(
    ("held", "shown", "notes"), [(20.0, "20 N", 1), ("20 pN", "20 pN", 0), ("20 N", "20 N", 0)]
)
def test_a_bare_number_beside_readings_with_a_prefix_has_a_note(
    tmp_path: Path, held: float | str, shown: str, notes: int
) -> None:
    path, beads = tmp_path / "bead.csv", 40.0 + 10 * np.sqrt(CLOCK[1:])
    write_trace(path, CLOCK[1:], beads, header="time_s,displacement_nm")
    reading = Setting("--reading", ("measurement", "displacement"), "displacement_nm")
    asked = Asked(path, None, (reading, Setting("--hold", HOLD, held)))
    recording, case = read_trace(asked)
    said = load_in_words((recording, case.experiment), case, asked.given)
    assert said == f"Held: {shown} from 0 s to 39.9 s."
    assert ['as in --hold "20 nN"' in remark for remark in recording.remarks()] == [True] * notes


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
    settings = (Setting(f"--{key}", ("measurement", key), it) for key, it in options.items())
    return Asked(path, None, tuple(settings))


@pytest.mark.parametrize("start_s", [0.0, 100.0])
def test_a_column_of_the_load_is_the_protocol_of_all_rows(tmp_path: Path, start_s: float) -> None:
    """Where it holds still, rows are no phases."""
    asked = written(tmp_path / "t.csv", start_s)
    rows = Setting("--set", ("measurement", "rows"), {"Segment": "dwell"})
    case, _ = case_of(Asked(asked.trace, None, (*asked.settings, rows)))
    history = case.experiment.torque
    assert history.deforms
    np.testing.assert_allclose(evaluate(history, EVEN), 5e-6 * load_at(EVEN), atol=1e-15)
    assert len(history.steps_s) == 0
    assert len(history.time_s) < 300
    assert case.block.measurement.start_s == (start_s or None)
    found = read_recording(asked.trace, case.block.measurement)
    dwell = (EVEN >= 8) & (EVEN < 50)
    np.testing.assert_allclose(found.time_s, EVEN[dwell] + start_s)
    assert found.form["others"] == np.count_nonzero(~dwell)


def test_a_load_or_rows_that_are_not_there_are_explained(tmp_path: Path) -> None:
    for key, value, said in (
        ("load", "Force", "there is no column 'Force'. The file has: Time_S, Fn in mN"),
        (
            "load",
            "Segment",
            "column 'Segment': found no unit; allowed are m, cm, mm, um, nm, by --set",
        ),
        ("load_unit", "V", "found the unit 'V', allowed are m, cm, mm, um, nm."),
        ("rows", {"Segment": "dwel"}, "found no row with 'dwel', allowed are approach"),
        ("rows", {"Part": 2}, "there is no column 'Part'. The file has: Time_S"),
        ("fit_start", True, "measurement.fit_start: does not go with load; allowed is one of"),
    ):
        asked = written(tmp_path / "t.csv")
        settings = (*asked.settings, Setting("--set", ("measurement", key), value))
        with pytest.raises(BiogripError) as error:
            read_trace(Asked(asked.trace, None, settings))
        assert said in str(error.value)
