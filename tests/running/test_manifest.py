import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

from biogrip.errors import BiogripError
from biogrip.files import write_text
from biogrip.running.clean import clean
from biogrip.running.journal import JOURNALS, Journal, recorded_in
from biogrip.running.manifest import NAME, Manifest, set_aside
from biogrip.running.verify import verify


@pytest.fixture
def results(tmp_path: Path) -> Path:
    """Results of two files, recorded."""
    folder = tmp_path / "results"
    with recorded_in(folder):
        write_text(folder / "tables" / "a.csv", "a,b\n1,2\n")
        write_text(folder / "b.json", "{}\n")
        write_text(tmp_path / "elsewhere.txt", "not among the results")
    return folder


def test_what_is_written_is_recorded(results: Path) -> None:
    manifest = Manifest(results)
    assert manifest.files == ["b.json", "tables/a.csv"]
    assert all(manifest.is_whole(path, thoroughly=True) for path in manifest.files)


def test_what_is_written_unwatched_is_not(tmp_path: Path) -> None:
    write_text(tmp_path / "a.csv", "a\n")
    assert Manifest(tmp_path).paths == []


@pytest.mark.parametrize("change", [b"", b"a,b\n1,3\n", b"a,b\n", b"a,b\n1,2\n\n"])
def test_what_is_changed_is_not_whole(results: Path, change: bytes) -> None:
    (results / "tables" / "a.csv").write_bytes(change)
    assert not Manifest(results).is_whole("tables/a.csv")
    with pytest.raises(BiogripError, match=r"a.csv: is not what was written"):
        verify(results)


def test_a_flipped_bit_under_the_same_time_is_found_by_reading(results: Path) -> None:
    file = results / "tables" / "a.csv"
    times = file.stat().st_atime_ns, file.stat().st_mtime_ns
    file.write_bytes(b"a,b\n1,3\n")
    os.utime(file, ns=times)
    manifest = Manifest(results)
    assert manifest.is_whole("tables/a.csv")
    assert not manifest.is_whole("tables/a.csv", thoroughly=True)


def test_a_copy_with_new_times_is_whole(results: Path, tmp_path: Path) -> None:
    shutil.copytree(results, tmp_path / "copy", copy_function=shutil.copyfile)
    manifest = Manifest(tmp_path / "copy")
    assert all(manifest.is_whole(path) for path in manifest.files)


def test_saving_merges_the_journals_and_keeps_what_they_said(results: Path) -> None:
    before = Manifest(results)
    before.save()
    assert not list((results / JOURNALS).glob("*--*.jsonl"))
    assert Manifest(results).files == before.files


def test_the_journal_of_a_living_process_stays(results: Path) -> None:
    code = (
        "from pathlib import Path; from biogrip.running.journal import Journal; "
        f"Journal(Path({str(results)!r})).note_begun([Path({str(results)!r}) / 'logs' / 'x.log']); "
        "print(flush=True); input()"
    )
    command = [sys.executable, "-c", code]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as job:
        assert job.stdout is not None
        job.stdout.readline()
        Manifest(results).save()
        (left,) = (results / JOURNALS).glob("*--*.jsonl")
        assert f"--{job.pid}--" in left.name
        job.communicate(b"\n")
    Manifest(results).save()
    assert not left.exists()
    assert Manifest(results).knows("logs/x.log")


@pytest.mark.parametrize("cut", [0, 1, 60, -2, -70])
@pytest.mark.parametrize("name", [NAME, f"{JOURNALS}/{NAME}"])
def test_a_damaged_copy_is_replaced_by_the_other(results: Path, name: str, cut: int) -> None:
    Manifest(results).save()
    file = results / name
    whole = file.read_bytes()
    file.write_bytes(whole[:cut])
    manifest = Manifest(results)
    assert manifest.files == ["b.json", "tables/a.csv"]
    manifest.save()
    assert file.read_bytes() == whole
    assert Path(f"{file}.edited").read_bytes() == whole[:cut]


def test_a_manifest_that_is_somebody_elses_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / NAME).write_text("my list of ships\n")
    with pytest.raises(BiogripError, match="Move it away"):
        Manifest(tmp_path)
    assert (tmp_path / NAME).read_text() == "my list of ships\n"


def test_the_last_line_of_a_journal_may_be_cut(results: Path) -> None:
    (journal,) = (results / JOURNALS).glob("*--*.jsonl")
    journal.write_bytes(journal.read_bytes()[:-30])
    assert Manifest(results).files == ["tables/a.csv"]


def test_a_write_that_was_killed_leaves_what_was_written_before(results: Path) -> None:
    """The record comes first; the file that is still there is ours, though not the latest."""
    (results / "new").write_text("later\n")
    Journal(results).note(results / "b.json", results / "new")
    manifest = Manifest(results)
    assert not manifest.is_whole("b.json")
    assert manifest.was_written("b.json")


def test_nothing_is_replaced_when_a_file_is_set_aside(tmp_path: Path) -> None:
    for count in range(3):
        (tmp_path / "a.csv").write_text(str(count))
        set_aside(tmp_path / "a.csv")
    found = {path.name: path.read_text() for path in tmp_path.iterdir()}
    assert found == {"a.csv.edited": "0", "a.csv.edited.2": "1", "a.csv.edited.3": "2"}


def test_cleaning_removes_what_was_written_and_nothing_else(results: Path) -> None:
    (results / "tables" / "paper.tex").write_text("mine")
    (results / "b.json").write_text("edited")
    Journal(results).note_begun([results / "logs" / "a.log"])
    (results / "logs").mkdir()
    (results / "logs" / "a.log").write_text("")
    assert "b.json" in clean(results)
    left = {str(path.relative_to(results)) for path in results.rglob("*")}
    assert left == {"b.json", "tables", "tables/paper.tex"}


def test_cleaning_counts_what_it_removes(results: Path, tmp_path: Path) -> None:
    """Neither what is gone already, nor a link, which is nobody's to remove."""
    write_text(tmp_path / "mine.log", "")
    log = results / "logs" / "a.log"
    Journal(results).note_begun([log])
    log.parent.mkdir()
    log.symlink_to(tmp_path / "mine.log")
    (results / "b.json").unlink()
    assert clean(results) == f"1 file of {results} removed."
    assert log.is_symlink()


def test_verifying_names_what_is_missing(results: Path) -> None:
    assert verify(results) == f"2 files of {results} read: as written."
    (results / "b.json").unlink()
    with pytest.raises(BiogripError, match=r"b.json: is missing"):
        verify(results)


def test_the_record_of_30_000_seeds_is_held_against_its_files_in_two_seconds(
    tmp_path: Path,
) -> None:
    """Three cases of 10,000 seeds are some 250 files; here are ten times as many."""
    journal = Journal(tmp_path)
    (tmp_path / "batches").mkdir()
    for count in range(2500):
        file = tmp_path / "batches" / f"seeds_{count}.csv"
        file.write_text(f"{count}\n")
        journal.note(file, file)
    Manifest(tmp_path).save()
    start = time.process_time()
    manifest = Manifest(tmp_path)
    assert all(manifest.is_whole(path) for path in manifest.files)
    manifest.save()
    assert time.process_time() - start < 2
    lines = (tmp_path / NAME).read_text().splitlines()
    assert len(lines) == 2501
    assert json.loads(lines[0])["path"] == "batches/seeds_0.csv"
