import json
import os
import pty
import shutil
import signal
import subprocess
import sys
from contextlib import redirect_stderr
from importlib import import_module
from io import StringIO
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
import pandas as pd
import PIL.Image
import pytest
import yaml

from biogrip.cli import _parser, main
from biogrip.command.options import Setting
from biogrip.command.outputs import WRITTEN_BY, Outcome, table_of
from biogrip.command.settings import Asked, case_of
from biogrip.command.words import in_columns, noise_in_words
from biogrip.config.source import HOLD
from biogrip.errors import BiogripError
from biogrip.judging.doubts import REJECTION
from biogrip.physics.models import CANDIDATES
from tests.generated_docs import example
from tests.helpers.identified import FEW, by_quantity, identified, identify, told, write_drop
from tests.helpers.places import EXAMPLE, EXAMPLE_TRUTH, ROOT
from tests.helpers.problems import clean


def test_the_example_gives_its_truth() -> None:
    """What is printed of it stands in the tutorial."""
    said, found = example()
    quantities = by_quantity(found)
    truth = yaml.safe_load(EXAMPLE_TRUTH.read_text())["cases"]["example"]["sample"]
    truth["c + c_p"] = truth["c"] + truth["c_p"]
    for name in ("k", "k_p", "c", "c + c_p"):
        item = quantities[name]
        # Three standard deviations on either side of the estimate.
        low, high = (item["value"] * (item[end] / item["value"]) ** 1.5 for end in ("low", "high"))
        assert low < truth[name] < high
        # Five digits are written, or more where rounding to fewer would differ.
        assert item["value"] == pytest.approx(float(f"{item['value']:.5g}"), rel=1e-5)
    assert quantities["c_p"]["high"] > truth["c_p"]
    # It is of a drop with a membrane; its parallel damper does not show.
    assert "A simpler model, Maxwell liquid drop with membrane stiffness (--model liquid_" in said
    assert said.count("97.5 %") == 1
    assert found["noise_rad"] == pytest.approx(0.05 * 6.7e-5, rel=0.3)
    assert found["notes"] == []
    assert "read_as" not in found
    assert set(found["versions"]) == {"biogrip", "numpy", "scipy"}
    assert found["by_default"] == ["gripper", "protocol"]
    header, (row,) = table_of(Outcome([found], {}, copied={found["trace"]: {}}))
    assert row[header.index("preferred_model")] == found["preferred_model"] == "liquid_drop"
    # Of any linear sample levels and exponents alone.
    assert "K(10 s) value (N/m)" in header
    assert not [name for name in header if "rad/s" in name]


@pytest.mark.nightly
def test_models_are_spared_that_cannot_suit_the_trace_better(tmp_path: Path) -> None:
    """Named in the config, all are fitted: those that were spared change nothing that is said."""
    few = "least_squares: {candidates: 100, starts: 4}"
    usual = identified(tmp_path, EXAMPLE, config=few)
    kept, spared = [row["model"] for row in usual["models"]], usual["models_spared"]
    assert kept == ["damper", "kelvin_voigt", "maxwell", "liquid_drop", "generalized_maxwell"]
    titles = {each.model.title: name for name, each in CANDIDATES.items()}
    named = [*kept, *(titles[title] for title in spared)]
    assert {"burgers", "generalized_maxwell_3", "fractional_maxwell"} < {*named}
    every = identified(tmp_path, EXAMPLE, config=FEW.replace("damper, maxwell", ", ".join(named)))
    assert every["models_spared"] == []
    assert [row["model"] for row in every["models"]] == named
    assert every["models"][: len(kept)] == usual["models"]
    assert min(row["delta_bic"] for row in every["models"][len(kept) :]) > 0
    assert every["advice"] == usual["advice"]


def test_a_declared_offset_and_drift_are_fitted_along() -> None:
    times, response = clean("liquid_drop_2")
    values = response + 0.05 * response.max() * np.random.default_rng(0).standard_normal(401)
    found = told(times, values + 5e-4 + 1e-6 * times, offset=True, drift=True)
    assert found.data["offset_rad"] == pytest.approx(5e-4, abs=1e-4)
    assert found.data["drift_rad_per_s"] == pytest.approx(1e-6, abs=1e-6)
    assert "χ² falls" not in str(found)
    few, clear = times[::4], (response + 5e-4 + 1e-6 * times)[::4]
    begun_s = process_time()
    exact = told(few, clear, offset=True, drift=True, model="liquid_drop").data
    # A trace without noise is not fitted again and again, a little lower each time: 33 s.
    assert process_time() - begun_s < 10
    assert exact["drift_rad_per_s"] == pytest.approx(1e-6, rel=1e-3)
    assert exact["offset_rad"] == pytest.approx(5e-4, rel=1e-3)


def test_options_are_keys_of_the_config_and_the_last_one_counts(tmp_path: Path) -> None:
    for options, config in (
        ("--start fit --start -1e1 --no-drift", "start_s: -10.0, drift: false"),
        ("--start 3 --set measurement.fit_start=true --until 9", "fit_start: true, until_s: 9"),
        ('--set measurement={"noise_share":5e-2} --from 2', "noise_share: 0.05, from_s: 2"),
        ("--reading strain=e --reading rotation_rad --sd s", "sd: s"),
        ("--offset --no-offset --noise 1e-6", "offset: false, noise_rad: 1.0e-6"),
    ):
        (same := tmp_path / "same.yaml").write_text(f"measurement: {{{config}}}")
        given = _parser().parse_args(["identify", "a.csv", *options.split(" ")]).settings
        model = Setting("--model", ("sample", "model"), "generalized_maxwell_2")
        by_options, _ = case_of(Asked(EXAMPLE, None, (model, *given)))
        assert by_options.block == case_of(Asked(EXAMPLE, same, (model,)))[0].block
        assert by_options.sample.candidate == "generalized_maxwell_2"
    same.write_text("measurement: {start_s: 3.0, strain: e}")
    given = _parser().parse_args(["identify", "a.csv", "--start=fit", "--reading=a"]).settings
    measured = case_of(Asked(EXAMPLE, same, tuple(given)))[0].block.measurement
    assert (measured.fit_start, measured.readings) == (True, ["rotation"])


def test_what_is_recognised_in_an_export_is_said(tmp_path: Path, few: Path) -> None:
    export = ROOT / "tests" / "traces" / "files" / "anton_paar_intervals.utf16.csv"
    trace = Path(shutil.copy(export, tmp_path / "gel.csv"))
    options = "--time Time --start 24 --model maxwell --set measurement.block=3 --no-compare"
    reading = ("--reading", "modulus=Relaxation Modulus")
    status, _, said = identify(trace, "--config", few, *options.split(), *reading)
    assert status == 0
    assert "gel.csv is read as\n  encoding     UTF-16\n  separator    tabs\n" in said
    assert "\n  modulus      Relaxation Modulus, in kPa\n" in said
    assert json.loads((tmp_path / "gel.identified.json").read_text())["read_as"]["block"] == 3


def test_what_was_held_is_stated_once(tmp_path: Path) -> None:
    (ramp := tmp_path / "ramp.yaml").write_text("protocol: {phases: []}")
    held = Setting("--hold", HOLD, 3e-9)
    load = Setting("t.tsv", ("measurement", "load"), "torque_Nm")
    other = Setting("t.tsv", ("protocol",), {"phases": [{"duration_s": 9.0, "torque_Nm": 1e-9}]})
    for config, settings, beside in (
        (None, (held, load), "measurement.load"),
        (None, (load, held), "measurement.load"),
        (None, (other, held), "protocol"),
        (ramp, (held,), "protocol"),
    ):
        with pytest.raises(BiogripError) as error:
            case_of(Asked(EXAMPLE, config, settings, "t.tsv, line 2"))
        said = f"t.tsv, line 2: found --hold and {beside}; allowed is one of them."
        assert str(error.value) == said
    strain = Setting("t.tsv", ("measurement", "strain"), "rotation_rad")
    with pytest.raises(BiogripError, match=r"^t\.tsv, line 2: --hold: is missing; allowed is the"):
        case_of(Asked(EXAMPLE, None, (strain,), "t.tsv, line 2"))


@pytest.mark.parametrize("floor", [0.1, 0.0])
def test_known_deviations_are_weights_of_the_fit(floor: float) -> None:
    times = np.arange(1.0, 101.0)
    values = 100 * np.exp(-times / 50)
    sd = 0.04 * values + floor
    given: dict[str, Any] = {"sd": sd} if floor else {"noise_share": 0.04}
    found = told(times, values, reads="modulus", model="maxwell", **given).diagnosis.recording
    assert found is not None
    assert found.sd is not None
    # A smooth course is less sure of at its ends.
    np.testing.assert_allclose(found.sd[10:-10], sd[10:-10], rtol=0.02)


OPTIONS = {
    "--noise nan": "--noise: measurement.noise_rad: found 'nan', allowed is a number.",
    "--noise-model coloured --noise 1e-6": "--noise: measurement.noise_rad: is that of white noise",
    "--sd sd_rad --noise 1e-6": "--noise: measurement.noise_rad: does not go with sd",
    "--set measurement.time_unit=ns": "column 'time_s': found the unit 'ns', allowed are s, ms",
    "--set measurement.scale=0": "--set: measurement.scale: found 0, allowed is another number.",
    "--fix k=0": "--fix: fixed.k: found 0, allowed is at least 1e-18 and at most 1e+12 N/m.",
    "--reading strian=x": "--reading: measurement.strian: unknown key. Did you mean 'strain'?",
    "--reading strain=x": "--hold: is missing; allowed is the stress in Pa that was held",
    "--reading strain=rotation_rad --hold 1e99": "phases[0].stress_Pa: found 1e+99, allowed is",
    "--reading modulus=rotation_rad --set measurement.reading_unit=mm": "unit 'mm', allowed are Pa",
    "--time=": "--time: measurement.time: found '' of 0 characters, allowed are at least 1.",
    f"--config {'x' * 300}": "File name too long",
    "--report theirs.html": "biogrip did not write it",
    "--report x.html --csv x.html": "would be written for '--report' and for '--csv'",
    "--csv b.csv": "b.csv: is there, and biogrip did not write it; allowed is another name",
    "--output a.csv": "a.csv: is read; allowed is another file to write.",
    "--output link.csv": "link.csv: is read; allowed is another file to write.",
    "--output link.json": "link.json: is there, and biogrip did not write it; allowed is another",
    "--output .": "cannot be written; allowed is a file in a folder that you may write to.",
    "--output nowhere/x.json": "cannot be written; allowed is a file in a folder that you may",
    f"--output {'x' * 250}": "cannot be written: File name too long.",
    f"--output {'x' * 300}/a.json": "cannot be written; allowed is a file in a folder that you",
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
    **dict.fromkeys(PIPES, "no regular file; allowed is one."),
    "identify .": "TRACE: found '.', which is no regular file; allowed is one.",
    "identify tabel.csv": "there is no file tabel.csv in /",
    f"identify {'x/' * 3000}": "there is no file x/x/",
    "identify a.csv b.csv --output x.json": "--output: only for one trace",
    "identify table.csv --output x.json": "--output: only for one trace",
    "identify table.csv --csv a.csv": "a.csv: is read; allowed is another file to write.",
    "identify a.csv b.csv --config bad.yaml": "bad.yaml, line 1: protocl: unknown key",
}


@pytest.mark.parametrize("arguments", REFUSED, ids=lambda text: text[:50])
def test_what_cannot_be_used_is_named_once_and_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: str
) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("a.csv", "b.csv"):
        shutil.copy(EXAMPLE, name)
    Path("table.csv").write_text("file,dish\na.csv,left\n")
    Path("theirs.html").write_text("<p>mine</p>")
    Path("bad.yaml").write_text("protocl: 3")
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


def test_text_that_is_no_value_of_an_option_is_refused() -> None:
    for option, text, said in (
        *(("--fix", text, "allowed is NAME=VALUE") for text in ("k", "k=much", "=1")),
        *(("--set", text, "allowed is KEY=VALUE") for text in ("k", "=1")),
        ("--start", "soon", "found 'soon', allowed is SECONDS: the protocol's start on the clock"),
        ("--hold", "0", "found '0', allowed is VALUE: what was held"),
        *(("--hold", text, "allowed is a number, or one with") for text in ("nan", "much")),
        ("--hold", "-5,0%", "a decimal comma? Allowed is a point"),
        ("--set", "a.b=[1", "a.b: not usable YAML: "),
        ("--set", "a.b=1:30", "a.b: not usable YAML: found 1:30, which YAML reads in base 60"),
    ):
        with redirect_stderr(StringIO()) as error, pytest.raises(SystemExit):
            main(["identify", "trace.csv", option, text])
        assert said in error.getvalue()


@pytest.mark.nightly
def test_nobody_reading_progress_is_no_error(tmp_path: Path, few: Path) -> None:
    reader, writer = os.pipe()
    os.close(reader)
    code = "import sys; from biogrip import cli, terminal; terminal._PROGRESS_INTERVAL_S = 0.0; "
    code += "sys.exit(cli.main(sys.argv[1:]))"
    command: list[str | Path] = [sys.executable, "-c", code]
    command += ["identify", EXAMPLE, "--config", few, "--output", tmp_path / "f.json"]
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=writer, text=True, check=False)
    os.close(writer)
    assert (done.returncode, done.stdout) == (128 + signal.SIGPIPE, "")


@pytest.mark.parametrize("where", ["identify.identify.notes_on_start", "command.files.trace_data"])
def test_a_trace_whose_fit_fails_costs_no_other_its_result(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, where: str
) -> None:
    """A fault of ours, in a note or in what is said at last: a row says why, alone one message."""
    good, bad = tmp_path / "good.csv", tmp_path / "bad.csv"
    write_drop(good, 0)
    bad.write_text("".join(good.read_text().splitlines(keepends=True)[:60]))

    module, _, name = f"biogrip.{where}".rpartition(".")
    works = getattr(import_module(module), name)

    def fails(*given: Any, **more: Any) -> Any:
        of_trace = given[0].likelihood.problem.residuals if not given[1:] else given[0]
        samples = len(of_trace.time_s) if given[1:] else of_trace.samples
        if samples < 60:
            raise ValueError("min() arg is an empty sequence")
        return works(*given, **more)

    monkeypatch.setattr(f"biogrip.{where}", fails)
    table, options = tmp_path / "found.csv", ("--no-compare", "--model", "liquid_drop")
    # It is known as ours by the end of a long header.
    table.write_text(f"{'k value (N/m),' * 1000}{WRITTEN_BY}\n")
    status, said, error = identify(bad, good, "--csv", table, *options)
    assert (status, "Traceback" in error) == (1, False)
    assert f"{bad}: the fit failed" in said
    rows = pd.read_csv(table, keep_default_na=False)
    assert rows[["trace", "fit"]].values.tolist() == [[str(bad), "failed"], [str(good), "ok"]]
    assert "ValueError: min() arg is an empty sequence" in rows.loc[0, "failed"]
    assert rows.loc[1, "failed"] == ""
    assert {path.stem for path in tmp_path.glob("*.json")} == {"good.identified"}
    status, _, error = identify(bad, *options)
    assert status == 1
    assert "the fit failed, which is a fault of biogrip" in error


def test_a_config_fixes_an_option_adds_and_it_is_said_everywhere(tmp_path: Path) -> None:
    write_drop(tmp_path / "trace.csv", 0)
    page, table, config = (tmp_path / name for name in ("page.html", "a.csv", "a.yaml"))
    config.write_text(f"{FEW}fixed: {{k: 20.0, c_p: 1.0}}\n")
    outputs = ("--report", page, "--csv", table, "--output", tmp_path / "f.json")
    given = ("--config", config, "--fix", "c_p=50")
    status, said, _ = identify(tmp_path / "trace.csv", *given, *outputs)
    assert status == 0
    found = json.loads((tmp_path / "f.json").read_text())
    assert found["assumed"]["fixed"] == {"k": 20.0, "c_p": 50.0}
    # True are 300 and 0: the sum is what shows.
    assert 240 < by_quantity(found)["c"]["value"] < 260
    assert "Fixed: k = 20 N/m, c_p = 50 N s/m." in said
    assert "Other models are not compared, because k and c_p were fixed." in said
    assert found["models"] == []
    assert "Fixed: k = 20 N/m, c_p = 50 N s/m." in page.read_text().replace("\xa0", " ")
    header, row = (line.split(",") for line in table.read_text().splitlines())
    assert row[header.index("fixed")] == "k = 20 N/m; c_p = 50 N s/m"
    assert not [name for name in header if name.startswith("c_p")]


EVERYTHING = """
study_seed: 7
least_squares: {candidates: 60, starts: 3}
identifiability: {confidence: 0.9}
model_selection: {models: [damper, maxwell]}
gripper: {uncertainty: {torque_percent: 1.0}}
protocol: {phases: [{duration_s: 200, torque_Nm: 1.6e-9}, {duration_s: 200, torque_Nm: 0.32e-9}]}
"""


def test_all_that_is_assumed_repeats_it(tmp_path: Path) -> None:
    config, told = EVERYTHING, []
    options = "--model liquid_drop --offset --fix c=77 --noise 3.6e-6 --from 1"
    for _ in range(2):
        data = identified(tmp_path, EXAMPLE, *options.split(), config=config)
        told.append(json.dumps(data | {"by_default": None, "digest": None}))
        options = ""
        config = yaml.safe_dump(data["assumed"])
    assert told[0] == told[1]


def test_advice_is_given_of_a_rejected_fit_alone() -> None:
    rejected = {"fit": "rejected", "notes": [{"weight": REJECTION, "text": "It is wrong."}]}
    found = example()[1] | {"advice": "Try another."}
    lines = in_columns([found | rejected, found | {"trace": "other.csv"}], {}).splitlines()
    assert [line for line in lines if "Try" in line] == [f"{EXAMPLE}: Try another."]
    assert f"{EXAMPLE}: rejected: It is wrong." in lines
    (row,) = (line for line in lines if "  ok  " in line)
    assert "  21.6 (16.9 to 26.6)  5.01 " in row
    assert "  ≤ 9.2  " in row


def test_a_terminal_sees_every_phase(tmp_path: Path, few: Path) -> None:
    shown: list[bytes] = []

    def read(screen: int) -> bytes:
        shown.append(os.read(screen, 65536))
        return shown[-1]

    write_drop(trace := tmp_path / "drop.csv", 0)
    command = [sys.executable, "-m", "biogrip", "identify", str(trace), "--config", str(few)]
    assert pty.spawn([*command, "--output", str(tmp_path / "found.json")], read) == 0
    said = b"".join(shown).decode()
    for phase in ("fitting 120 samples", "finding confidence limits", "trying other sample models"):
        assert phase in said
    # The line of the phases is gone before anything is told.
    assert "\r\x1b[K" in said.split(str(trace))[-2]


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


@pytest.mark.nightly
def test_a_picture_of_one_trace_is_written(tmp_path: Path, few: Path) -> None:
    trace, other = tmp_path / "a.csv", tmp_path / "b.csv"
    for seed, path in enumerate((trace, other)):
        write_drop(path, seed)
    options = ("--config", few, "--no-compare", "--plot", tmp_path / "fit.png")
    # Typed twice, it is replaced.
    for _ in range(2):
        status, said, complained = identify(trace, *options)
        assert status == 0, complained
        assert said.rstrip().endswith("fit.png.")
    with PIL.Image.open(tmp_path / "fit.png") as image:
        assert image.width > image.height > 600
    for refused in ((trace, other, *options), (trace, *options[:-1], tmp_path / "fit.pdf")):
        status, _, complained = identify(*refused)
        assert status == 1
        assert "allowed is a name that ends with .png, of one trace" in complained
    assert not (tmp_path / "fit.pdf").exists()
