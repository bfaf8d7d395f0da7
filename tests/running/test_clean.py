"""Cleaning: what is ours goes, and only when nobody writes."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from biogrip.errors import BiogripError
from biogrip.files import atomic_write, scratch_path, write_text
from biogrip.running.clean import clean
from biogrip.running.journal import JOURNALS, recorded_in
from biogrip.running.locks import sign_locks
from biogrip.running.manifest import Manifest
from biogrip.running.wholeness import Claim, check_results


@pytest.fixture
def results(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Results of one file and one log, recorded."""
    monkeypatch.chdir(tmp_path)
    folder, log = Path("results"), Path("results/logs/a.log")
    claim = Claim(folder)
    claim.begin([], [log])
    write_text(log, "said by a job\n")
    with recorded_in(folder):
        write_text(folder / "tables" / "a.csv", "a,b\n1,2\n")
    claim.end()
    return folder


def locked_by(folder: Path, process: int) -> None:
    """Lock a folder as a run with that number does."""
    locks = folder / ".snakemake" / "locks"
    locks.mkdir(parents=True)
    (locks / "0.output.lock").touch()
    sign_locks(folder / ".snakemake")
    run = json.loads((folder / ".snakemake" / "run.json").read_text())
    run["pid"] = process
    (folder / ".snakemake" / "run.json").write_text(json.dumps(run))


def test_all_of_it_goes(results: Path) -> None:
    assert clean(results) == "2 files of results removed."
    assert not results.exists()


def test_a_log_of_the_users_stays(results: Path) -> None:
    log = results / "logs" / "a.log"
    log.write_text("my own notes\n")
    assert "results/logs/a.log" in clean(results)
    assert log.read_text() == "my own notes\n"


def test_a_log_of_the_users_is_kept_beside_when_its_job_runs(
    results: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = results / "logs" / "a.log"
    Claim(results).begin([], [log])
    assert log.read_text() == "said by a job\n"
    Manifest(results).save()
    log.write_text("my own notes\n")
    Claim(results).begin([], [log])
    assert Path(f"{log}.edited").read_text() == "my own notes\n"
    assert "results/logs/a.log: is not what was written" in capsys.readouterr().err


def test_it_waits_for_the_end_of_a_run(results: Path) -> None:
    locked_by(Path(), os.getppid())
    with pytest.raises(BiogripError, match="results: a run is going on"):
        clean(results)
    assert (results / "tables" / "a.csv").exists()


def test_it_does_not_wait_for_a_run_that_is_dead(results: Path) -> None:
    locked_by(Path(), 2**22 + 1)
    assert clean(results) == "2 files of results removed."


def test_it_waits_for_jobs_that_outlive_their_run(results: Path) -> None:
    code = (
        "from pathlib import Path; from biogrip.running.journal import Journal; "
        "Journal(Path('results')).note_begun([Path('results/tables/.b.csv.1.part')]); "
        "print(flush=True); input()"
    )
    command = [sys.executable, "-c", code]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as job:
        assert job.stdout is not None
        job.stdout.readline()
        with pytest.raises(BiogripError, match="results: a run is going on"):
            clean(results)
        job.communicate(b"\n")
    assert clean(results) == "2 files of results removed."


def test_it_does_not_wait_for_a_number_that_another_process_has_got(results: Path) -> None:
    """Process 1 has been there since the computer was started, and later than this journal."""
    name = f"{os.uname().nodename}--1--1000000000000000000.jsonl"
    (results / JOURNALS / name).write_text("")
    assert clean(results) == "2 files of results removed."
    assert not results.exists()


def test_it_may_be_cleaned_from_inside(results: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The folder that one is in stays."""
    monkeypatch.chdir(results)
    assert clean(Path()) == "2 files of . removed."
    assert list(Path().iterdir()) == []


def test_nothing_is_removed_through_a_link(results: Path) -> None:
    results.rename("big_disk")
    results.symlink_to("big_disk")
    with pytest.raises(BiogripError, match="results: is a link"):
        clean(results)
    assert Path("big_disk/tables/a.csv").exists()


@pytest.mark.parametrize("door", ["run", "clean"])
def test_what_a_killed_job_was_writing_goes(results: Path, door: str) -> None:
    """A process that is killed half-way through a file leaves its scratch file on record."""
    code = (
        "import os; from pathlib import Path; from biogrip.files import atomic_write; "
        "from biogrip.running.journal import recorded_in\n"
        "with recorded_in(Path('results')), atomic_write(Path('results/figures/a.pdf')) as part:\n"
        "    part.write_text('half'); os.kill(os.getpid(), 9)"
    )
    subprocess.run([sys.executable, "-c", code], check=False)
    mine = results / "figures" / ".mine.pdf.1.part"
    mine.write_text("mine")
    assert len(list((results / "figures").iterdir())) == 2
    if door == "run":
        check_results(results, [], lambda _: False, changing=True)
    else:
        clean(results)
    assert list((results / "figures").iterdir()) == [mine]


def test_what_is_being_written_stays(results: Path) -> None:
    file = results / "tables" / "b.csv"
    with recorded_in(results), atomic_write(file) as scratch:
        assert scratch == scratch_path(file)
        scratch.write_text("b\n")
    assert file.read_text() == "b\n"
    assert not list((results / JOURNALS).glob("*.part"))
