"""`biogrip identify`: one recorded trace from file to verdicts, and what is wrong with bad ones."""

import json
import os
import pty
import re
import shutil
import signal
import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout, suppress
from html import unescape
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml

from biogrip.arrays import Array
from biogrip.cli import main
from biogrip.errors import BiogripError
from biogrip.fit.case_problem import CaseProblem
from biogrip.fit.nested_fits import ranked
from biogrip.fit.problem import History, Identification
from biogrip.identify import one_trace
from biogrip.identify.fitted_models import FittedModels
from biogrip.identify.many_traces import Outcome, write_table
from biogrip.identify.one_trace import IdentifyOptions, identify_trace
from biogrip.identify.outputs import WRITTEN_BY, check_output
from biogrip.identify.read_as import ReadAs
from biogrip.identify.words import for_a_paper, side_by_side
from biogrip.judging.doubts import Note
from biogrip.judging.profiles import Profile
from biogrip.judging.quantities import parameters_and_sum
from biogrip.judging.verdicts import Finding
from biogrip.physics.models import CANDIDATES, MODELS
from biogrip.traces.onset import note_late_onset
from tests.helpers.places import EXAMPLE, ROOT
from tests.helpers.problems import clean

FEW = """
least_squares: {candidates: 100, starts: 4}
model_selection: {models: [damper, maxwell]}
"""
TRUTH = yaml.safe_load((ROOT / "data" / "example_truth.yaml").read_text())["cases"]["example"]


def identify(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    """The command, in this process: loading it takes as long as what it does to a bad trace."""
    command = ["identify", *map(str, arguments)]
    with redirect_stdout(StringIO()) as said, redirect_stderr(StringIO()) as complained:
        status = main(command)
    return subprocess.CompletedProcess(command, status, said.getvalue(), complained.getvalue())


def written(path: Path, times: Array, values: Array, header: str = "time_s,rotation_rad") -> Path:
    lines = [header, *(f"{t:.6g},{v:.8e}" for t, v in zip(times, values, strict=True))]
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.fixture(scope="module")
def few(tmp_path_factory: pytest.TempPathFactory) -> str:
    """A config with few starts, and few models to compare, where that is not looked at."""
    config = tmp_path_factory.mktemp("config") / "few.yaml"
    config.write_text(FEW)
    return str(config)


@pytest.fixture(scope="module")
def trace() -> tuple[Array, Array]:
    """Table 7's sample at 1 Hz with 5 % noise."""
    times, response = clean("liquid_drop_2")
    noise = 0.05 * response.max() * np.random.default_rng(0).standard_normal(len(times))
    return times, response + noise


@pytest.fixture(scope="module")
def example(tmp_path_factory: pytest.TempPathFactory) -> tuple[str, dict[str, Any]]:
    """What is said and what is written of the example, with the default study."""
    output = tmp_path_factory.mktemp("example") / "found.json"
    done = identify(EXAMPLE, "--output", output)
    assert done.returncode == 0, done.stderr
    return done.stdout, json.loads(output.read_text())


def test_the_example_gives_its_truth(example: tuple[str, dict[str, Any]]) -> None:
    said, found = example
    quantities = {item["quantity"]: item for item in found["quantities"]}
    truth = {name: value for name, value in TRUTH["sample"].items() if name != "model"}
    truth["c + c_p"] = truth["c"] + truth["c_p"]
    for name in ("k", "k_p", "c", "c + c_p"):
        item = quantities[name]
        assert item["verdict"] == "determined"
        # Three standard deviations on either side of the estimate.
        low, high = (item["value"] * (item[end] / item["value"]) ** 1.5 for end in ("low", "high"))
        assert low < truth[name] < high
        assert f"{name:<7}" in said
        assert item["in_words"] in said
    assert quantities["c_p"]["verdict"] == "bounded above"
    assert quantities["c_p"]["high"] > truth["c_p"]
    assert found["noise_rad"] == pytest.approx(0.05 * 6.7e-5, rel=0.3)
    assert found["notes"] == []
    assert set(found["versions"]) == {"biogrip", "numpy", "scipy"}
    assert found["by_default"] == ["gripper", "protocol"]


def test_units_separators_offset_and_drift(
    tmp_path: Path, trace: tuple[Array, Array], few: str
) -> None:
    times, values = trace
    plain = tmp_path / "plain.json"
    file = written(tmp_path / "a.csv", times, values)
    assert identify(file, "--config", few, "--output", plain).returncode == 0
    other = written(
        tmp_path / "b.csv", times / 60, 1e3 * (values + 5e-4 + 1e-6 * times), "t;phi_mrad;note"
    )
    other.write_text(other.read_text().replace(",", ";") + "6.67;-;\n6.68;;\n")
    shifted = tmp_path / "shifted.json"
    options = ("--config", few, "--time", "t", "--time-unit", "min", "--rotation", "phi_mrad")
    done = identify(other, *options, "--offset", "--drift", "--output", shifted)
    assert done.returncode == 0, done.stderr
    found = json.loads(shifted.read_text())
    left_out = f"Left out for want of a number: 2 rows of {len(times) + 2}."
    assert {"weight": "harmless", "text": left_out} in found["notes"]
    assert f"Note: {left_out}" in done.stdout
    # Fitted along, both are known to some per cent of the rotation.
    assert found["offset_rad"] == pytest.approx(5e-4, abs=1e-4)
    assert found["drift_rad_per_s"] == pytest.approx(1e-6, abs=1e-6)
    total, before = (
        next(q for q in json.loads(file.read_text())["quantities"] if q["quantity"] == "c + c_p")
        for file in (shifted, plain)
    )
    assert total["high"] - total["low"] > before["high"] - before["low"]
    assert total["low"] < before["value"] < total["high"]


def test_what_is_not_there_is_named_with_what_is(tmp_path: Path) -> None:
    (tmp_path / "trace.csv").write_text("time_s,rotation_rad\n")
    done = identify(tmp_path / "trcae.csv")
    assert done.returncode == 1
    assert "trcae.csv', allowed is a file that exists. Did you mean" in done.stderr
    done = identify(EXAMPLE, "--model", "maxwel", "--output", tmp_path / "x.json")
    assert done.returncode == 1
    assert "--model: found 'maxwel'. Did you mean 'maxwell'?" in done.stderr
    done = identify(EXAMPLE, "--rotation", "rotaton_rad", "--output", tmp_path / "x.json")
    assert "Did you mean 'rotation_rad'?" in done.stderr
    assert not (tmp_path / "x.json").exists()


@pytest.mark.parametrize(
    ("path", "found"),
    [
        ("", "found the folder '.', allowed is a file."),
        (".", "found the folder '.', allowed is a file."),
        ("/", "found the folder '/', allowed is a file."),
        ("x" * 300, "allowed is a file that exists."),
        ("x/" * 3000, "allowed is a file that exists."),
    ],
)
def test_a_trace_that_is_no_file_is_refused(
    capsys: pytest.CaptureFixture[str], path: str, found: str
) -> None:
    assert main(["identify", path]) == 1
    said = capsys.readouterr().err
    assert said.startswith("biogrip: TRACE: found ")
    assert found in said
    assert len(said) < 500


REFUSED = {
    "--noise -1": "--noise: found -1.0, allowed is at least 1e-15 and at most 1e+12 rad.",
    "--noise nan": "--noise: found nan, allowed is a finite number.",
    "--time-unit hours": "--time-unit: found 'hours'. Did you mean 'h'? Allowed: s, ms, min, h.",
    "--rotation-unit microrad": "--rotation-unit: found 'microrad'. Did you mean 'urad'?",
    "--noise-model pink": "--noise-model: found 'pink'. Allowed: white, coloured.",
    "--noise-model coloured --noise 1e-6": "--noise: is that of white noise; leave it out with",
    "--noise-model coloured --noise-share 0.03": "--noise-share: is that of white noise; leave",
    "--sd sd_rad --noise 1e-6": "--noise: does not go with --sd, which says all of the noise.",
    "--noise-share 3": "--noise-share: found 3.0, allowed is greater than 0 and at most 1.",
    "--scale 0": "--scale: found 0, allowed is another number.",
    "--scale -1e-400": "--scale: found 0, allowed is another number.",
    "--fix k=1e300": "--fix: k: found 1e+300, allowed is at least 1e-18 and at most 1e+12 N/m.",
    "--fix k=4 --fix k=5": "--fix: found k repeated, allowed is each parameter",
    "--sd sd": "found no such column, allowed are time_s, rotation_rad.",
    "--time=": "--time: found '' of 0 characters, allowed are at least 1.",
    f"--rotation {'x' * 5000}": "of 5000 characters, allowed are at most 4000.",
    f"--config {'x' * 300}": "File name too long",
}


@pytest.mark.parametrize("arguments", REFUSED, ids=lambda text: text[:30])
def test_an_option_that_cannot_be_used_is_named(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, arguments: str
) -> None:
    output = tmp_path / "found.json"
    assert main(["identify", str(EXAMPLE), "--output", str(output), *arguments.split()]) == 1
    error = capsys.readouterr().err
    assert error.startswith("biogrip: ")
    assert REFUSED[arguments] in error
    assert error.count("\n") == 1
    assert not output.exists()


@pytest.mark.nightly
def test_nobody_reading_progress_is_no_error(tmp_path: Path, few: str) -> None:
    reader, writer = os.pipe()
    os.close(reader)
    said_at_once = "import sys; from biogrip import cli, terminal; terminal._EVERY_S = 0.0; "
    command = [sys.executable, "-c", f"{said_at_once}sys.exit(cli.main(sys.argv[1:]))"]
    command += ["identify", str(EXAMPLE), "--config", few, "--output", str(tmp_path / "f.json")]
    done = subprocess.run(command, stdout=writer, stderr=subprocess.PIPE, text=True, check=False)
    os.close(writer)
    assert done.returncode == 128 + signal.SIGPIPE
    assert done.stderr == ""


@pytest.mark.parametrize("name", ["a{b}.csv", "<results>.csv", "{}.csv", "=1+1.csv", "a\nb.csv"])
def test_a_trace_of_any_name_is_read(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, trace: tuple[Array, Array], name: str
) -> None:
    """Without a workflow, no name is a pattern; the trace is refused for what is in it."""
    times, values = trace
    file = written(tmp_path / name, times, -values)
    assert main(["identify", str(file)]) == 1
    assert "found a rotation that goes against the torque" in capsys.readouterr().err
    assert not list(tmp_path.glob("*.json"))


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("trace.csv", "trace.csv: is read; allowed is another file to write."),
        ("link.csv", "link.csv: is read; allowed is another file to write."),
        ("mine.json", "mine.json: is there, and biogrip did not write it; allowed is another name"),
        ("link.json", "link.json: is there, and biogrip did not write it; allowed is another name"),
        (".", "cannot be written; allowed is a file in a folder that you may write to."),
        ("nowhere/x.json", "cannot be written; allowed is a file in a folder that you may write"),
        ("x" * 300, "cannot be written: File name too long."),
        ("x" * 250, "cannot be written: File name too long."),
        ("x" * 300 + "/a.json", "cannot be written; allowed is a file in a folder that you may"),
    ],
)
def test_an_output_that_cannot_be_written_is_refused_at_once(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, name: str, said: str
) -> None:
    trace, mine = tmp_path / "trace.csv", tmp_path / "mine.json"
    trace.write_bytes(EXAMPLE.read_bytes())
    mine.write_text('{"mine": 1}')
    (tmp_path / "link.csv").symlink_to(trace)
    (tmp_path / "link.json").symlink_to(mine)
    before = sorted(tmp_path.iterdir())
    assert main(["identify", str(trace), "--output", f"{tmp_path}/{name}"]) == 1
    assert said in capsys.readouterr().err
    assert sorted(tmp_path.iterdir()) == before
    assert trace.read_bytes() == EXAMPLE.read_bytes()
    assert mine.read_text() == '{"mine": 1}'


@pytest.mark.parametrize(
    "command",
    [
        "identify pipe",
        "identify a.csv --config pipe",
        "identify a.csv --output pipe --force",
        "identify a.csv --csv pipe --force",
        "identify a.csv --report pipe --force",
        f"identify a.csv --csv {os.devnull} --force",
        "identify table.csv --config pipe",
        "groups pipe --by dish",
        "design pipe",
    ],
)
def test_what_is_no_regular_file_is_neither_read_nor_replaced(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
    command: str,
) -> None:
    """At once: of a pipe that nobody writes to, reading waits without end."""
    monkeypatch.chdir(tmp_path)
    os.mkfifo("pipe")
    shutil.copy(EXAMPLE, "a.csv")
    Path("table.csv").write_text("file,dish\na.csv,left\n")
    before = sorted(tmp_path.iterdir())
    assert main(command.split()) == 1
    error = capfd.readouterr().err
    assert "no regular file; allowed is one." in error
    assert error.count("\n") == 1
    assert sorted(tmp_path.iterdir()) == before
    assert Path("pipe").is_fifo()


def test_an_output_is_replaced_that_biogrip_wrote_or_by_force(tmp_path: Path, few: str) -> None:
    output = tmp_path / "found.json"
    output.write_text("mine")
    arguments = ["identify", str(EXAMPLE), "--config", few, "--output", str(output)]
    assert main([*arguments, "--force"]) == 0
    written = output.read_bytes()
    assert main(arguments) == 0
    assert output.read_bytes() == written


def test_what_is_said_has_all_digits_and_what_is_written_five(tmp_path: Path, few: str) -> None:
    output = tmp_path / "found.json"
    said = identify_trace(IdentifyOptions(EXAMPLE, "maxwell", ReadAs(), Path(few)), output).data
    written = json.loads(output.read_text())
    for one, other in [
        (said, written),
        *zip(said["quantities"], written["quantities"], strict=True),
    ]:
        for name in {"noise_rad", "misfit_rad", "value", "low", "high"} & set(one):
            assert (
                one[name] is other[name] is None
                or other[name] == float(f"{one[name]:.5g}") != one[name]
            )
    assert written["assumed"] == said["assumed"]


def test_a_table_of_many_quantities_is_known_as_ours(tmp_path: Path) -> None:
    """Its mark stands at the end of a header that may be long."""
    table = tmp_path / "table.csv"
    found = {"trace": "a.csv", "model": "m", "samples": 1, "noise_rad": 1.0, "misfit_rad": 1.0}
    quantity = {"verdict": "determined", "unit": "N/m", "value": 1.0, "low": 0.5, "high": 2.0}
    quantities = [{"quantity": f"k_{number} + c_{number}", **quantity} for number in range(20)]
    reads = {"quantity": "rotation", "unit": "rad"}
    rest: dict[str, Any] = {"quantities": quantities, "models": [], "fit": "ok", "reads": reads}
    rest[WRITTEN_BY] = "1"
    write_table(Outcome([{**found, **rest}], {}), table)
    check_output(table, force=False)
    table.write_text(table.read_text().replace(WRITTEN_BY, "rotation"))
    with pytest.raises(BiogripError, match="biogrip did not write it"):
        check_output(table, force=False)


def test_a_trace_whose_fit_fails_costs_no_other_its_result(
    tmp_path: Path, few: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A fault of ours, here of a test that only adds notes: a row says why, alone one message."""
    whole, whole_length = note_late_onset, len(pd.read_csv(EXAMPLE))

    def fails(problem: CaseProblem, time_s: Array, values: Array, near: Array) -> list[Note]:
        if len(time_s) < whole_length:
            raise ValueError("min() arg is an empty sequence")
        return whole(problem, time_s, values, near)

    monkeypatch.setattr(one_trace, "note_late_onset", fails)
    good, bad = (tmp_path / name for name in ("good.csv", "bad.csv"))
    shutil.copy(EXAMPLE, good)
    bad.write_text("".join(EXAMPLE.read_text().splitlines(keepends=True)[:-1]))
    table = tmp_path / "found.csv"
    assert main(["identify", str(bad), str(good), "--config", few, "--csv", str(table)]) == 1
    said = capsys.readouterr()
    assert "Traceback" not in said.err
    assert f"{bad}: the fit failed" in said.out
    rows = pd.read_csv(table, keep_default_na=False)
    assert rows["trace"].tolist() == [str(bad), str(good)]
    assert rows["fit"].tolist() == ["failed", "ok"]
    assert "ValueError: min() arg is an empty sequence" in rows.loc[0, "failed"]
    assert rows.loc[1, "failed"] == ""
    assert good.with_suffix(".identified.json").exists()
    assert not bad.with_suffix(".identified.json").exists()
    assert main(["identify", str(bad), "--config", few]) == 1
    assert "the fit failed, which is a fault of biogrip" in capsys.readouterr().err


def test_several_traces_come_in_a_table_and_on_a_page(tmp_path: Path, few: str) -> None:
    """The bad are skipped, listed with their reasons, and make the status 1."""
    good = [shutil.copy(EXAMPLE, tmp_path / name) for name in ("a.csv", "b.csv")]
    bad = tmp_path / "bad.csv"
    bad.write_text(EXAMPLE.read_text().replace(",", ";", 5))
    page, table = tmp_path / "out.html", tmp_path / "out.csv"
    missing = tmp_path / "c.csv"
    # Of a folder there is no name to write beside.
    options = ("--config", few, "--report", page, "--csv", table)
    done = identify(*good, good[0], bad, missing, "/", *options)
    assert done.returncode == 1, done.stderr
    assert "Traceback" not in done.stderr
    rows = pd.read_csv(table, keep_default_na=False).set_index("trace")
    assert list(rows.index) == [*map(str, good), str(bad), str(missing), "/"]
    assert list(rows["fit"]) == ["ok", "ok", "failed", "failed", "failed"]
    told = json.loads((tmp_path / "a.identified.json").read_text())
    assert rows.loc[str(good[0]), "k value (N/m)"] == str(told["quantities"][0]["value"])
    assert rows.loc[str(good[0]), "c + c_p high (N s/m)"] == str(told["quantities"][-1]["high"])
    (lowest,) = (row["model"] for row in told["models"] if row["delta_bic"] == 0)
    assert rows.loc[str(good[0]), "preferred_model"] == lowest
    # Cells are numbers or names, and a verdict is at most three words.
    longest = rows.drop(columns=["written_by_biogrip", "failed"]).map(
        lambda cell: len(str(cell).split())
    )
    assert longest.max().max() <= 3
    # The same trace under another name is the same trace.
    assert list(rows.loc[str(good[0])]) == list(rows.loc[str(good[1])])
    for text in (done.stdout, page.read_text()):
        assert "not identified" in text.lower()
        assert "bad.csv, line" in text
        assert "found &#39;" in text or "found '" in text
    assert "5 traces: 2 ok, 0 doubtful, 0 rejected, 3 not identified." in page.read_text()
    assert page.read_text().count('id="curves-') == 2
    assert "http" not in page.read_text()
    # What biogrip wrote is replaced, be there nothing to draw.
    assert identify(bad, missing, *options).returncode == 1
    assert page.read_text().count('id="curves-') == 0
    assert "2 traces: 0 ok, 0 doubtful, 0 rejected, 2 not identified." in page.read_text()
    assert list(pd.read_csv(table)["trace"]) == [str(bad), str(missing)]


EVERYTHING = """
study_seed: 7
least_squares: {candidates: 60, starts: 3}
identifiability: {confidence: 0.9}
gripper: {uncertainty: {torque_percent: 1.0}}
protocol: {phases: [{duration_s: 200, torque_Nm: 1.6e-9}, {duration_s: 200, torque_Nm: 0.32e-9}]}
"""


@pytest.mark.parametrize(
    ("options", "models"),
    [
        (("--offset", "--fix", "c=77"), ""),
        (("--noise", "3.6e-6"), "model_selection: {models: [damper, maxwell]}"),
    ],
)
def test_all_that_is_assumed_repeats_it(
    tmp_path: Path, options: tuple[str, ...], models: str
) -> None:
    """Every byte of the answer, without any option but the model's."""
    config, found = tmp_path / "c.yaml", tmp_path / "f.json"
    config.write_text(EVERYTHING + models)
    told = []
    arguments: tuple[str, ...] = ("--model", "liquid_drop", *options)
    for _ in range(2):
        run = identify(EXAMPLE, *arguments, "--output", found, "--config", config, "--force")
        assert run.returncode == 0, run.stderr
        data = json.loads(found.read_text())
        data.pop("by_default")
        told.append(json.dumps(data))
        assumed = data["assumed"]
        arguments = ("--model", assumed.pop("model"))
        config.write_text(yaml.safe_dump(assumed))
    assert told[0] == told[1]


@pytest.mark.parametrize(
    ("options", "noise"),
    [
        (("--sd", "sd", "--scale", "-2e-3", "--start", "5"), "noise as given"),
        (("--scale", "-2e-3", "--start", "fit"), "scatter of neighbours"),
        (("--scale", "-2e-3", "--start", "5", "--noise-model", "coloured"), "noise as modelled"),
    ],
)
@pytest.mark.nightly
def test_how_a_file_was_read_is_enough_to_repeat_it(
    tmp_path: Path, few: str, options: tuple[str, ...], noise: str
) -> None:
    """All assumed blocks as a config do what the options did, and options replace its keys."""
    times, rotation = clean("liquid_drop_2", 0.5)
    size = 0.02 * rotation.max()
    measured = rotation + size * np.random.default_rng(1).standard_normal(len(times))
    rows = zip(times + 5, measured / -2e-3, np.full(len(times), size / 2e-3), strict=True)
    file, again = tmp_path / "volts.csv", tmp_path / "again.yaml"
    header = ["rig 2", "clock,volts,sd"]
    file.write_text("\n".join([*header, *(",".join(map(repr, map(float, row))) for row in rows)]))
    units = ("--time", "clock", "--time-unit", "s", "--rotation", "volts", "--rotation-unit", "rad")
    arguments = (file, "--model", "liquid_drop", "--output", tmp_path / "found.json")
    run = identify(*arguments, *units, *options, "--config", few)
    assert run.returncode == 0, run.stderr
    assert noise in run.stdout
    found = json.loads((tmp_path / "found.json").read_text())
    assert found["assumed"]["model"] == "liquid_drop"
    again.write_text(yaml.safe_dump({k: v for k, v in found["assumed"].items() if k != "model"}))
    run = identify(*arguments, "--config", again)
    assert run.returncode == 0, run.stderr
    repeated = json.loads((tmp_path / "found.json").read_text())
    assert repeated["quantities"] == found["quantities"]
    assert repeated["assumed"] == found["assumed"]
    run = identify(*arguments, "--start", "5.0", "--config", again)
    assert run.returncode == 0, run.stderr
    replaced = json.loads((tmp_path / "found.json").read_text())["assumed"]["measurement"]
    assert replaced["start_s"] == 5
    assert not replaced.get("fit_start")


@pytest.mark.parametrize(
    ("named", "tried"),
    [
        ("[damper, maxwell]", ["damper", "maxwell", "generalized_maxwell"]),
        ("[generalized_maxwell]", []),
    ],
)
def test_models_that_are_named_are_those_that_are_tried(
    tmp_path: Path, named: str, tried: list[str]
) -> None:
    """Beside the one that the trace is identified with."""
    config, output = tmp_path / "named.yaml", tmp_path / "found.json"
    few = "least_squares: {candidates: 100, starts: 4}"
    config.write_text(f"{few}\nmodel_selection: {{models: {named}}}\n")
    assert identify(EXAMPLE, "--config", config, "--output", output).returncode == 0
    found = json.loads(output.read_text())
    assert [row["model"] for row in found["models"]] == tried
    assert (found["advice"] is None) == (not tried)


def test_the_chosen_model_is_held_against_others(
    tmp_path: Path, example: tuple[str, dict[str, Any]]
) -> None:
    """The example is of a drop with a membrane; its parallel damper does not show."""
    assert "model is richer than the trace asks for: Maxwell liquid drop" in example[0]
    assert example[1]["advice"].endswith(" Its values lie within the limits.")
    tried = [row["model"] for row in example[1]["models"]]
    assert tried[-2:] == ["fractional_kelvin_voigt", "fractional_maxwell"]
    assert sum(CANDIDATES[name].model.power_law for name in tried) == 2
    assert example[0].count("97.5 %") == 1
    assert "generalized_maxwell_3" in tried
    config = tmp_path / "few.yaml"
    config.write_text(FEW.replace("maxwell]", "maxwell, liquid_drop, generalized_maxwell]"))
    for model, said in (("liquid_drop", "suits the trace better"), ("damper", "is not adequate")):
        output = tmp_path / f"{model}.json"
        done = identify(EXAMPLE, "--config", config, "--model", model, "--output", output)
        assert done.returncode == 0, done.stderr
        assert said in done.stdout


def test_values_of_a_simpler_model_are_held_against_limits() -> None:
    """A drop's c is c + c_p of the richer model, whose c_p it has not."""
    names = ["generalized_maxwell", "liquid_drop"]
    answers = [
        Identification(x, 1.0, 1, 1, "converged", History.of([(x, 1.0, 1.0, 1)]))
        for x in (np.array([20.0, 5.0, 79.0, 1.0]), np.array([20.0, 5.0, 80.0]))
    ]
    models = FittedModels(names[0], ranked(names, [1.0, 1.0], 400), answers)

    def advised(**limits: tuple[float | None, float | None]) -> str:
        findings = []
        for quantity in parameters_and_sum(MODELS[names[0]]):
            ends = limits.get(quantity.label.replace(" + ", "_and_"), (None, None))
            low, high = (None if end is None else float(np.log(end)) for end in ends)
            profile = Profile(np.zeros(1), np.zeros(1), 0.0, low, high, np.zeros(4))
            findings.append(Finding(quantity, profile, 0.1))
        return str(models.data(findings)["advice"])

    assert advised(k=(19.0, 21.0), c_p=(None, 3.0)).endswith("Its values lie within the limits.")
    outside = advised(k=(21.0, None), c=(None, 90.0), c_and_c_p=(70.0, 79.0))
    assert outside.endswith("Outside the limits lies its k, 20 N/m and its c + c_p, 80 N s/m.")
    assert "limits" not in advised()


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (["--output", "x.json"], "--output: only for one trace"),
        (["--report", "no/such/out.html"], "cannot be written"),
        (["--report", "theirs.html"], "biogrip did not write it"),
        (["--report", "x.html", "--csv", "x.html"], "to be written twice"),
        (["--config", "bad.yaml"], "bad.yaml, line 1: seedz: unknown key"),
        (["--model", "generalized_maxwell_99"], "--model: found 'generalized_maxwell_99'"),
    ],
)
def test_what_is_wrong_with_all_traces_is_said_once_and_at_once(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    given: list[str],
    said: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("a.csv", "b.csv"):
        shutil.copy(EXAMPLE, name)
    Path("theirs.html").write_text("<p>mine</p>")
    Path("bad.yaml").write_text("seedz: 3")
    assert main(["identify", "a.csv", "b.csv", *given]) == 1
    told = capsys.readouterr().err
    assert said in told
    assert told.count("biogrip:") == 1
    assert not Path("a.identified.json").exists()


def test_colours_are_for_terminals(monkeypatch: pytest.MonkeyPatch) -> None:
    quantity: dict[str, Any] = {
        "quantity": "k",
        "unit": "N/m",
        "verdict": "determined",
        "provided": None,
    }
    quantity |= {"value": 2.0, "low": 1.0, "high": 3.0, "in_words": "determined: 2"}
    found: dict[str, Any] = {"trace": "a", "quantities": [quantity], "confidence": 0.9}
    found |= {"by_default": [], "notes": [], "fit": "ok", "limits": "Limits are statistical."}
    assert "\x1b" not in side_by_side([found], {})
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True, raising=False)
    monkeypatch.delenv("NO_COLOR", raising=False)
    assert "\x1b[32m2 (1 to 3)\x1b[0m" in side_by_side([found], {})
    monkeypatch.setenv("NO_COLOR", "1")
    assert "\x1b" not in side_by_side([found], {})


def test_a_terminal_sees_every_phase_and_colours(tmp_path: Path, few: str) -> None:
    screen, terminal = pty.openpty()
    command = [sys.executable, "-m", "biogrip", "identify", str(EXAMPLE)]
    command += ["--config", few, "--output", str(tmp_path / "found.json")]
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


@pytest.mark.nightly
def test_weights_from_a_column_or_a_share_reach_the_fit(tmp_path: Path, few: str) -> None:
    """Noise of 4 % of the rotation: with either, limits are narrower and nothing is doubted."""
    times, rotation = clean("endothelial_cell", 2.0)
    rng = np.random.default_rng(8)
    trace = rotation * (1 + 0.04 * rng.standard_normal(len(times)))
    deviations = 0.04 * np.maximum(rotation, 0.01 * rotation.max())
    file = tmp_path / "trace.csv"
    rows = zip(times, 1e6 * trace, 1e6 * deviations, strict=True)
    lines = ["time_s,rotation_urad,sd", *(f"{t:.6g},{v:.8e},{s:.8e}" for t, v, s in rows)]
    file.write_text("\n".join(lines) + "\n")
    found = []
    for options in ([], ["--sd", "sd"], ["--noise-share", "0.04"]):
        output, page = tmp_path / "found.json", tmp_path / "page.html"
        run = identify(
            file, "--rotation", "rotation_urad", *options, "--model", "liquid_drop",
            "--config", few, "--output", output, "--report", page,
        )  # fmt: skip
        assert run.returncode == 0, run.stderr
        found.append(json.loads(output.read_text()))
    unweighted, by_column, by_share = found
    assert unweighted["fit"] == "doubtful"
    assert any("The noise grows with the rotation" in text for text in unweighted["reasons"])
    for weighted in (by_column, by_share):
        assert weighted["fit"] == "ok", weighted["reasons"]
        k, before = weighted["quantities"][0], unweighted["quantities"][0]
        assert k["high"] - k["low"] < 0.9 * (before["high"] - before["low"])
        assert weighted["threshold"] == pytest.approx(3.8415, abs=1e-4)
    assert by_column["noise_rad"] == pytest.approx(np.sqrt(np.mean(deviations**2)), rel=1e-4)
    assert by_share["noise_rad"] == pytest.approx(by_column["noise_rad"], rel=0.01)
    assert by_share["assumed"]["measurement"]["noise_share"] == 0.04


def test_the_page_begins_with_status_value_and_interval(tmp_path: Path, few: str) -> None:
    """Then come a drawing and lines for a paper; LaTeX, notes and assumptions are folded."""
    page = tmp_path / "page.html"
    done = identify(EXAMPLE, "--config", few, "--output", tmp_path / "a.json", "--report", page)
    assert done.returncode == 0, done.stderr
    told = json.loads((tmp_path / "a.json").read_text())
    text = unescape(page.read_text())
    parts = ("Fit ok", "What the trace tells", 'data-draw="trace"', "For a paper")
    places = [text.index(part) for part in parts]
    assert places == sorted(places)
    unfolded = re.sub("<details>.*?</details>", "", text, flags=re.DOTALL)
    assert "search_range:" in text
    assert "search_range:" not in unfolded
    assert r"95\,\%" not in unfolded
    for item in told["quantities"]:
        limits = f"{item['low'] or 0:.3g} to {item['high'] or 0:.3g}"
        line = f"<p>{item['quantity']} = {item['value']:.3g} {item['unit']} (95 % "
        line += f"profile-likelihood interval {limits}, n = 1 trace)</p>"
        assert (line in text) == (item["verdict"] == "determined")
    assert r"$k_{p} = 5.01\,\mathrm{N/m}$ (95\,\% profile-likelihood interval $" in text


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
    quantities = [{**both, "low": 1e-9, "high": 40.0}, {**both, "low": None, "high": 40.0}]
    lines = for_a_paper({"fit": fit, "confidence": 0.95, "quantities": quantities})
    assert [latex.startswith(str(said)) for _, latex in lines] == [True] * (said is not None)
