"""Whatever becomes of results between two runs: the next ends with the same ones, or says so."""

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.workflow.conftest import TINY, results_of, snakemake


@pytest.fixture
def study(tiny: Path, tmp_path: Path) -> Path:
    copied = tmp_path / "study"
    shutil.copytree(tiny, copied)
    return copied


def one_of_each_kind(folder: Path) -> list[Path]:
    """One file a folder and ending."""
    results = folder / "results"
    kinds: dict[tuple[Path, str], Path] = {}
    for path in sorted(results.rglob("*.*")):
        hidden = path.relative_to(results).parts[0] in ("logs", ".manifest")
        if path.is_file() and not hidden and path.name != "manifest.jsonl":
            kinds.setdefault((path.parent, path.suffix), path)
    return list(kinds.values())


def cut_in_the_middle(path: Path) -> None:
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def cut_between_rows(path: Path) -> None:
    lines = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(b"".join(lines[: max(1, 2 * len(lines) // 3)]))
    if len(lines) < 3:
        cut_in_the_middle(path)


def emptied(path: Path) -> None:
    path.write_bytes(b"")


def deleted(path: Path) -> None:
    path.unlink()


def a_byte_changed(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


@pytest.mark.parametrize(
    "damage", [cut_in_the_middle, cut_between_rows, emptied, deleted, a_byte_changed]
)
def test_every_kind_of_file_is_made_again(
    tiny: Path, study: Path, damage: Callable[[Path], None]
) -> None:
    damaged = one_of_each_kind(study)
    assert len(damaged) >= 25
    contents = {}
    for path in damaged:
        damage(path)
        if path.exists() and path.stat().st_size:
            contents[path] = path.read_bytes()
    run = snakemake(study, config=TINY)
    assert run.status == 0, run.output
    found = results_of(study)
    for path, content in contents.items():
        kept = path.with_name(f"{path.name}.edited")
        assert f"kept as {kept.relative_to(study)}; making it again" in run.output
        assert kept.read_bytes() == content
        found.pop(str(kept.relative_to(study / "results")), None)
    assert found == results_of(tiny)
    for path in damaged:
        assert path.exists()


def test_what_is_asked_for_is_everything_that_is_made(tiny: Path) -> None:
    """Or a file that is lost would be missed only when it is needed."""
    run = snakemake(tiny, "-n", "-F", "all", config=TINY)
    (block,) = (text for text in run.output.split("\n\n") if "rule all:" in text)
    (line,) = (line for line in block.splitlines() if line.strip().startswith("input: "))
    asked = set(line.strip().removeprefix("input: ").split(", "))
    results = tiny / "results"
    made = {
        str(path.relative_to(tiny))
        for path in results.rglob("*.*")
        if path.is_file() and path.relative_to(results).parts[0] not in ("logs", ".manifest")
    }
    assert made - {"results/manifest.jsonl", "results/study.json"} == asked


@pytest.fixture
def mine(study: Path, tmp_path: Path) -> Iterator[dict[Path, str]]:
    """Files of a user's, among the results and beyond links; they are to be what they were."""
    elsewhere = tmp_path / "thesis"
    elsewhere.mkdir()
    results = study / "results"
    (results / "calibrations").symlink_to(elsewhere)
    (results / "tables" / "link.tex").symlink_to(elsewhere / "chapter.tex")
    files = {
        results / "notes.md": "no final newline",
        results / "tables" / "paper.tex": "no end",
        results / "traces" / "mine" / "lab.csv": "time,angle\n0,",
        results / "figures" / "draft.png": "no picture",
        results / "identifications" / "endothelial_cell.csv": "of a case that is not run",
        elsewhere / "chapter.tex": "beyond a link",
        elsewhere / "liquid_drop_2.yaml": "beyond a linked folder",
    }
    for path, text in files.items():
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    yield files
    assert {path: path.read_text() for path in files} == files


def test_a_run_leaves_files_of_the_users_alone(
    tiny: Path, study: Path, mine: dict[Path, str]
) -> None:
    (study / "results" / "tables" / "errors.csv").unlink()
    run = snakemake(study, config=TINY)
    assert run.status == 0, run.output
    assert results_of(tiny).items() <= results_of(study).items()


def test_a_file_in_the_way_stops_the_run_before_it_starts(tmp_path: Path) -> None:
    mine = tmp_path / "results" / "figures" / "torque.png"
    mine.parent.mkdir(parents=True)
    mine.write_text("drawn by hand")
    run = snakemake(tmp_path, config=TINY)
    assert run.status == 1
    assert "results/figures/torque.png: in the way, and not written by this study" in run.output
    assert "Traceback" not in run.output
    assert mine.read_text() == "drawn by hand"
    assert [path for path in (tmp_path / "results").rglob("*") if path.is_file()] == [mine]


def test_looking_changes_nothing(study: Path) -> None:
    errors = study / "results" / "tables" / "errors.csv"
    errors.write_text("edited")
    before = results_of(study)
    for look in ("-n", "--summary", "--list-rules", "--dag"):
        run = snakemake(study, look, config=TINY)
        assert run.status == 0, run.output
        assert results_of(study) == before
    assert "a run makes it again" in snakemake(study, "-n", config=TINY).output
