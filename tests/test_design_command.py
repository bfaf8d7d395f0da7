"""`biogrip design`: from a config to an experiment that a study takes, and bad configs."""

import re
from contextlib import redirect_stdout
from dataclasses import replace
from io import StringIO
from pathlib import Path

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.cli import main
from biogrip.design import within_reach
from biogrip.design.experiment import DesignInputs
from biogrip.design.rating import Rater, Torque
from biogrip.design.schedule import presses
from biogrip.design.shapes import SHAPES
from biogrip.experiment.noise_parts import AR1
from biogrip.experiment.protocol import torque_history
from biogrip.experiment.random_streams import stream
from biogrip.identifiability.at_truth import bounds_percent
from biogrip.identify.answer import silent
from biogrip.identify.case_problem import CaseProblem
from biogrip.identify.least_squares import LeastSquaresSettings, identify_many
from biogrip.instrument.actuator import torque, voltage
from biogrip.own_design.earlier import Recorded, estimate_from_recordings
from biogrip.own_traces.read_as import ReadAs
from biogrip.response.sensitivity import linear_responses
from biogrip.response.simulation import simulated_rotation
from biogrip.study.design_inputs import make_design_inputs, plausible, plausible_ends
from biogrip.study.load import load_study, read_configs
from biogrip.study.study import Case
from tests.helpers.default import study_of
from tests.helpers.places import CONFIG

ASKED = """
search_range:
  k_p: {exponent: [-5, 8]}
design:
  {noise_rad: 3.0e-6, readings: 400, fastest_Hz: 1.0e+5, longest_s: 60.0,
   largest_torque_Nm: 8.0e-9, most_steps: 4, candidates: 128}
only: [liquid_drop_2]
"""

# A camera that reads nothing of c_p: its share is over some milliseconds after a step.
SLOW = """
design:
  {noise_rad: 8.0e-7, readings: 2000, fastest_Hz: 20, longest_s: 300, largest_torque_Nm: 2.0e-9,
   most_steps: 4, ranges: {k: [15, 50], c: [60, 250]}, plausible_samples: 3, candidates: 128}
gripper:
  arm_length_m: 1.6e-3
  left: {stiffness_Nm_per_rad: 5.0e-7}
  right: {stiffness_Nm_per_rad: 5.0e-7}
only: [cell]
cases:
  cell:
    sample: {model: generalized_maxwell, k: 25, k_p: 6, c: 100, c_p: 0.02}
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """A folder with a config and its design, and what the command said."""
    place = tmp_path_factory.mktemp("design")
    (place / "asked.yaml").write_text(ASKED)
    said = StringIO()
    with redirect_stdout(said):
        assert design(place, "--case", "liquid_drop_2") == 0
    return place, said.getvalue()


def design(place: Path, *more: str) -> int:
    return main(["design", str(place / "asked.yaml"), "--output", str(place / "out.yaml"), *more])


def designed_case(place: Path, name: str = "liquid_drop_2") -> Case:
    files = [CONFIG, place / "asked.yaml", place / "out.yaml"]
    return load_study(read_configs(files), files).cases[name]


def test_a_study_takes_it_and_has_the_bounds_that_were_promised(folder: tuple[Path, str]) -> None:
    place, said = folder
    case = designed_case(place)
    assert case.samples == 400
    assert case.noise.level_rad == 3e-6
    torque = case.problem.torque
    assert torque.end_s == pytest.approx(60.0)
    times = case.sampling.over(torque.end_s)
    sample = case.sample.model.sample(case.parameters)
    clean = simulated_rotation(case.gripper, sample, torque, times, nonlinear=False)[0]
    # So soon after a step that arms are seen ringing; who fits it need not say so.
    assert case.problem.shows_inertia(times, clean, case.noise.level_rad)
    for quantity, bound in bounds_percent(case.problem, case.noise, case.parameters, times)[:4]:
        promised = re.search(rf"^  {quantity.label} .*\| (\S+) %$", said, re.MULTILINE)
        assert promised
        # In print it has two digits.
        assert float(promised[1]) == pytest.approx(bound, rel=0.06)
        assert bound < 50


@pytest.mark.parametrize("shape", ["ramps", "sinusoids"])
def test_a_study_takes_other_shapes_with_the_bounds_that_were_promised(
    shape: str, tmp_path: Path
) -> None:
    """What the plan promises of its own torque, the study finds from its file."""
    text = ASKED.replace(
        "candidates: 128", f"candidates: 128, shapes: [{shape}], shortest_step_s: 1.0e-4"
    )
    (tmp_path / "asked.yaml").write_text(text)
    said = StringIO()
    with redirect_stdout(said):
        assert design(tmp_path) == 0
    case = designed_case(tmp_path)
    times = case.sampling.over(case.problem.torque.end_s)
    for quantity, bound in bounds_percent(case.problem, case.noise, case.parameters, times)[:4]:
        promised = re.search(rf"^  {quantity.label} .*\| (\S+) %$", said.getvalue(), re.MULTILINE)
        assert promised
        assert float(promised[1]) == pytest.approx(bound, rel=0.06)
    page = (tmp_path / "out.html").read_text()
    assert re.search(rf"[1-9]\d* {shape[:-1]}", page)
    heads = {"ramps": ["to (nN m)"], "sinusoids": ["amplitude (nN m)", "frequency (Hz)"]}
    for name, columns in heads.items():
        assert all((f"<th>{column}</th>" in page) == (name == shape) for column in columns)
    largest = max(float(volts) for volts in re.findall(r"<td>[\d.]+ to ([\d.]+)</td>", page))
    assert largest <= float(voltage(case.actuator, 8e-9)) + 1e-3


MEMORY = "noise: {ar1: {share: 0.5, time_s: 0.01}, drift: false}, "


def test_noise_with_memory_is_said_and_its_bounds_are_those_promised(tmp_path: Path) -> None:
    """By a dense covariance matrix of the readings that a study takes from the file."""
    asked = ASKED.replace("readings: 400", f"{MEMORY}readings: 400")
    (tmp_path / "asked.yaml").write_text(asked)
    said = StringIO()
    with redirect_stdout(said):
        assert design(tmp_path) == 0
    words = "AR(1) of 0.01 s (50 %), white (50 %) noise of 3 µrad, offset fitted along."
    unknown = "how much better other readings of this torque may be is not known, as the noise has"
    assert words in said.getvalue()
    assert f"  {unknown} memory; the jaws press" in said.getvalue()
    page = (tmp_path / "out.html").read_text()
    assert words in page
    assert f"H{unknown[1:]} memory." in page
    case = designed_case(tmp_path)
    assert case.noise.ar1 == AR1(0.5, 0.01)
    measurement = case.block.measurement
    assert measurement.coloured
    assert measurement.fits_offset
    assert not measurement.fits_drift
    times = case.sampling.over(case.problem.torque.end_s)
    values = np.array([[case.parameters[name] for name in case.problem.searched.names]])
    rows = linear_responses(
        case.gripper, case.problem.searched, case.problem.torque, times, values, inertia=True
    )[0, 1:]
    covariance = 0.5 * (np.eye(400) + np.exp(-np.abs(times[:, None] - times) / 0.01)) * 9e-12
    rows = np.vstack((rows, 1e-6 * np.ones(400)))
    inverse = np.linalg.inv(rows @ np.linalg.solve(covariance, rows.T))
    for name, variance in zip(case.problem.searched.names, np.diag(inverse), strict=False):
        promised = re.search(rf"^  {name} .*\| (\S+) %$", said.getvalue(), re.MULTILINE)
        assert promised
        assert float(promised[1]) == pytest.approx(100 * variance**0.5, rel=0.06)


CAMERA = ASKED.replace("1.0e+5", "1.0e+3").replace("60.0", "20.0")
EXPOSED = CAMERA.replace("readings", "noise: {exposure_s: 1.0e-3}, readings")


def exposed_rows(case: Case, times: Array) -> Array:
    """Rotations and sensitivities as means over 1 ms by quadrature, (1 + n_parameters, n_times)."""
    nodes, weights = np.polynomial.legendre.leggauss(8)
    # Arms ring some times in a millisecond.
    parts = (np.arange(40)[:, None] + (nodes + 1) / 2).ravel() / 40
    instants = times[:, None] - 1e-3 * (1 - parts)
    values = np.array([[case.parameters[name] for name in case.problem.searched.names]])
    torque = torque_history(case.phases)
    rows = linear_responses(
        case.gripper, case.problem.searched, torque, instants.ravel(), values, inertia=True
    )[0]
    found: Array = rows.reshape(-1, *instants.shape) @ np.tile(weights / 80, 40)
    return found


def test_a_cameras_exposure_is_said_and_its_bounds_are_those_promised(tmp_path: Path) -> None:
    """By quadrature over each exposure; a study fits such readings, taken for instants they err."""
    (tmp_path / "asked.yaml").write_text(EXPOSED)
    said = StringIO()
    with redirect_stdout(said):
        assert design(tmp_path) == 0
    words = "white noise of 3 µrad, readings averaged over 0.001 s each."
    assert words in said.getvalue()
    assert words in (tmp_path / "out.html").read_text()
    case = designed_case(tmp_path)
    times = case.sampling.over(case.problem.torque.end_s)
    rotation, *rows = exposed_rows(case, times)
    inverse = np.linalg.inv(np.array(rows) @ np.array(rows).T / 9e-12)
    names = case.problem.searched.names
    for name, variance in zip(names, np.diag(inverse), strict=True):
        promised = re.search(rf"^  {name} .*\| (\S+) %$", said.getvalue(), re.MULTILINE)
        assert promised
        assert float(promised[1]) == pytest.approx(100 * variance**0.5, rel=0.06)

    def errors(problem: CaseProblem) -> Array:
        posed = problem.of(times, rotation, noise_rad=3e-6)
        settings = LeastSquaresSettings(candidates=500, starts=8)
        (found,) = identify_many([posed], settings, [np.random.default_rng(1)], silent)
        truth = [case.parameters[name] for name in names]
        return np.abs(np.log(found.parameters / truth)) / np.diag(inverse) ** 0.5

    assert errors(case.problem).max() < 0.01
    assert errors(replace(case.problem, phases=case.phases)).max() > 3


def test_earlier_traces_are_taken_for_white(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "asked.yaml").write_text(ASKED.replace("readings", f"{MEMORY}readings"))
    assert design(tmp_path, "--after", str(tmp_path / "trace.csv")) == 1
    assert "--after: takes noise for white; allowed is a block `design`" in capsys.readouterr().err


def test_seeds_on_it_come_as_close_as_promised(folder: tuple[Path, str]) -> None:
    """Twelve traces: a standard deviation of them is within a factor 2 with 99.8 %."""
    case = designed_case(folder[0])
    times = case.sampling.over(case.problem.torque.end_s)
    network = case.sample.model.sample(case.parameters)
    clean = simulated_rotation(case.gripper, network, case.problem.torque, times, nonlinear=False)
    problems = [
        case.problem.of(times, clean[0] + 3e-6 * stream(1, "d", s, "n").standard_normal(400))
        for s in range(12)
    ]
    rngs = [np.random.default_rng(seed) for seed in range(12)]
    found = identify_many(problems, LeastSquaresSettings(1000, 20), rngs, silent)
    names = case.problem.searched.names
    truth = np.array([case.parameters[name] for name in names])
    logs = np.log([each.parameters / truth for each in found])
    bounds = bounds_percent(case.problem, case.noise, case.parameters, times)[:4]
    for spread, (_, bound) in zip(np.sqrt(np.mean(logs**2, axis=0)), bounds, strict=True):
        assert 0.5 < 100 * spread / bound < 2


def test_the_page_needs_nothing_else(folder: tuple[Path, str]) -> None:
    page = (folder[0] / "out.html").read_text()
    assert "Liquid drop, case 2" in page
    assert not re.search(r'(src|href)="(?!data:|#)', page)
    assert page.count("<img") == 2


def test_the_same_again(folder: tuple[Path, str], tmp_path: Path) -> None:
    (tmp_path / "asked.yaml").write_text(ASKED)
    with redirect_stdout(StringIO()):
        assert design(tmp_path) == 0
    assert (tmp_path / "out.yaml").read_bytes() == (folder[0] / "out.yaml").read_bytes()


@pytest.mark.parametrize(("shortest_s", "unit_s"), [(None, 0.5), (0.1, 0.1), (5.0, 5.0)])
def test_a_slow_camera_is_asked_for_what_it_can_tell(
    shortest_s: float | None, unit_s: float, tmp_path: Path
) -> None:
    """Of 20 Hz: a design within its limits, c_p left out, the others as if it were known."""
    key = "" if shortest_s is None else f", shortest_step_s: {shortest_s}"
    (tmp_path / "asked.yaml").write_text(SLOW.replace("candidates: 128", f"candidates: 128{key}"))
    said = StringIO()
    with redirect_stdout(said):
        assert design(tmp_path) == 0
    case = designed_case(tmp_path, "cell")
    assert len(case.phases) <= 4
    lasting = np.array([phase.duration_s for phase in case.phases])
    assert lasting.sum() == pytest.approx(300.0)
    np.testing.assert_allclose(lasting / unit_s, np.round(lasting / unit_s), rtol=0, atol=1e-9)
    assert 0.99 * 2e-9 < max(phase.left.value_Nm for phase in case.phases) <= 2e-9
    times = case.sampling.over(case.problem.torque.end_s)
    assert len(times) == 2000
    assert np.diff(times).min() > 0.05 * (1 - 1e-9)
    assert presses(make_design_inputs(case), case.phases)
    lines = re.findall(r"^  (\w+) +(\S+) .*\| (\S+)", said.getvalue(), re.MULTILINE)
    promised = {name: percent for name, _, percent in lines}
    assert promised.pop("c_p") == "none"
    for place in (said.getvalue(), (tmp_path / "out.html").read_text()):
        assert "no torque that was tried determines it with readings at 20 Hz: c_p" in place
    # That c_p may be anything costs them little, and of plausible samples theirs is the worst.
    known = replace(case.problem, fixed={"c_p": 0.02})
    for quantity, bound in bounds_percent(known, case.noise, case.parameters, times)[:3]:
        assert 0.4 < bound / float(promised[quantity.label]) < 1.1
        assert bound < 1


def test_steps_are_by_default_as_long_as_ten_readings_of_a_slow_camera() -> None:
    for rate_Hz, unit_s in ((1e5, 0.01), (1e3, 0.01), (100.0, 0.1), (20.0, 0.5)):
        case = study_of(SLOW.replace("fastest_Hz: 20", f"fastest_Hz: {rate_Hz}")).cases["cell"]
        assert make_design_inputs(case).limits.shortest_s == pytest.approx(unit_s)


def seldom_sampled() -> Case:
    """The paper's protocol, with a tenth of its samples."""
    return study_of(f"{ASKED}measurement: {{rate_Hz: 1.0}}\n").cases["liquid_drop_2"]


def write_trace(case: Case, file: Path) -> Path:
    """Write a trace of a case, as its protocol and sampling have it."""
    times = case.sampling.over(case.problem.torque.end_s)
    network = case.sample.model.sample(case.parameters)
    clean = simulated_rotation(case.gripper, network, case.problem.torque, times, nonlinear=False)
    noise = 3e-6 * np.random.default_rng(0).standard_normal(len(times))
    columns = np.column_stack((times, clean[0] + noise))
    np.savetxt(file, columns, "%.12g", ",", header="time_s,rotation_rad", comments="")
    return file


def bounds_after(place: Path, *traces: str) -> dict[str, tuple[str, str]]:
    """Ask what is next after traces; bounds as printed, with the config's and the designed."""
    (place / "asked.yaml").write_text(
        ASKED.replace("candidates: 128", "candidates: 128, plausible_samples: 3")
    )
    said = StringIO()
    with redirect_stdout(said):
        assert design(place, *traces) == 0
    lines = re.findall(r"^  (k|k_p|c|c_p) +(\S+) .*\| (\S+)", said.getvalue(), re.MULTILINE)
    assert len(lines) == 4
    return {name: (before, after) for name, before, after in lines}


def test_after_a_trace(tmp_path: Path) -> None:
    """A trace as the paper's tells c + c_p and k_p; the next experiment tells them all.

    The same again would leave k, c and c_p without a bound.
    """
    trace = write_trace(seldom_sampled(), tmp_path / "trace.csv")
    bounds = bounds_after(tmp_path, "--after", str(trace))
    assert "none" not in [after for _, after in bounds.values()]
    assert bounds["c_p"][0] == "none"


def test_after_a_trace_of_the_study_and_one_that_was_designed(
    folder: tuple[Path, str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """What the designed one tells is known even if the study's experiment is done again.

    Read by the protocol that it was not recorded with, the same file is refused.
    """
    _take_one_torque(monkeypatch)
    first = write_trace(seldom_sampled(), tmp_path / "first.csv")
    second = write_trace(designed_case(folder[0]), tmp_path / "second.csv")
    over = str(folder[0] / "out.yaml")
    bounds = bounds_after(tmp_path, "--after", str(first), "--after", str(second), over)
    for name, bound in re.findall(r"^  (k|k_p|c|c_p) .*\| (\S+) %", folder[1], re.MULTILINE):
        # Of samples near the truth, by what a bound changes with them, and as printed.
        assert float(bounds[name][0]) < 1.5 * float(bound)
    assert design(tmp_path, "--force", "--after", str(second)) == 1
    assert "second.csv" in capsys.readouterr().err


def test_after_a_trace_with_columns_and_units_of_its_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same rotations in another file lead to the same design; what was added is allowed for."""
    _take_one_torque(monkeypatch)
    trace = write_trace(seldom_sampled(), tmp_path / "trace.csv")
    times, rotation = np.loadtxt(trace, delimiter=",", skiprows=1, unpack=True)
    bounds_after(tmp_path, "--after", str(trace))
    design_of_plain = (tmp_path / "out.yaml").read_bytes()

    def odd(rotation: Array) -> str:
        file, columns = tmp_path / "odd.csv", np.column_stack((1e3 * times, 1e6 * rotation))
        np.savetxt(file, columns, "%.12g", ";", header="t;phi_urad", comments="")
        return str(file)

    sensitivity = ["--time", "t", "--time-unit", "ms", "--rotation", "phi_urad"]
    bounds_after(tmp_path, "--after", odd(rotation), *sensitivity)
    assert (tmp_path / "out.yaml").read_bytes() == design_of_plain
    # Of an offset of 30 times the noise, and of a noise that is not the next experiment's.
    drifting = odd(rotation + 1e-4 + 1e-7 * times)
    assert design(tmp_path, "--after", drifting, *sensitivity) == 1
    bounds_after(tmp_path, "--after", drifting, *sensitivity, "--offset", "--drift")
    noisy = odd(rotation + 1.2e-5 * np.random.default_rng(1).standard_normal(len(times)))
    assert design(tmp_path, "--after", noisy, *sensitivity) == 1
    bounds_after(tmp_path, "--after", noisy, *sensitivity, "--noise", "1.2e-5")
    assert "level_rad: 3.0e-06" in (tmp_path / "out.yaml").read_text()


def test_an_earlier_trace_tells_as_much_as_its_weights_say(tmp_path: Path) -> None:
    """Information is a sum over readings, of squared finite differences over their variances."""
    case = seldom_sampled()
    trace = write_trace(case, tmp_path / "trace.csv")
    times, rotation = np.loadtxt(trace, delimiter=",", skiprows=1, unpack=True)
    sd_rad = np.where(times < 0.4 * times[-1], 3e-6, 3e-5)
    rotation += 2.9e-5 * (sd_rad > 1e-5) * np.random.default_rng(2).standard_normal(len(times))
    columns = np.column_stack((times, rotation, sd_rad))
    np.savetxt(trace, columns, "%.12g", ",", header="time_s,rotation_rad,sd_rad", comments="")
    earlier = estimate_from_recordings([Recorded(case, trace)], ReadAs(sd="sd_rad"), 0)

    def response(x: Array) -> Array:
        network = case.sample.model.network(np.exp(x)[None])
        return simulated_rotation(
            case.gripper, network, case.problem.torque, times, nonlinear=False
        )[0]

    steps = 1e-4 * np.eye(len(earlier.best))
    slopes = [(response(earlier.best + h) - response(earlier.best - h)) / 2e-4 for h in steps]
    expected = (slopes / sd_rad**2) @ np.transpose(slopes)
    np.testing.assert_allclose(
        earlier.information[0], expected, rtol=1e-3, atol=1e-5 * np.abs(expected).max()
    )


def test_weights_are_options_of_a_design(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A share of the rotation that is far too small refuses the trace; one that fits does not."""
    _take_one_torque(monkeypatch)
    trace = str(write_trace(seldom_sampled(), tmp_path / "trace.csv"))
    bounds_after(tmp_path, "--after", trace, "--noise", "3e-6", "--noise-share", "1e-4")
    tiny = ("--noise", "1e-7", "--noise-share", "1e-5")
    assert design(tmp_path, "--force", "--after", trace, *tiny) == 1
    assert "--noise-share" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("header", "more", "said"),
    [
        ("t,phi", [], "column 'time_s': found no such column, allowed are t, phi"),
        ("t,phi", ["--time", "t", "--rotation", "phi"], "column 't': found no unit, neither"),
        ("time_s,rotation_rad", ["--time-unit", "ms"], "found the unit 'ms' where the name says"),
        ("time_s,rotation_rad", ["--rotation-unit", "grad"], "--rotation-unit: found 'grad'"),
        ("time_s,rotation_rad", ["--noise", "0"], "--noise: found 0.0"),
        ("time_s,rotation_rad", ["--noise", "1.0e-7"], "2 times the noise of 1e-07 rad (--noise"),
    ],
)
def test_messages_on_traces_name_options_that_there_are(
    header: str, more: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    trace = write_trace(seldom_sampled(), tmp_path / "trace.csv")
    trace.write_text(trace.read_text().replace("time_s,rotation_rad", header))
    (tmp_path / "asked.yaml").write_text(
        ASKED.replace("candidates: 128", "candidates: 128, plausible_samples: 3")
    )
    assert design(tmp_path, "--after", str(trace), *more) == 1
    error = capsys.readouterr().err
    assert said in error
    assert "under measurement" not in error
    with pytest.raises(SystemExit):
        main(["design", "--help"])
    options = re.findall(r"--[a-z][a-z-]*", capsys.readouterr().out)
    assert set(re.findall(r"--[a-z][a-z-]*", error)) <= set(options)


def one_torque(inputs: DesignInputs) -> Torque:
    """Any torque; a search takes seconds."""
    shares = np.array([0.5, 0.3, 0.6, 0.5, 1.0, 1.0, 0.6, 0.6, 0.8])
    return Rater(inputs).torque(SHAPES["steps"].waveform(shares, inputs.limits))


def _take_one_torque(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(within_reach, "best_torques", lambda inputs, *_: [one_torque(inputs)])
    monkeypatch.setattr(within_reach, "climb", lambda inputs, torques, *_: list(torques))


@pytest.mark.parametrize(
    ("config", "more", "said"),
    [
        (ASKED, ["--after", "no.csv"], "no.csv"),
        ("seeds: 2\n", [], "no case has a block `design`"),
        (ASKED, ["--case", "liquid_drop_3"], "found no case 'liquid_drop_3'"),
        (
            ASKED.replace("largest_torque_Nm: 8.0e-9, ", ""),
            [],
            "found none, allowed is one of largest_torque_Nm and largest_voltage_V.",
        ),
        (
            ASKED.replace("candidates: 128", "largest_voltage_V: 20.0"),
            [],
            "found largest_torque_Nm and largest_voltage_V, allowed is one of",
        ),
        (
            ASKED.replace("candidates: 128", "quantities: [k, q]"),
            [],
            "found 'q', allowed are k, k_p",
        ),
        (ASKED.replace("candidates: 128", "ranges: {c: [2.0, 1.0]}"), [], "the lower one first"),
        (ASKED.replace("candidates: 128", "shapes: [step]"), [], "Did you mean 'steps'"),
        (
            ASKED.replace(
                "candidates: 128", "noise: {flicker: {share: 0.1}}, readings: 60000"
            ).replace("readings: 400, ", ""),
            [],
            "found 60000, allowed are at most 50000 with noise that has memory",
        ),
        (
            ASKED.replace(
                "candidates: 128",
                "noise: {ar1: {share: 0.7, time_s: 1.0}, flicker: {share: 0.7}}",
            ),
            [],
            "found 1.4 with that of ar1, allowed is at most 1 together",
        ),
        (
            ASKED.replace(
                "candidates: 128",
                "noise: {flicker: {share: 0.7}}, ranges: {k: [1, 2]}, "
                "sequence: {cells: 2, experiments: 2}",
            ),
            [],
            "takes noise for white and readings of instants; leave it out with noise that has",
        ),
        (
            EXPOSED.replace(
                "candidates: 128", "ranges: {k: [1, 2]}, sequence: {cells: 2, experiments: 2}"
            ),
            [],
            "leave it out with noise that has memory or an exposure",
        ),
        (
            EXPOSED.replace("1.0e-3}", "2.0e-3}"),
            [],
            "found 0.002, allowed is at most the time between readings, 0.001 s",
        ),
        (
            EXPOSED + "protocol: {phases: [{duration_s: 9, voltage_V: 1, to_voltage_V: 2}]}\n",
            [],
            "is a ramp of the voltage, of whose torque no means are known; leave it out",
        ),
        (
            ASKED.replace("candidates: 128", "shapes: [ramps], shortest_step_s: 20.0"),
            [],
            "at least four ramps, 80 s",
        ),
        (
            ASKED.replace("candidates: 128", "shortest_step_s: 1.0e-6"),
            [],
            "at least two samples long",
        ),
        (
            SLOW.replace("longest_s: 300", "longest_s: 0.8"),
            [],
            "at least two steps, 1 s, or a shortest_step_s of at most 0.4.",
        ),
        (
            SLOW.replace("longest_s: 300", "longest_s: 0.08"),
            [],
            "at least two steps, 1 s, or a fastest_Hz of at least 50.",
        ),
        (
            SLOW.replace("candidates: 128", "candidates: 128, quantities: [c_p]"),
            [],
            "no torque of steps with which readings at 20 Hz tell c_p, even to a factor of e to "
            "the 10; allowed are faster readings (`fastest_Hz`)",
        ),
        (ASKED, ["--offset"], "found options of a trace, allowed are these with --after only"),
        (
            f"{ASKED}cases: {{liquid_drop_2: {{sample: {{c_p: 0.0}}}}}}\n",
            [],
            "found c_p = 0, allowed is a range of it",
        ),
    ],
)
def test_what_cannot_be_designed(
    config: str, more: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "asked.yaml").write_text(config)
    assert design(tmp_path, *more) == 1
    error = capsys.readouterr().err
    assert said in error
    assert "Traceback" not in error
    assert not (tmp_path / "out.yaml").exists()


def test_others_files_are_left_alone(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "asked.yaml").write_text(ASKED)
    (tmp_path / "out.yaml").write_text("mine\n")
    assert design(tmp_path) == 1
    assert "biogrip did not write it" in capsys.readouterr().err
    assert (tmp_path / "out.yaml").read_text() == "mine\n"


def test_what_is_asked_is_what_is_wanted() -> None:
    more = "largest_voltage_V: 20.0, quantities: [c_p, k], criterion: A, over: mean"
    text = ASKED.replace("largest_torque_Nm: 8.0e-9", more)
    case = study_of(text).cases["liquid_drop_2"]
    inputs = make_design_inputs(case)
    assert inputs.largest_Nm == pytest.approx(float(torque(case.actuator, 20.0)))
    assert (inputs.criterion.name, inputs.criterion.over) == ("A", "mean")
    assert inputs.criterion.targets == (3, 0)
    assert inputs.stroke_rad == pytest.approx(np.radians(4.5))
    # A sample that is touched leaves less of the stroke.
    sized = study_of(f"{text}cases: {{liquid_drop_2: {{sample: {{size_m: 1.0e-4}}}}}}\n")
    assert make_design_inputs(sized.cases["liquid_drop_2"]).stroke_rad < 0.9 * inputs.stroke_rad


def test_plausible_samples_fill_their_ranges() -> None:
    ranges = "{k: [1.0, 100.0], c: [10.0, 20.0]}"
    text = ASKED.replace(
        "candidates: 128", f"candidates: 128, plausible_samples: 20, ranges: {ranges}"
    )
    case = study_of(text).cases["liquid_drop_2"]
    targets = case.block.design
    assert targets is not None
    drawn = plausible(case, targets)
    assert drawn.shape == (20, 4)
    np.testing.assert_allclose(drawn[:, 1], 1e-4)
    for column, low, high in ((0, 1.0, 100.0), (2, 10.0, 20.0)):
        place = np.log(drawn[:, column] / low) / np.log(high / low)
        assert np.all((place > 0) & (place < 1))
        # Halton's sequence has one in nearly every tenth.
        assert len(np.unique(np.floor(10 * place))) >= 9


def test_where_traces_tell_nothing_parameters_lie_within_both_ranges() -> None:
    """Of what is asked, what is searched: k up to 9.9e7 N/m, dampers up to 9.9e4 N s/m."""
    ranges = "{k: [1.0e-6, 1.0e+12], k_p: [2.0, 3.0], c: [5.0, 1.0e+7]}"
    text = ASKED.replace("candidates: 128", f"candidates: 128, ranges: {ranges}")
    low, high = plausible_ends(study_of(text).cases["liquid_drop_2"])
    np.testing.assert_allclose(np.exp(low), [1.1e-4, 2.0, 5.0, 1.1e-5], rtol=1e-9)
    np.testing.assert_allclose(np.exp(high), [9.9e7, 3.0, 9.9e4, 9.9e4], rtol=1e-9)


@pytest.mark.parametrize(
    ("bursts", "said"),
    [
        (
            "[{from_s: 1.0, rate_Hz: 10.0, samples: 20}, {from_s: 2.0, rate_Hz: 1.0, samples: 5}]",
            "allowed is after 2.9",
        ),
        ("[{from_s: 399.0, rate_Hz: 10.0, samples: 20}]", "at most until 400.0 s"),
        ("[{from_s: 1.0, rate_Hz: 10.0, samples: 2}]", "found 2 samples"),
    ],
)
def test_bursts_that_cannot_be(
    bursts: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = ASKED.replace("only:", f"measurement: {{bursts: {bursts}}}\nonly:")
    (tmp_path / "asked.yaml").write_text(text)
    assert design(tmp_path) == 1
    assert said in capsys.readouterr().err
