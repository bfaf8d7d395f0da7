"""Records that anybody may have written: nothing outside is touched, and nothing ends in a stack.

Hostile and malformed records are made at random, and every command that follows records is let
loose on them.
"""

import json
import random
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from biogrip.cli import main
from biogrip.errors import BiogripError
from biogrip.files import write_text
from biogrip.running.journal import JOURNALS, hash_file, journals_in, recorded_in
from biogrip.running.manifest import NAME, Manifest
from biogrip.running.records import Record, hash_lines, read_sums, refuse_outside

OUTSIDE = ("../thesis.txt", "../../thesis.txt", "tables/../../thesis.txt", "{}/thesis.txt")
PLAIN: dict[str, Any] = {
    "path": "tables/a.csv",
    "size": 0,
    "sha256": "",
    "modified_ns": 0,
    "recorded_ns": 0,
}
ODD: tuple[Any, ...] = (None, -1, 1.5, "", "x", [], {}, True, 10**30, "\ud800", "a\0b", "a//b", ".")


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Results of a study beside files of the user's."""
    monkeypatch.chdir(tmp_path)
    for name in ("thesis.txt", "elsewhere/thesis.txt", "results/mine.txt"):
        write_text(tmp_path / name, "precious\n")
    with recorded_in(tmp_path / "results"):
        write_text(tmp_path / "results" / "tables" / "a.csv", "a,b\n1,2\n")
    return tmp_path


def precious(place: Path) -> list[str]:
    """Files that are the user's and as they were."""
    found = ("thesis.txt", "elsewhere/thesis.txt", "results/mine.txt")
    return [name for name in found if (place / name).read_text() == "precious\n"]


def hostile_path(rng: random.Random, place: Path) -> str:
    return rng.choice(OUTSIDE).format(place)


def hostile_record(rng: random.Random, place: Path) -> dict[str, Any]:
    """A record that names a file of the user's with its true size and hash."""
    file = place / "thesis.txt"
    record = {**PLAIN, "path": hostile_path(rng, place), "recorded_ns": 1}
    if rng.random() < 0.5:
        record |= {"size": file.stat().st_size, "sha256": hash_file(file)}
    return record


def malformed_record(rng: random.Random, _: Path) -> dict[str, Any]:
    record: dict[str, Any] = dict(PLAIN)
    name = rng.choice([*PLAIN, "colour"])
    record[name] = rng.choice(ODD)
    if rng.random() < 0.3:
        record.pop(rng.choice([*PLAIN]))
    return record


def journal(rng: random.Random, place: Path) -> None:
    """A journal of a process that is gone, with what nobody of ours wrote in it."""
    make = rng.choice([hostile_record, malformed_record])
    lines = [json.dumps(rng.choice([PLAIN, make(rng, place)])) for _ in range(3)]
    lines.append(json.dumps(make(rng, place)))
    text = "\n".join(lines).encode() + b"\n"
    if rng.random() < 0.3:
        text = bytes(rng.randrange(256) for _ in range(50)) + b"\n" + text
    name = rng.choice(["h--1--1", "host--1", "my--own--notes", "h--99999999999--1", "--1--1"])
    (place / "results" / JOURNALS / f"{name}.jsonl").write_bytes(text)


def manifest(rng: random.Random, place: Path) -> None:
    """Both copies, with a hash that fits."""
    make = rng.choice([hostile_record, malformed_record])
    text = "".join(json.dumps(make(rng, place)) + "\n" for _ in range(3))
    for copy in (place / "results" / NAME, place / "results" / JOURNALS / NAME):
        write_text(copy, text + hash_lines(text.encode()))


def sums(rng: random.Random, place: Path) -> None:
    """Names and hashes of what is said to be published."""
    true = hash_file(place / "thesis.txt")
    lines = [
        f"{rng.choice([true, '0' * 64, '0000', ''])}  {hostile_path(rng, place)}".encode(),
        rng.choice([b"nothing", b"\xff\xfe  x", true.encode(), f"{true} x".encode(), b""]),
    ]
    rng.shuffle(lines)
    write_text(place / "published" / "tables" / "mine.csv", "mine\n")
    (place / "published" / "SHA256SUMS").write_bytes(b"\n".join(lines) + b"\n")


@pytest.mark.parametrize("kind", [journal, manifest, sums])
@pytest.mark.parametrize("seed", range(70))
def test_no_record_reaches_outside(
    kind: Callable[[random.Random, Path], None],
    seed: int,
    place: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    kind(random.Random(f"{kind.__name__} {seed}"), place)
    results = place / "results"
    own = {results / "tables" / "a.csv", results / NAME, results / JOURNALS / NAME}
    own.update(journals_in(results))
    others = {path for path in place.rglob("*") if path.is_file()} - own
    for command in (["verify"], ["publish", "results", "published"], ["clean"]):
        status = main(command)
        assert status in (0, 1)
        assert (capsys.readouterr().err != "") == (status == 1)
    assert len(precious(place)) == 3
    assert [path for path in others if not path.exists()] == []


@pytest.mark.parametrize(
    "path",
    [
        *OUTSIDE,
        "",
        ".",
        "./a",
        "a/",
        "a//b",
        "a/./b",
        "/",
        "a\0b",
        "\ud800",
        "x" * 300,
        "a/" * 3000 + "b",
    ],
)
def test_a_path_stays_inside(path: str) -> None:
    with pytest.raises(ValueError, match=r"path is|surrogates") as refused:
        refuse_outside(path.format("/home/me"))
    assert len(str(refused.value)) < 300


def test_a_record_behind_a_link_is_refused(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    tables = place / "results" / "tables"
    tables.rename(place / "big_disk")
    tables.symlink_to(place / "big_disk")
    for command in ("verify", "clean"):
        assert main([command]) == 1
        assert "results/tables: is a link" in capsys.readouterr().err
    assert (place / "big_disk" / "a.csv").exists()
    assert (place / "results" / JOURNALS).exists()


@pytest.mark.parametrize("kind", ["file", "link"])
@pytest.mark.parametrize("name", [JOURNALS, NAME, f"{JOURNALS}/{NAME}"])
def test_what_is_in_the_place_of_the_record_is_named(
    place: Path, name: str, kind: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Manifest(place / "results").save()
    record = place / "results" / name
    record.rename(place / "moved")
    if kind == "link":
        record.symlink_to(place / "moved")
    else:
        (record.mkdir if name != JOURNALS else record.touch)()
    assert main(["clean"]) == 1
    assert f"results/{name}: found a" in capsys.readouterr().err
    assert (place / "results" / "tables" / "a.csv").exists()


def test_names_of_others_are_no_journals(place: Path) -> None:
    """What is called otherwise is neither read nor removed."""
    notes = [place / "results" / JOURNALS / name for name in ("my--notes.jsonl", "host--1.jsonl")]
    for file in notes:
        file.write_text("not JSON at all\n")
    assert main(["clean"]) == 0
    assert [file.read_text() for file in notes] == ["not JSON at all\n"] * 2


def test_a_record_is_read_as_it_was_written() -> None:
    record = Record("tables/a.csv", 3, "0" * 64, 1, 2, "settings", "inputs")
    assert Record(**json.loads(record.line)) == record


def test_records_of_earlier_versions_are_read() -> None:
    assert Record(**PLAIN).settings == ""


def test_sums_name_the_line(tmp_path: Path) -> None:
    file = tmp_path / "SHA256SUMS"
    file.write_text(f"{'0' * 64}  tables/a.csv\nno blanks\n")
    with pytest.raises(BiogripError, match=r"SHA256SUMS: line 2: found what biogrip did not write"):
        read_sums(file)
