"""`biogrip identify`: one recorded trace from file to verdicts, and what is wrong with bad ones."""

import json
import os
import pty
import shutil
import signal
import subprocess
import sys
from contextlib import redirect_stderr, suppress
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml

from biogrip.arrays import Array
from biogrip.cli import _parser, main
from biogrip.command.outputs import WRITTEN_BY, check_output
from biogrip.command.settings import Asked, Setting, case_of
from biogrip.command.words import for_a_paper, in_columns, noise_in_words
from biogrip.errors import BiogripError
from biogrip.judging.doubts import REJECTION
from biogrip.judging.onset import notes_on_start
from biogrip.physics.models import CANDIDATES
from biogrip.study.source import HOLD
from biogrip.terminal import QUIET
from tests.helpers.identified import by_quantity, identified, identify, told
from tests.helpers.places import EXAMPLE, EXAMPLE_TRUTH
from tests.helpers.problems import clean

EXPORT = Path(__file__).parent / "traces/files/anton_paar_intervals.utf16.csv"
TRUTH = yaml.safe_load(EXAMPLE_TRUTH.read_text())["cases"]["example"]


@pytest.fixture(scope="module")
def example(tmp_path_factory: pytest.TempPathFactory) -> tuple[str, dict[str, Any]]:
    output = tmp_path_factory.mktemp("example") / "found.json"
    status, said, complained = identify(EXAMPLE, "--output", output)
    assert status == 0, complained
    return said, json.loads(output.read_text())


def test_the_example_gives_its_truth(example: tuple[str, dict[str, Any]]) -> None:
    said, found = example
    quantities = by_quantity(found)
    truth = {name: value for name, value in TRUTH["sample"].items() if name != "model"}
    truth["c + c_p"] = truth["c"] + truth["c_p"]
    for name in ("k", "k_p", "c", "c + c_p"):
        item = quantities[name]
        assert item["verdict"] == "determined"
        # Three standard deviations on either side of the estimate.
        low, high = (item["value"] * (item[end] / item["value"]) ** 1.5 for end in ("low", "high"))
        assert low < truth[name] < high
        assert f"{name:<7}  {item['in_words']}" in said
        # Five digits are written, or more where rounding to fewer would differ.
        assert item["value"] == pytest.approx(float(f"{item['value']:.5g}"), rel=1e-5)
    assert quantities["c_p"]["verdict"] == "bounded above"
    assert quantities["c_p"]["high"] > truth["c_p"]
    assert found["noise_rad"] == pytest.approx(0.05 * 6.7e-5, rel=0.3)
    assert found["notes"] == []
    assert "read_as" not in found
    assert set(found["versions"]) == {"biogrip", "numpy", "scipy"}
    assert found["by_default"] == ["gripper", "protocol"]


def test_a_declared_offset_and_drift_are_fitted_along() -> None:
    times, response = clean("liquid_drop_2")
    values = response + 0.05 * response.max() * np.random.default_rng(0).standard_normal(401)
    found = told(times, values + 5e-4 + 1e-6 * times, offset=True, drift=True)
    # Both are known to some per cent of the rotation.
    assert found.data["offset_rad"] == pytest.approx(5e-4, abs=1e-4)
    assert found.data["drift_rad_per_s"] == pytest.approx(1e-6, abs=1e-6)
    assert "χ² falls" not in str(found)


@pytest.mark.parametrize(
    ("options", "config"),
    [
        ("--start fit --start -1e1 --no-drift", {"start_s": -10.0, "drift": False}),
        ("--start 3 --set measurement.fit_start=true --until 9", {"fit_start": True, "until_s": 9}),
        ('--set measurement={"noise_share":5e-2} --from 2', {"noise_share": 0.05, "from_s": 2}),
        (
            "--reading strain=e --reading rotation_rad --sd s --set measurement.block=2",
            {"sd": "s", "block": 2},
        ),
        ("--offset --no-offset --noise 1e-6", {"offset": False, "noise_rad": 1e-6}),
    ],
)
def test_options_are_keys_of_the_config_and_the_last_one_counts(
    tmp_path: Path, options: str, config: dict[str, Any]
) -> None:
    (tmp_path / "same.yaml").write_text(yaml.safe_dump({"measurement": config}))
    given = _parser().parse_args(["identify", "a.csv", *options.split(" ")]).settings
    model = Setting("--model", ("sample", "model"), "generalized_maxwell_2")
    settings = [model, *(Setting(*each) for each in given)]
    by_options = case_of(Asked(EXAMPLE, None, tuple(settings)))
    assert by_options.block == case_of(Asked(EXAMPLE, tmp_path / "same.yaml", (model,))).block
    assert by_options.sample.candidate == "generalized_maxwell_2"


def test_what_is_recognised_in_an_export_is_said_unless_quiet(
    tmp_path: Path, few: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    trace = Path(shutil.copy(EXPORT, tmp_path / "gel.csv"))
    command: list[str | Path] = [trace, "--config", few, "--time", "Time", "--start", "24"]
    command += ["--model", "maxwell"]
    command += ["--reading", "modulus=Relaxation Modulus", "--set", "measurement.block=3"]
    status, _, said = identify(*command)
    assert status == 0
    assert "gel.csv is read as\n  encoding     UTF-16\n  separator    tabs\n" in said
    assert "\n  modulus      Relaxation Modulus, in kPa\n" in said
    assert json.loads((tmp_path / "gel.identified.json").read_text())["read_as"]["block"] == 3
    monkeypatch.setenv(QUIET, "1")
    assert identify(*command)[2] == ""


def test_what_was_held_is_stated_once(tmp_path: Path) -> None:
    (ramp := tmp_path / "ramp.yaml").write_text("protocol: {phases: []}")
    held = Setting("--hold", HOLD, 3e-9)
    load = Setting("t.tsv", ("measurement", "load"), "torque_Nm")
    other = Setting("t.tsv", ("protocol",), {"phases": [{"duration_s": 9.0, "torque_Nm": 1e-9}]})
    for config, settings, beside in (
        (None, (held, load), "measurement.load"),
        (None, (load, held), "measurement.load"),
        (None, (other, held), "protocol"),
        (ramp, (held,), f"protocol of {ramp}"),
    ):
        with pytest.raises(BiogripError) as error:
            case_of(Asked(EXAMPLE, config, settings, "t.tsv, line 2"))
        said = f"t.tsv, line 2: found --hold and {beside}; allowed is one of them."
        assert str(error.value) == said


@pytest.mark.parametrize("floor", [0.1, 0.0])
def test_known_deviations_are_weights_of_the_fit(floor: float) -> None:
    """As a column, or as a share of a smooth course."""
    times = np.arange(1.0, 101.0)
    values = 100 * np.exp(-times / 50)
    sd = 0.04 * values + floor
    given: dict[str, Any] = {"config": {"measurement": {"noise_share": 0.04}}}
    given = {"sd": sd} if floor else given
    found = told(times, values, reads="modulus", model="maxwell", **given).diagnosis.recording
    assert found is not None
    assert found.sd is not None
    # A smooth course is less sure of at its ends.
    np.testing.assert_allclose(found.sd[10:-10], sd[10:-10], rtol=0.02)


# Arguments of `identify`, and what is said of them.
OPTIONS = {
    "--noise nan": "--noise: measurement.noise_rad: found 'nan', allowed is a number.",
    "--noise-model coloured --noise 1e-6": "--noise: measurement.noise_rad: is that of white noise",
    "--sd sd_rad --noise 1e-6": "--noise: measurement.noise_rad: does not go with sd",
    "--set measurement.time_unit=ns": "--set: measurement.time_unit: found 'ns'. Allowed: s, ms",
    '--set protocol.phases=[{"duration_s":0}]': "--set: protocol.phases[0].duration_s: found 0",
    "--fix k=0": "--fix: fixed.k: found 0, allowed is at least 1e-18 and at most 1e+12 N/m.",
    "--fix kp=1": "--fix: fixed.kp: is no parameter of the sample, which has k, k_p, c, c_p. Did",
    "--sd sd": "there is no column 'sd'. The file has: time_s, rotation_rad.",
    "--reading strian=x": "--reading: measurement.strian: unknown key. Did you mean 'strain'?",
    "--reading strain=x": "--hold: is missing; allowed is the stress in Pa that was held",
    "--reading strain=rotation_rad --hold 1e99": "phases[0].stress_Pa: found 1e+99, allowed is",
    "--reading modulus=x --set measurement.reading_unit=mm": "found 'mm', allowed are Pa, kPa",
    "--reading strain=x --set instrument=relaxation --set "
    'protocol.phases=[{"duration_s":5,"strain":1}]': "measurement.strain: is not what relaxation",
    "--time=": "--time: measurement.time: found '' of 0 characters, allowed are at least 1.",
    f"--config {'x' * 300}": "File name too long",
    "--report theirs.html": "biogrip did not write it",
    "--report x.html --csv x.html": "to be written twice",
}
WRITTEN = {
    "a.csv": "a.csv: is read; allowed is another file to write.",
    "link.csv": "link.csv: is read; allowed is another file to write.",
    "b.csv": "b.csv: is there, and biogrip did not write it; allowed is another name",
    "link.json": "link.json: is there, and biogrip did not write it; allowed is another name",
    ".": "cannot be written; allowed is a file in a folder that you may write to.",
    "nowhere/x.json": "cannot be written; allowed is a file in a folder that you may write",
    "x" * 250: "cannot be written: File name too long.",
    "x" * 300 + "/a.json": "cannot be written; allowed is a file in a folder that you may",
}
# Of a pipe that nobody writes to, reading would wait without end.
PIPES = [
    "identify pipe",
    "identify a.csv --config pipe",
    "identify a.csv --output pipe",
    f"identify a.csv --csv {os.devnull}",
    "identify table.csv --config pipe",
    "groups pipe --by dish",
    "design pipe",
]
REFUSED = {
    **{f"identify a.csv {options}": said for options, said in OPTIONS.items()},
    **{f"identify a.csv --output {name}": said for name, said in WRITTEN.items()},
    **{f"identify a.csv --csv {name}": said for name, said in WRITTEN.items()},
    **dict.fromkeys(PIPES, "no regular file; allowed is one."),
    "identify .": "TRACE: found '.', which is no regular file; allowed is one.",
    "identify tabel.csv": "there is no file tabel.csv in /",
    f"identify {'x/' * 3000}": "there is no file x/x/",
    "identify a.csv b.csv --output x.json": "--output: only for one trace",
    "identify table.csv --output x.json": "--output: only for one trace",
    "identify table.csv --csv a.csv": "a.csv: is read; allowed is another file to write.",
    "identify a.csv b.csv --config bad.yaml": "bad.yaml, line 1: seedz: unknown key",
}


@pytest.mark.parametrize("arguments", REFUSED, ids=lambda text: text[:50])
def test_what_cannot_be_used_is_named_once_and_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: str
) -> None:
    """Before anything is written."""
    monkeypatch.chdir(tmp_path)
    for name in ("a.csv", "b.csv"):
        shutil.copy(EXAMPLE, name)
    Path("table.csv").write_text("file,dish\na.csv,left\n")
    Path("theirs.html").write_text("<p>mine</p>")
    Path("bad.yaml").write_text("seedz: 3")
    Path("link.csv").symlink_to("a.csv")
    Path("link.json").symlink_to("b.csv")
    os.mkfifo("pipe")
    before = {path: path.is_fifo() or path.read_bytes() for path in Path().iterdir()}
    with redirect_stderr(StringIO()) as said:
        assert main(arguments.split()) == 1
    error = said.getvalue()
    assert error.startswith("biogrip: ")
    assert REFUSED[arguments] in error
    assert error.count("\n") == 1
    assert len(error) < 600
    assert {path: path.is_fifo() or path.read_bytes() for path in Path().iterdir()} == before


@pytest.mark.parametrize(
    ("option", "text", "said"),
    [
        *(("--fix", text, "allowed is NAME=VALUE") for text in ("k", "k=much", "=1")),
        *(("--set", text, "allowed is KEY=VALUE") for text in ("k", "=1")),
        ("--start", "soon", "found 'soon', allowed is a number of seconds, or fit"),
        ("--hold", "0", "allowed is a number, and not 0"),
        *(("--hold", text, "allowed is a number, or one with") for text in ("nan", "much")),
        ("--hold", "-5,0%", "a decimal comma? Allowed is a point"),
        ("--set", "a.b=[1", "a.b: not valid YAML: "),
        ("--set", "a.b=1:30", "a.b: found 1:30, which YAML reads in base 60"),
    ],
)
def test_text_that_is_no_value_of_an_option_is_refused(option: str, text: str, said: str) -> None:
    with redirect_stderr(StringIO()) as error, pytest.raises(SystemExit):
        main(["identify", "trace.csv", option, text])
    assert said in error.getvalue()


@pytest.mark.nightly
def test_nobody_reading_progress_is_no_error(tmp_path: Path, few: Path) -> None:
    reader, writer = os.pipe()
    os.close(reader)
    said_at_once = "import sys; from biogrip import cli, terminal; terminal._EVERY_S = 0.0; "
    command = [sys.executable, "-c", f"{said_at_once}sys.exit(cli.main(sys.argv[1:]))"]
    given = ["identify", EXAMPLE, "--config", few, "--output", tmp_path / "f.json"]
    command += map(str, given)
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=writer, text=True, check=False)
    os.close(writer)
    assert (done.returncode, done.stdout) == (128 + signal.SIGPIPE, "")


def test_a_table_is_known_as_ours_by_the_end_of_a_long_header(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(f"{'k value (N/m),' * 1000}{WRITTEN_BY}\n")
    check_output(tmp_path / "a.csv")


def test_a_trace_whose_fit_fails_costs_no_other_its_result(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A fault of ours, here of a test that only adds notes: a row says why, alone one message."""
    good, bad = Path(shutil.copy(EXAMPLE, tmp_path / "good.csv")), tmp_path / "bad.csv"
    bad.write_text("".join(EXAMPLE.read_text().splitlines(keepends=True)[:200]))

    def fails(problem: Any, time_s: Array, *given: Any, **more: Any) -> Any:
        if len(time_s) < 200:
            raise ValueError("min() arg is an empty sequence")
        return notes_on_start(problem, time_s, *given, **more)

    monkeypatch.setattr("biogrip.identify.identify.notes_on_start", fails)
    table, options = tmp_path / "found.csv", ("--no-compare", "--model", "liquid_drop")
    status, said, error = identify(bad, good, "--csv", table, *options)
    assert (status, "Traceback" in error) == (1, False)
    assert f"{bad}: the fit failed" in said
    rows = pd.read_csv(table, keep_default_na=False)
    assert rows["trace"].tolist() == [str(bad), str(good)]
    assert rows["fit"].tolist() == ["failed", "ok"]
    assert "ValueError: min() arg is an empty sequence" in rows.loc[0, "failed"]
    assert rows.loc[1, "failed"] == ""
    assert good.with_suffix(".identified.json").exists()
    assert not bad.with_suffix(".identified.json").exists()
    status, _, error = identify(bad, *options)
    assert status == 1
    assert "the fit failed, which is a fault of biogrip" in error


EVERYTHING = """
study_seed: 7
least_squares: {candidates: 60, starts: 3}
identifiability: {confidence: 0.9}
model_selection: {models: [damper, maxwell]}
gripper: {uncertainty: {torque_percent: 1.0}}
protocol: {phases: [{duration_s: 200, torque_Nm: 1.6e-9}, {duration_s: 200, torque_Nm: 0.32e-9}]}
"""


def test_all_that_is_assumed_repeats_it(tmp_path: Path) -> None:
    """Every byte of the answer, without any option but the model's."""
    config, told = EVERYTHING, []
    options = "--model liquid_drop --offset --fix c=77 --noise 3.6e-6 --from 1"
    arguments = tuple(options.split())
    for _ in range(2):
        data = identified(tmp_path, EXAMPLE, *arguments, config=config)
        data.pop("by_default")
        data.pop("digest")
        told.append(json.dumps(data))
        assumed = data["assumed"]
        arguments = ("--model", assumed.pop("model"))
        config = yaml.safe_dump(assumed)
    assert told[0] == told[1]


def test_simpler_and_richer_models_are_held_against_the_chosen_one(
    example: tuple[str, dict[str, Any]],
) -> None:
    """The example is of a drop with a membrane; its parallel damper does not show."""
    said, found = example
    assert "A simpler model, Maxwell liquid drop with membrane stiffness (--model liquid_" in said
    tried = [row["model"] for row in found["models"]]
    assert tried[-2:] == ["fractional_kelvin_voigt", "fractional_maxwell"]
    assert sum(CANDIDATES[name].model.power_law for name in tried) == 2
    assert said.count("97.5 %") == 1
    assert "generalized_maxwell_3" in tried


def test_advice_is_given_of_a_rejected_fit_alone(example: tuple[str, dict[str, Any]]) -> None:
    rejected = {"fit": "rejected", "notes": [{"weight": REJECTION, "text": "It is wrong."}]}
    found = example[1] | {"advice": "Try another."}
    lines = in_columns([found | rejected, found], {}).splitlines()
    assert [line for line in lines if "Try" in line] == [f"{EXAMPLE}: Try another."]
    assert f"{EXAMPLE}: rejected: It is wrong." in lines


def test_colours_are_not_for_all_terminals(
    example: tuple[str, dict[str, Any]], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert "\x1b" not in example[0]
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True, raising=False)
    monkeypatch.setenv("NO_COLOR", "1")
    assert "\x1b" not in in_columns([example[1]], {})


def test_a_terminal_sees_every_phase_and_colours(tmp_path: Path, few: Path) -> None:
    screen, terminal = pty.openpty()
    command = [sys.executable, "-m", "biogrip", "identify", str(EXAMPLE), "--config", str(few)]
    command += ["--output", str(tmp_path / "found.json")]
    environment = {name: value for name, value in os.environ.items() if name != "NO_COLOR"}
    with subprocess.Popen(command, stdout=terminal, stderr=terminal, env=environment) as running:
        os.close(terminal)
        shown = b""
        # Whoever reads a terminal that is closed at the other end is told so by an error.
        with suppress(OSError):
            while more := os.read(screen, 65536):
                shown += more
    os.close(screen)
    assert running.returncode == 0
    said = shown.decode()
    for phase in ("fitting 801 samples", "finding confidence limits", "trying other sample models"):
        assert phase in said
    # The line of the phases is gone before anything is told.
    assert "\r\x1b[K" in said.split(str(EXAMPLE))[-2]
    assert "\x1b[32mdetermined: " in said
    assert "\x1b[33monly bounded above" in said


@pytest.mark.parametrize(
    ("fit", "value", "said"),
    [
        ("ok", 35.0, r"$c + c_{p} = 35\,\mathrm{N\,s/m}$ (95\,\% "),
        ("ok", 2e-9, r"$c + c_{p} = 2 \times 10^{-9}\,\mathrm{N\,s/m}$ (95\,\% "),
        ("doubtful", 35.0, None),
        ("rejected", 35.0, None),
    ],
)
def test_only_what_can_be_published_is_said_for_a_paper(
    fit: str, value: float, said: str | None
) -> None:
    both = {"quantity": "c + c_p", "symbol": "$c + c_{p}$", "unit": "N s/m", "value": value}
    both |= {"low": 1e-9, "high": 40.0, "provided": "it relaxes"}
    ends = [{"low": None}, {"high": None}, {"low": None, "high": None}]
    quantities = [both, *(both | own | {"provided": None} for own in ends)]
    lines = for_a_paper({"fit": fit, "confidence": 0.95, "quantities": quantities})
    assert len(lines) == 3 * (said is not None)
    for text, latex in lines[:1]:
        assert latex.startswith(str(said))
        assert text.endswith(
            "N s/m (95 % profile-likelihood interval 1e-09 to 40, n = 1 trace, provided it relaxes)"
        )
        ending = r"interval $1 \times 10^{-9}$ to $40$, $n = 1$ trace, provided it relaxes)"
        assert latex.endswith(ending)
    assert [text for text, _ in lines[1:]] == [
        "c + c_p < 40 N s/m (97.5 % one-sided limit, n = 1 trace)",
        "c + c_p > 1e-09 N s/m (97.5 % one-sided limit, n = 1 trace)",
    ] * bool(lines)


def test_noise_is_named_by_who_says_what_it_is() -> None:
    for fit, modelled, given, said in (
        ("ok", False, {"sd": None}, "noise by the scatter of neighbours"),
        ("rejected", False, {}, "noise by the scatter of neighbours"),
        ("ok", True, {}, "noise as modelled"),
        ("rejected", True, {}, "noise that cannot be told from misfit"),
        ("ok", False, {"noise_rad": 1e-6}, "noise as given"),
    ):
        found = {"fit": fit, "noise_model": modelled, "assumed": {"measurement": given}}
        assert noise_in_words(found) == said
