"""Whatever becomes of results between two runs: the next ends with the same ones, or says so."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from biogrip.running.resolved import read_study, write_study
from biogrip.running.wholeness import check_results

from tests.helpers import runs
from tests.helpers.in_process import inputs_and_outputs
from tests.helpers.runs import TINY, Run, results_of, snakemake, waited_for

pytestmark = pytest.mark.nightly


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


DAMAGES = (cut_in_the_middle, cut_between_rows, emptied, deleted, a_byte_changed)


def damaged_by(damage: Callable[[Path], None], files: list[Path]) -> dict[Path, bytes]:
    """Damage files; gives what is left of those of which anything is."""
    for file in files:
        damage(file)
    return {file: file.read_bytes() for file in files if file.exists() and file.stat().st_size}


@pytest.mark.parametrize("damage", DAMAGES, ids=lambda damage: damage.__name__)
def test_damage_of_every_kind_of_file_is_found(
    tiny: Path,
    tiny_copy: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    damage: Callable[[Path], None],
) -> None:
    """Before a run plans anything, its place is empty, whatever the damage was."""
    monkeypatch.chdir(tiny_copy)
    results = Path("results")
    study = read_study(results)
    _, outputs = inputs_and_outputs(study)
    files = one_of_each_kind(tiny_copy)
    assert len(files) >= 25
    contents = damaged_by(damage, files)
    check_results(results, outputs, outputs.__contains__, changing=True)
    write_study(study, results)
    said = capsys.readouterr().err
    found, before = results_of(tiny_copy), results_of(tiny)
    for file, content in contents.items():
        kept = file.with_name(f"{file.name}.edited")
        assert f"kept as {kept.relative_to(tiny_copy)}; making it again" in said
        assert kept.read_bytes() == content
        found.pop(str(kept.relative_to(tiny_copy / "results")), None)
    hit = {str(file.relative_to(tiny_copy / "results")) for file in files} - {"study.json"}
    assert [file.name for file in files if file.exists()] == ["study.json"]
    assert found == {name: content for name, content in before.items() if name not in hit}


def test_every_kind_of_file_is_made_again(tiny: Path, tiny_copy: Path) -> None:
    """In one run, the damages by turns."""
    files = one_of_each_kind(tiny_copy)
    contents: dict[Path, bytes] = {}
    for turn, damage in enumerate(DAMAGES):
        contents |= damaged_by(damage, files[turn :: len(DAMAGES)])
    assert len(contents) > len(files) / 2
    run = runs.run(tiny_copy, config=TINY)
    assert run.status == 0, run.output
    found = results_of(tiny_copy)
    for file, content in contents.items():
        kept = file.with_name(f"{file.name}.edited")
        assert f"kept as {kept.relative_to(tiny_copy)}; making it again" in run.output
        assert kept.read_bytes() == content
        found.pop(str(kept.relative_to(tiny_copy / "results")), None)
    assert found == results_of(tiny)
    assert [file for file in files if not file.exists()] == []


def test_what_is_asked_for_is_everything_that_is_made(tiny: Path, tmp_path: Path) -> None:
    """Or a file that is lost would be missed only when it is needed."""
    asked = waited_for(snakemake(tmp_path, "-n", "all", config=TINY))
    results = tiny / "results"
    made = {
        str(path.relative_to(tiny))
        for path in results.rglob("*.*")
        if path.is_file() and path.relative_to(results).parts[0] not in ("logs", ".manifest")
    }
    assert made - {"results/manifest.jsonl", "results/study.json"} == asked


@pytest.fixture
def mine(tiny_copy: Path, tmp_path: Path) -> Iterator[dict[Path, str]]:
    """Files of a user's, among the results and beyond links; they are to be what they were."""
    elsewhere = tmp_path / "thesis"
    elsewhere.mkdir()
    results = tiny_copy / "results"
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
    tiny: Path, tiny_copy: Path, mine: dict[Path, str]
) -> None:
    (tiny_copy / "results" / "tables" / "errors.csv").unlink()
    run = snakemake(tiny_copy, config=TINY)
    assert run.status == 0, run.output
    assert results_of(tiny).items() <= results_of(tiny_copy).items()


@pytest.mark.parametrize("door", [snakemake, runs.run], ids=["snakemake", "biogrip"])
def test_a_file_in_the_way_stops_the_run_before_it_starts(
    tmp_path: Path, door: Callable[..., Run]
) -> None:
    mine = tmp_path / "results" / "figures" / "torque.png"
    mine.parent.mkdir(parents=True)
    mine.write_text("drawn by hand")
    run = door(tmp_path, config=TINY)
    assert run.status == 1
    assert "results/figures/torque.png: in the way, and not written by this study" in run.output
    assert "Traceback" not in run.output
    assert mine.read_text() == "drawn by hand"
    assert [path for path in (tmp_path / "results").rglob("*") if path.is_file()] == [mine]


def test_looking_changes_nothing(tiny_copy: Path) -> None:
    errors = tiny_copy / "results" / "tables" / "errors.csv"
    errors.write_text("edited")
    before = results_of(tiny_copy)
    outputs = {}
    for look in ("-n", "--summary", "--list-rules", "--dag"):
        run = snakemake(tiny_copy, look, config=TINY)
        assert run.status == 0, run.output
        assert results_of(tiny_copy) == before
        outputs[look] = run.output
    assert "`biogrip run` makes it again" in outputs["-n"]


def test_snakemake_alone_keeps_an_edited_file_that_it_makes_again(
    tiny: Path, tiny_copy: Path
) -> None:
    errors = tiny_copy / "results" / "tables" / "errors.csv"
    errors.write_text("edited")
    run = snakemake(tiny_copy, "--forcerun", "results/tables/errors.csv", config=TINY)
    assert run.status == 0, run.output
    assert (errors.parent / "errors.csv.edited").read_text() == "edited"
    assert errors.read_bytes() == (tiny / "results" / "tables" / "errors.csv").read_bytes()


def test_snakemake_alone_makes_nothing_of_an_edited_file(tiny_copy: Path) -> None:
    """It takes what is newer for what is right."""
    edited = tiny_copy / "results" / "tables" / "errors_liquid_drop_2.csv"
    edited.write_text("edited")
    before = results_of(tiny_copy)
    run = snakemake(tiny_copy, config=TINY)
    assert run.status == 1
    assert "errors_liquid_drop_2.csv: is not what was written (edited" in run.output
    assert "errors_liquid_drop_2.csv: is not what was written, and would be read" in run.output
    assert results_of(tiny_copy) == before
