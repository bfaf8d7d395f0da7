import json
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from biogrip import terminal
from biogrip.cli import _parser, main
from biogrip.terminal import visible, visible_lines
from tests.helpers.identified import identify, write_drop

# A colour, the title of a window, a line that is cleared, text that runs from right to left.
HOSTILE = "\x1b[31m\x9b2J\x1b]0;x\x07\r\u202ea\x7f"
OBEYED = re.compile("[^\n -~\xa1-\u200d\u2010-\u2027\u2030-\u2065\u2070-\ud7ff]")
# Of these, what a cell of a table may hold.
FOUND = HOSTILE.replace("\r", "")


def test_text_is_shown_as_it_is_but_for_what_a_terminal_obeys() -> None:
    assert visible("k (µN) ≥ 2, “é” 細胞") == "k (µN) ≥ 2, “é” 細胞"
    shown = r"\x1b[31m\x9b2J\x1b]0;x\x07\r\u202ea\x7f"
    assert visible(HOSTILE) == visible(visible(HOSTILE)) == shown
    assert visible("a\tb\nc\u2028d\udcffe") == r"a\tb\nc\u2028d\udcffe"
    assert visible_lines("a\n\x1bb\n") == "a\n\\x1bb\n"
    obeyed = [*range(0x20), *range(0x7F, 0xA0), *range(0x202A, 0x202F), *range(0x2066, 0x206A)]
    assert all(visible(chr(number)).isprintable() for number in obeyed)


def test_a_message_shows_what_was_found(tmp_path: Path) -> None:
    trace = tmp_path / f"a{HOSTILE}\nb.csv"
    for header, row, said in (
        ("time_s,rotation_rad", f"1,{FOUND}", f"found '{visible(FOUND)}'"),
        (f"time_s,{FOUND}", "1,2", f"The file has: time_s, {visible(FOUND)}"),
    ):
        trace.write_text(f"{header}\n{row}\n", newline="\n")
        status, _, error = identify(trace)
        assert status == 1
        assert error.startswith(f"biogrip: {visible(trace)}, line ")
        assert said in error
        assert not OBEYED.search(error)
        assert error.count("\n") == 1


def test_what_was_typed_is_shown(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["identify", "a.csv", f"--{HOSTILE}"])
    error = capsys.readouterr().err
    assert f"unrecognized arguments: --{visible(HOSTILE)}" in error
    assert not OBEYED.search(error)


@pytest.mark.nightly
def test_names_of_traces_are_shown_wherever_they_are_said(tmp_path: Path, few: Path) -> None:
    page = tmp_path / "page.html"
    good, bad, absent = (tmp_path / f"{name}{HOSTILE}\n.csv" for name in ("good", "bad", "absent"))
    write_drop(good, 0)
    bad.write_text("time_s,rotation_rad\n1,high\n")
    options = ("--config", few, "--model", "maxwell", "--no-compare")
    several = identify(good, bad, good, absent, *options, "--report", page)
    alone = identify(good, *options)
    assert (several[0], alone[0]) == (1, 0)
    for _, said, error in (several, alone):
        assert not OBEYED.search(said + error)
        assert visible(good) in said
        assert f"{visible(good.with_suffix('.identified.json'))}" in said
    assert several[2].splitlines() == [f"1 of 2: {visible(good)}", f"2 of 2: {visible(bad)}"]
    assert f"  {visible(bad)}, line 2, column" in several[1]
    assert f"  TRACE: there is no file {visible(absent)}"[:200] in several[1]
    assert json.loads(good.with_suffix(".identified.json").read_text())["trace"] == str(good)
    assert f">{visible(good)}<" in page.read_text()


@pytest.mark.parametrize("alone", [True, False])
def test_progress_is_shown_and_that_of_a_command_is_no_output(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], alone: bool
) -> None:
    """A job's is: its log has what goes to standard error."""
    monkeypatch.setattr(terminal, "_PROGRESS_INTERVAL_S", 0.0)
    clock = iter([100.0, 130.0, 140.0])
    monkeypatch.setattr("time.monotonic", lambda: next(clock, 140.0))
    with terminal.Progress(HOSTILE, 2, live=alone) as told:
        told.within(0.5)
        told.done(2)
    shown = capsys.readouterr()
    seen, empty = (shown.err, shown.out) if alone else (shown.out, shown.err)
    lines = [f"{visible(HOSTILE)}: {said}" for said in ("25 % done, 90 s left", "100 % done")]
    assert (seen.splitlines(), empty) == (lines, "")
    with terminal.Progress("a", 5) as told:
        told.doing(f"cell {HOSTILE}")
        assert capsys.readouterr().out.startswith("a: step 2 of 5, cell ")
        told.doing(HOSTILE)
    terminal.warn(f"{HOSTILE}: a note")
    for text in capsys.readouterr():
        assert visible(HOSTILE) in text or not text
        assert not OBEYED.search(text)


@pytest.mark.parametrize("command", ["identify", "groups", "design"])
def test_examples_are_commands_that_can_be_typed(
    command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        main([command, "--help"])
    _, _, examples = capsys.readouterr().out.partition("\nexamples:\n")
    lines = [line for line in examples.partition("\n\n")[0].splitlines() if line.startswith("  ")]
    assert len(lines) >= 2
    for line in lines:
        program, *arguments = shlex.split(line)
        assert (program, arguments[0]) == ("biogrip", command)
        _parser().parse_args(arguments)


@pytest.mark.nightly
def test_a_command_needs_no_standard_streams(tmp_path: Path) -> None:
    """As of a service, which closes them: no file gets what is printed."""
    write_drop(tmp_path / "trace.csv", 0)
    command = shlex.join([sys.executable, "-m", "biogrip", "identify", "trace.csv", "--no-compare"])
    closed = f"{command} <&- >&- 2>&-"
    assert subprocess.run(closed, shell=True, cwd=tmp_path, check=False).returncode == 0
    assert json.loads((tmp_path / "trace.identified.json").read_text())["fit"] == "ok"
