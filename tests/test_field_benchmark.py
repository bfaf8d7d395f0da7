"""What of the comparison with the field's libraries needs none of them."""

import time

import numpy as np
import pytest

from benchmarks.field import by_biogrip, dish, fitted, measured
from benchmarks.field.by_biogrip import OURS
from benchmarks.field.compared import compared
from benchmarks.field.elements import Kelvin, Maxwell
from benchmarks.field.fitted import Fitted, Method
from benchmarks.field.measured import BIOGRIP, COLUMNS, PYRHEO, TASKS, Answer, Program, Task
from benchmarks.field.traces import GRIPPER, SAMPLES, Trace, as_compliance
from biogrip.arrays import Array
from tests.helpers.power_law import mittag_leffler


@pytest.mark.parametrize("branches", SAMPLES)
def test_the_force_on_the_sample_is_the_given_one(branches: int) -> None:
    trace = Trace(branches, 0)
    compliance = trace.sample.compliance(trace.time_s)
    error = as_compliance(trace.clean_rad)[1:] / compliance - 1
    # What the hinges take of the torque, and a little more for the arms' damping.
    assert np.max(np.abs(error)) < 1.1 * GRIPPER.jaw_stiffness_N_per_m * compliance.max()
    assert np.max(np.abs(error)) < 1e-6


def _creep_of(sample: Maxwell, time_s: Array) -> Array:
    """Solve the network's equation for the strain under unit force by fine steps."""
    strain, inner = 1 / (sample.k_p + sample.k.sum()), np.zeros_like(sample.k)
    steps = 20
    found = []
    for before, after in zip(np.r_[0.0, time_s[:-1]], time_s, strict=True):
        h = (after - before) / steps
        for _ in range(steps):
            # Midpoint rule: each damper follows its branch's spring.
            middle = inner + 0.5 * h * (strain - inner) / sample.tau
            strain_there = (1 + sample.k @ middle) / (sample.k_p + sample.k.sum())
            inner = inner + h * (strain_there - middle) / sample.tau
            strain = (1 + sample.k @ inner) / (sample.k_p + sample.k.sum())
        found.append(strain)
    return np.array(found)


@pytest.mark.parametrize("sample", SAMPLES.values())
def test_compliance_is_the_networks(sample: Maxwell) -> None:
    time_s = np.linspace(0.5, 60.0, 120)
    np.testing.assert_allclose(sample.compliance(time_s), _creep_of(sample, time_s), rtol=1e-4)


@pytest.mark.parametrize("sample", SAMPLES.values())
def test_both_forms_are_the_same_sample(sample: Maxwell) -> None:
    back = sample.kelvin().maxwell()
    assert back is not None
    assert back.named() == pytest.approx(sample.named(), rel=1e-9)


def test_seeds_and_numbers_of_branches_have_noise_of_their_own() -> None:
    traces = [Trace(1, 0), Trace(1, 1), Trace(2, 0)]
    noise = [(trace.rotation_rad - trace.clean_rad) / trace.clean_rad.max() for trace in traces]
    correlation = np.corrcoef(noise)
    assert np.max(np.abs(correlation - np.eye(3))) < 0.2
    np.testing.assert_array_equal(Trace(1, 0).rotation_rad, traces[0].rotation_rad)


def test_springs_and_dampers_have_no_negative_share() -> None:
    assert Kelvin(0.3, np.array([-0.1]), np.array([5.0])).maxwell() is None


def test_ours_reaches_the_best_fit() -> None:
    (row,) = compared(by_biogrip.METHODS, OURS, branches=2, count=2)
    assert (row["reached"], row["failures"]) == (2, {})
    assert row["compliance_error"] < 0.01
    assert list(row["parameter_errors"]) == ["k_p", "k_1", "k_2", "tau_1", "tau_2"]
    assert row["intervals"] == row["intervals_closed"] == 2 * 5
    assert row["fit_times_ours"] == row["whole_times_ours"] == 1.0


def test_what_fails_or_takes_too_long_has_reached_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    def wrong(trace: Trace) -> Fitted:
        raise ValueError

    def slow(trace: Trace) -> Fitted:
        time.sleep(10)
        raise AssertionError

    def truth(trace: Trace) -> Fitted:
        return Fitted(trace.sample, trace.compliance, lambda: {"k_p": (0.9, 1.1), "tau_1": (0, 1)})

    monkeypatch.setattr(fitted, "TIME_LIMIT_S", 0.05)
    methods = [Method("truth", truth), Method("wrong", wrong), Method("slow", slow)]
    known, failed, stopped = compared(methods, "truth", branches=1, count=2)
    assert (failed["failures"], stopped["failures"]) == ({"ValueError": 2}, {"TimeoutError": 2})
    for row in (failed, stopped):
        assert (row["reached"], row["intervals"], row["compliance_error"]) == (0, 0, None)
        assert set(row["parameter_errors"].values()) == {None}
    assert known["reached"] == 2
    assert (known["intervals"], known["intervals_hold"]) == (4, 2)


def test_cells_of_a_dish_are_identified_by_each_way_as_they_were_made() -> None:
    def wrong(trace: Trace) -> Fitted:
        raise ValueError

    cells = dish.dish(3)
    together, alone, failed = dish.compared([*by_biogrip.METHODS, Method("wrong", wrong)], cells)
    for row in (together, alone):
        assert (row["reached"], row["intervals"], row["failures"]) == (3, 9, {})
        assert row["intervals_hold"] >= 7
    assert (failed["failures"], failed["reached"]) == ({"ValueError": 3}, 0)
    elements = np.log([[cell.sample.k_p, cell.sample.k[0]] for cell in dish.dish()])
    np.testing.assert_allclose(np.exp(elements.mean(axis=0)), [12.3, 35.0], rtol=0.15)
    np.testing.assert_allclose(elements.std(axis=0), dish.SPREAD, rtol=0.2)


def _task(title: str) -> Task:
    return next(task for task in TASKS if task.title == title)


def test_measured_traces_and_their_steps_are_those_of_the_files() -> None:
    whole, stretched = _task("HL60 cell, recovery too"), _task("HL60 cell, while stretched")
    load = (whole.time_s > 1.0) & (whole.time_s < 5.0)
    np.testing.assert_array_equal(stretched.data, whole.data[load])
    np.testing.assert_allclose(stretched.time_s, whole.time_s[load] - 1.0, atol=1e-12)
    # The springpot's compliance by its formula.
    own = {"k_alpha": 140.0, "alpha": 1.0}
    np.testing.assert_allclose(stretched.curve(own), stretched.time_s / 140.0, rtol=1e-9)


def test_what_maxwell_branches_leave_is_evaluated_exactly() -> None:
    task = _task("Mucus, Maxwell branches")
    sample = Maxwell(0.4, np.array([10.0, 0.2]), np.array([0.03, 4.0]))
    k, c = sample.k, sample.k * sample.tau
    given = {"k_p": 0.4, "k_1": k[0], "k_2": k[1], "c_1": c[0], "c_2": c[1]}
    np.testing.assert_allclose(task.curve(given), sample.compliance(task.time_s), rtol=1e-9)


def test_what_pyrheo_printed_leaves_more_than_it_said_and_than_ours() -> None:
    task = _task("Mucus")
    (row,) = measured.compared((PYRHEO,), task, rounds=1)
    assert PYRHEO.fit(task).curve == pytest.approx(row["drawn"] * row["best"])
    k, a, c = (row["said"][name][0] for name in ("k_alpha", "alpha", "c_p"))
    curve = [t / c * mittag_leffler(1 - a, 2.0, k / c * t ** (1 - a)) for t in task.time_s]
    left = float(np.sum((np.array(curve) / task.data - 1) ** 2))
    assert row["exact"] * row["best"] == pytest.approx(left, rel=1e-6)
    assert row["exact"] > row["drawn"] > 1


def test_what_a_trace_does_not_determine_is_said_by_each() -> None:
    def wrong(task: Task) -> Answer:
        raise ValueError

    def loose(task: Task) -> Answer:
        values = {"k_p": 80.4, "k_alpha": 1e3, "alpha": 0.99}
        said = {"k_p": (80.4, 78.0, 82.0), "k_alpha": (1e3, None, None), "alpha": (0.99, 0.5, None)}
        return Answer(task.curve(values), values, lambda: said)

    programs = [
        BIOGRIP,
        *(Program(n, f, BIOGRIP.takes, BIOGRIP.measure) for n, f in (("a", loose), ("b", wrong))),
    ]
    rows = measured.compared(programs, _task("Cellulose hydrogel"), rounds=1)
    ours, a, b = ({head: cell(row) for head, cell in COLUMNS.items()} for row in rows)
    assert "alpha not determined" in ours["what it says (95 % limits)"]
    assert a["what it says (95 % limits)"] == (
        "k_p 80.40 (78.00 to 82.00); k_alpha 1,000, no limits; alpha 0.9900 (0.5000 to open)"
    )
    assert (b["leaves, of the best"], b["by its own curve"]) == ("–", "–")
    assert b["what it says (95 % limits)"] == "ValueError 1 times"
