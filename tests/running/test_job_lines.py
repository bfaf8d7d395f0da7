"""What `biogrip run` shows: one line a job on a terminal, elsewhere only what asks for a person."""

import logging
import os
import re
import subprocess
import sys
import time
from pathlib import Path

import pytest
from snakemake_interface_logger_plugins.common import LogEvent

from biogrip.running.job_lines import JobLines
from tests.helpers import loaded
from tests.helpers.runs import TINY, called

TARGET = "results/targets/liquid_drop_2.csv"
BATCH = "results/measurements/liquid_drop_2/seeds_1-1.parquet"


def record(event: LogEvent, **fields: object) -> logging.LogRecord:
    return logging.makeLogRecord({"event": event, **fields})


def job(
    number: int, message: str, reason: str = "Missing output files: a.csv"
) -> logging.LogRecord:
    told = {"rule_msg": message, "rule_name": "rule", "reason": reason}
    return record(LogEvent.JOB_INFO, jobid=number, **told)


def test_the_time_left_is_that_of_as_many_jobs_as_are_done(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = [100.0]
    monkeypatch.setattr(time, "monotonic", lambda: clock[0])
    lines = JobLines()
    assert lines.of(record(LogEvent.RUN_INFO, stats={"total": 40})) == ["40 jobs"]
    assert lines.of(job(7, "Drawing a")) == lines.of(job(8, "Drawing b")) == []
    clock[0] += 30.0
    # A group is finished as one.
    for number in (8, 7):
        assert lines.of(record(LogEvent.JOB_FINISHED, job_id=number)) == []
    assert lines.of(record(LogEvent.PROGRESS, done=10, total=40)) == [
        " 25 %      90 s left  Drawing b",
        " 25 %      90 s left  Drawing a",
    ]
    clock[0] += 3570.0
    assert lines.of(job(9, "Drawing c")) == []
    assert lines.of(record(LogEvent.JOB_FINISHED, job_id=9)) == []
    assert lines.of(record(LogEvent.PROGRESS, done=20, total=40)) == [
        " 50 %    60 min left  Drawing c"
    ]


@pytest.mark.parametrize(
    ("reason", "told"),
    [
        ("Missing output files: a; Input files updated by another job: b", ""),
        ("", ""),
        (
            "Code has changed since last execution",
            " (code has changed since last execution)",
        ),
        ("Missing output files: a; Updated input files: b, c", " (updated input files)"),
    ],
)
def test_a_job_that_is_done_again_says_why(reason: str, told: str) -> None:
    lines = JobLines()
    lines.of(job(1, "Drawing", reason))
    lines.of(record(LogEvent.JOB_FINISHED, job_id=1))
    (line,) = lines.of(record(LogEvent.PROGRESS, done=1, total=1))
    assert line.endswith(f"  Drawing{told}")


def on_a_terminal(folder: Path, *arguments: str) -> list[str]:
    """The lines that a command prints on a terminal of 80 columns."""
    ours, theirs = os.openpty()
    environment = {**os.environ, "COLUMNS": "80"}
    with os.fdopen(theirs, "w") as terminal:
        command = ["run", "overlay.yaml", "-j2", *arguments]
        assert loaded.call("biogrip", command, folder, environment, (terminal, terminal)) == 0
        os.set_blocking(ours, False)
        said = os.read(ours, 100_000).decode()
    os.close(ours)
    return said.splitlines()


@pytest.mark.nightly
def test_a_terminal_shows_a_line_a_job_and_a_pipe_the_last_line(tmp_path: Path) -> None:
    (tmp_path / "overlay.yaml").write_text(TINY)
    shown = on_a_terminal(tmp_path, BATCH)
    assert [line for line in shown if not line.startswith("biogrip: warning: ")] == [
        "2 jobs",
        shown[-3],
        shown[-2],
        f"biogrip: done. Open {BATCH}.",
    ]
    assert re.fullmatch(r" 50 %  +\d+ s left  Simulating the response of liquid_drop_2", shown[-3])
    assert re.fullmatch(r"100 % {7}0 s left  Adding noise to liquid_drop_2, seeds_1-1", shown[-2])
    # What Snakemake says of it is in its own log.
    (log,) = (tmp_path / ".snakemake" / "log").iterdir()
    assert "Reason: Missing output files: " in log.read_text()
    (tmp_path / BATCH).unlink()
    piped = called(tmp_path, "run", "overlay.yaml", "-j2", BATCH)
    assert piped.output == f"biogrip: done. Open {BATCH}.\n"
    again = called(tmp_path, "run", "overlay.yaml", "-j2", BATCH)
    assert again.output.splitlines()[0].startswith("Nothing to be done")
    (tmp_path / TARGET).unlink()
    told = called(tmp_path, "run", "overlay.yaml", "-j2", TARGET, "--verbose")
    assert "1 of 1 steps (100%) done" in told.output


def test_what_a_failing_job_says_is_shown(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Piped as on a terminal: rule, files, command and the job's log."""
    (tmp_path / "overlay.yaml").write_text(TINY)
    (tmp_path / "functions").write_text('biogrip() { echo "no space left" >&2; return 3; }\n')
    monkeypatch.setenv("BASH_ENV", str(tmp_path / "functions"))
    command = [sys.executable, "-m", "biogrip", "run", "overlay.yaml", "-j2", TARGET]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 1
    for told in ("Error in rule target:", TARGET, "biogrip make target --case", "no space left"):
        assert told in done.stderr
    assert "biogrip: not finished." in done.stdout
    assert "Traceback" not in done.stderr
