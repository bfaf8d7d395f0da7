"""Publishing: whole or not at all, through no link, and only what the study has."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from biogrip.errors import BiogripError
from biogrip.running.journal import hash_file
from biogrip.running.published import SUMS, publish


@pytest.fixture
def results(tiny: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A finished study's, and in the same folder one in which to publish."""
    monkeypatch.chdir(shutil.copytree(tiny, tmp_path / "study"))
    return Path("results")


def contents(folder: Path) -> dict[str, bytes]:
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def test_tables_and_figures_are_published_with_sums_that_hold(results: Path) -> None:
    told = publish(results, Path("published"))
    found = contents(Path("published"))
    assert told == f"{len(found) - 1} files published in published."
    assert found["tables/errors.csv"] == (results / "tables" / "errors.csv").read_bytes()
    assert "figures/overview.png" in found
    subprocess.run(["sha256sum", "--check", "--quiet", SUMS], cwd="published", check=True)
    publish(results, Path("published"))
    assert contents(Path("published")) == found


def test_what_is_published_no_more_goes_and_what_is_the_users_stays(results: Path) -> None:
    publish(results, Path("published"))
    Path("published/README.md").write_text("mine")
    Path("published/tables/errors.csv").write_text("edited")
    publish(results, Path("published"), "errors")
    assert set(contents(Path("published"))) == {
        "README.md",
        SUMS,
        "tables/errors.csv",
        "tables/errors.csv.edited",
        "tables/errors.md",
        "tables/errors.tex",
    }
    assert Path("published/tables/errors.csv.edited").read_text() == "edited"


def test_tables_of_other_studies_are_not_published(results: Path) -> None:
    """They lie among the results, and no file says of which study they are."""
    shutil.copy(results / "tables" / "errors.csv", results / "tables" / "errors_other.csv")
    publish(results, Path("published"))
    assert not Path("published/tables/errors_other.csv").exists()


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        (lambda: Path("results/tables/errors.csv").unlink(), "errors.csv is missing"),
        (lambda: Path("results/tables/errors.csv").write_text("x"), "is not what was written"),
        (lambda: Path("results/study.json").unlink(), "study.json: there is none"),
    ],
)
def test_only_a_whole_study_is_published(results: Path, damage: object, said: str) -> None:
    assert callable(damage)
    damage()
    with pytest.raises(BiogripError, match=said):
        publish(results, Path("published"))
    assert not Path("published").exists()


@pytest.mark.parametrize("place", ["published", "published/tables"])
def test_nothing_is_published_through_a_link(results: Path, place: str) -> None:
    Path("elsewhere").mkdir()
    Path(place).parent.mkdir(exist_ok=True)
    Path(place).symlink_to(Path("elsewhere").absolute())
    with pytest.raises(BiogripError, match=rf"{place}: (found|is) a link"):
        publish(results, Path("published"))
    assert not list(Path("elsewhere").iterdir())


@pytest.mark.parametrize("kind", ["file", "folder", "folder in the place of a file of ours"])
def test_what_is_in_the_way_stops_it_before_anything_is_changed(results: Path, kind: str) -> None:
    place = Path("published/tables/errors.csv")
    if kind == "file":
        place.parent.mkdir(parents=True)
        place.write_text("mine")
    elif kind == "folder":
        place.mkdir(parents=True)
    else:
        publish(results, Path("published"))
        place.unlink()
        place.mkdir()
    before = contents(Path("published"))
    with pytest.raises(BiogripError, match=r"errors.csv: in the way"):
        publish(results, Path("published"))
    assert contents(Path("published")) == before


def test_a_full_disk_changes_nothing(results: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    publish(results, Path("published"), "errors")
    before = contents(Path("published"))
    copied: list[Path] = []

    def copy(source: Path, to: Path) -> None:
        if len(copied) == 5:
            raise OSError(28, "No space left on device", str(to))
        copied.append(to)
        to.write_bytes(source.read_bytes())

    monkeypatch.setattr(shutil, "copyfile", copy)
    with pytest.raises(OSError, match="No space left"):
        publish(results, Path("published"))
    assert contents(Path("published")) == before


@pytest.mark.parametrize("count", [0, 1, 7])
def test_a_kill_is_made_good_by_publishing_again(
    results: Path, monkeypatch: pytest.MonkeyPatch, count: int
) -> None:
    """Killed when so many files are in their places: none is taken for an edit of the user's."""
    publish(results, Path("published"))
    whole = contents(Path("published"))
    # As published from another study before.
    sums = Path("published", SUMS).read_text()
    for file in sorted(Path("published/tables").iterdir())[:20]:
        old = hash_file(file)
        file.write_text("earlier\n")
        sums = sums.replace(old, hash_file(file), 1)
    Path("published", SUMS).write_text(sums)
    done: list[object] = []
    replace = os.replace

    def replace_some(source: Path, to: Path) -> None:
        if not str(to).endswith(SUMS):
            if len(done) == count:
                raise KeyboardInterrupt
            done.append(to)
        replace(source, to)

    with monkeypatch.context() as patch:
        patch.setattr(os, "replace", replace_some)
        with pytest.raises(KeyboardInterrupt):
            publish(results, Path("published"))
    publish(results, Path("published"))
    assert contents(Path("published")) == whole
