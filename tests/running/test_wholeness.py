from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from biogrip.errors import BiogripError
from biogrip.files import write_text
from biogrip.running.journal import recorded_in
from biogrip.running.wholeness import Claim, check_results


@pytest.fixture
def results(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    folder = Path("results")
    with recorded_in(folder):
        for name in ("a.csv", "b.csv"):
            write_text(folder / "tables" / name, f"{name}\n")
    return folder


def check(results: Path, *, changing: bool = True, makes: str = "results/tables/") -> None:
    asked = ["results/tables/a.csv", "results/tables/new.csv"]
    check_results(results, asked, lambda file: file.startswith(makes), changing=changing)


def names(results: Path) -> set[str]:
    return {path.name for path in (results / "tables").iterdir()}


def test_what_is_whole_stays(results: Path, capsys: pytest.CaptureFixture[str]) -> None:
    check(results)
    assert names(results) == {"a.csv", "b.csv"}
    assert capsys.readouterr().err == ""


def test_an_edited_file_is_kept_beside(results: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (results / "tables" / "a.csv").write_text("edited")
    check(results)
    assert names(results) == {"a.csv.edited", "b.csv"}
    assert (results / "tables" / "a.csv.edited").read_text() == "edited"
    said = capsys.readouterr().err
    assert "results/tables/a.csv: is not what was written" in said
    assert "kept as results/tables/a.csv.edited; making it again" in said


def test_an_emptied_file_is_not_worth_keeping(results: Path) -> None:
    (results / "tables" / "a.csv").write_text("")
    check(results)
    assert names(results) == {"b.csv"}


def test_a_look_changes_nothing(results: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (results / "tables" / "a.csv").write_text("edited")
    check(results, changing=False)
    assert names(results) == {"a.csv", "b.csv"}
    assert "`biogrip run` makes it again" in capsys.readouterr().err


def test_what_the_study_no_longer_makes_is_left_alone(results: Path) -> None:
    (results / "tables" / "a.csv").write_text("edited")
    check(results, makes="results/figures/")
    assert names(results) == {"a.csv", "b.csv"}


def test_files_of_the_users_are_never_opened(results: Path) -> None:
    mine = [results / "notes.md", results / "tables" / "paper.tex", results / "traces/me/lab.csv"]
    for file in mine:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text("no line end")
    check(results)
    Claim(results).begin([results / "tables" / "new.csv"], [results / "logs" / "new.log"])
    assert {file.read_text() for file in mine} == {"no line end"}


@pytest.mark.parametrize("kind", ["file", "folder", "broken link"])
def test_what_is_in_the_way_is_refused(results: Path, tmp_path: Path, kind: str) -> None:
    other = results / "tables" / "new.csv"
    if kind == "file":
        other.write_text("mine")
    elif kind == "folder":
        other.mkdir()
    else:
        other.symlink_to(tmp_path / "nowhere")
    with pytest.raises(BiogripError, match=r"new.csv: (in the way|is a link)"):
        check(results)
    with pytest.raises(BiogripError, match=r"new.csv: (in the way|is a link)"):
        Claim(results).begin([other], [])
    assert not (tmp_path / "nowhere").exists()


@pytest.mark.parametrize("place", ["results", "results/figures", "results/logs"])
def test_no_link_is_followed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, place: str) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "thesis").mkdir()
    link = tmp_path / place
    link.parent.mkdir(exist_ok=True)
    link.symlink_to(tmp_path / "thesis")
    with pytest.raises(BiogripError, match=f"{place}: is a link"):
        Claim(Path("results")).begin([Path("results/figures/a.png")], [Path("results/logs/a.log")])
    if place == "results":
        with pytest.raises(BiogripError, match="results: is a link"):
            check(Path("results"))
    assert not list((tmp_path / "thesis").iterdir())


def test_an_edited_output_is_kept_beside_unless_it_is_only_touched(results: Path) -> None:
    edited = results / "tables" / "a.csv"
    edited.write_text("edited")
    Claim(results).begin([edited], [], touching=True)
    assert names(results) == {"a.csv", "b.csv"}
    Claim(results).begin([edited], [])
    assert names(results) == {"a.csv.edited", "b.csv"}


def test_what_is_not_as_it_was_written_is_not_read(results: Path) -> None:
    first, second = results / "tables" / "a.csv", results / "tables" / "b.csv"
    Claim(results).begin([], [], [first, second, Path("mine.csv")])
    with pytest.raises(BiogripError, match=r"b\.csv: was made for other settings, by other code"):
        Claim(results).begin([], [], [first, second], lambda _: ["tables/b.csv"])
    first.write_text("edited")
    with pytest.raises(BiogripError, match=r"a\.csv: is not what was written, and would be read"):
        Claim(results).begin([], [], [first, second])
    # A job makes it again before another reads it.
    Claim(results).begin([first], [], [first, second])


def test_logs_are_claimed_once_and_for_all(results: Path) -> None:
    log = results / "logs" / "a.log"
    Claim(results).begin([], [log])
    log.parent.mkdir()
    log.write_text("said")
    Claim(results).begin([], [log])
    other = results / "logs" / "mine.log"
    other.write_text("mine")
    with pytest.raises(BiogripError, match=r"mine.log: in the way"):
        Claim(results).begin([], [other])


def test_results_folder_must_be_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("results").write_text("")
    with pytest.raises(BiogripError, match="results: found a file, allowed is a folder"):
        check(Path("results"))


def test_many_may_look_at_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(check, [Path("results")] * 100))
    assert not list(Path("results").iterdir())
