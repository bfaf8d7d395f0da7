"""Results without Snakemake's notes: their own record says for what and of what they were made."""

import json
import os
import shutil
from pathlib import Path

import pytest
from biogrip.running.journal import recorded_in
from biogrip.running.manifest import Manifest

from biogrip.cli import main
from biogrip.files import write_text
from tests.helpers.runs import RECORDED, TINY, results_of, snakemake
from tests.helpers.runs import run as biogrip_run

pytestmark = pytest.mark.nightly

SEEDED = f"study_seed: 2\n{TINY}"


@pytest.fixture
def copied(tiny: Path, tmp_path: Path) -> Path:
    """Results alone, copied with new times."""
    folder = tmp_path / "copied"
    shutil.copytree(tiny / "results", folder / "results", copy_function=shutil.copyfile)
    return folder


def test_results_may_be_copied(copied: Path, tiny: Path) -> None:
    run = biogrip_run(copied, config=TINY)
    assert "Nothing to be done" in run.output
    assert results_of(copied) == results_of(tiny)


def test_results_of_other_settings_are_made_again(tiny: Path, tmp_path: Path) -> None:
    """Exactly what Snakemake makes again where it has its notes."""
    config = f"{TINY}  liquid_drop_2: {{sample: {{k: 21.0}}}}\n"
    with_notes, without = tmp_path / "with_notes", tmp_path / "without"
    shutil.copytree(tiny, with_notes)
    shutil.copytree(tiny, without, ignore=shutil.ignore_patterns(".snakemake"))
    known, unknown = (biogrip_run(folder, "-n", config=config) for folder in (with_notes, without))
    assert known.all_jobs()["target"] == 1
    assert unknown.all_jobs() == known.all_jobs()


def test_snakemake_alone_makes_nothing_of_outdated_results(tiny: Path, tmp_path: Path) -> None:
    """Without its notes it does not know that they are, but its jobs are not begun."""
    copied = tmp_path / "copied"
    shutil.copytree(tiny, copied, ignore=shutil.ignore_patterns(".snakemake"))
    (copied / "results" / "tables" / "errors.csv").unlink()
    before = results_of(copied)
    config = f"{TINY}  liquid_drop_2: {{sample: {{k: 21.0}}}}\n"
    run = snakemake(copied, "results/tables/errors.csv", config=config)
    assert run.status == 1
    assert "biogrip: made for other settings, by other code or of other files: " in run.output
    assert "results/tables/errors_liquid_drop_2.csv: was made for other settings" in run.output
    assert results_of(copied) == before


def test_a_target_alone_is_made_again(tiny: Path, tmp_path: Path) -> None:
    """And nothing besides: what else is of other settings was not asked for."""
    config = f"{TINY}  liquid_drop_2: {{sample: {{k: 21.0}}}}\n"
    folder = tmp_path / "copied"
    shutil.copytree(tiny, folder, ignore=shutil.ignore_patterns(".snakemake"))
    target = "results/targets/liquid_drop_2.csv"
    before = (folder / target).read_bytes()
    run = biogrip_run(folder, target, "--quiet", "host", config=config)
    assert run.all_jobs() == {"target": 1}
    assert (folder / target).read_bytes() != before
    assert "Nothing to be done" in biogrip_run(folder, target, config=config).output


def test_another_trace_is_identified_again(recorded: Path, tmp_path: Path) -> None:
    """Of the same name, and older than the results."""
    folder = tmp_path / "copied"
    shutil.copytree(recorded, folder, ignore=shutil.ignore_patterns(".snakemake"))
    assert "Nothing to be done" in biogrip_run(folder, "-n", config=RECORDED).output
    trace = folder / "mine.csv"
    lines = trace.read_text().splitlines()
    trace.write_text("\n".join(lines[:-1]) + "\n")
    os.utime(trace, ns=(0, 0))
    assert biogrip_run(folder, "-n", config=RECORDED).all_jobs()["recording"] == 1


@pytest.mark.parametrize("command", ["verify", "publish results published"])
def test_tables_of_another_study_are_refused(
    copied: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], command: str
) -> None:
    """They are what was written, and the study beside them is another one."""
    monkeypatch.chdir(copied)
    assert main(["verify"]) == 0
    study = json.loads(Path("results/study.json").read_text())
    study["cases"]["liquid_drop_2"]["sample"]["k"] = 21.0
    with recorded_in(Path("results")):
        write_text(Path("results/study.json"), json.dumps(study))
    capsys.readouterr()
    assert main(command.split()) == 1
    assert "was made for other settings, by other code or of other files" in capsys.readouterr().err
    assert not Path("published").exists()


def test_results_of_other_studies_are_told(copied: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run = biogrip_run(copied, "-n", config=TINY)
    assert "other studies" not in run.output
    other = "  liquid_drop_2: null\n  mine: {sample: {model: liquid_drop, k: 2, k_p: 0.1, c: 40}}\n"
    run = biogrip_run(copied, "all_tables", config=f"{TINY}{other}")
    assert run.status == 0, run.output
    assert "results also holds results of other studies (" in run.output
    assert "--directory" in run.output
    monkeypatch.chdir(copied)
    assert main(["publish", "results", "published", "--only", "errors*"]) == 0
    assert list(Path("published").rglob("*_mine.*"))
    assert not list(Path("published").rglob("*liquid_drop_2*"))


def test_what_a_person_made_is_known_as_what_a_job_made(
    copied: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(copied)
    Path("results/tables/errors.csv").unlink()
    assert main(["make", "errors"]) == 0
    assert main(["verify"]) == 0


def test_a_job_of_a_study_that_has_changed_is_refused(
    copied: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Another run was begun beside its own: what it reads is not what it was planned with."""
    monkeypatch.chdir(copied)
    study = json.loads(Path("results/study.json").read_text())
    job = ["make", "target", "--case", "liquid_drop_2"]
    digest = Manifest(Path("results")).last("targets/liquid_drop_2.csv").settings
    before = Path("results/targets/liquid_drop_2.csv").read_bytes()
    study["cases"]["liquid_drop_2"]["sample"]["k"] = 21.0
    Path("results/study.json").write_text(json.dumps(study))
    Path("results/targets/liquid_drop_2.csv").unlink()
    assert main([*job, "--made-for", digest]) == 1
    assert "study.json: has changed since this run was planned" in capsys.readouterr().err
    assert not Path("results/targets/liquid_drop_2.csv").exists()
    study["cases"]["liquid_drop_2"]["sample"]["k"] = 1.0
    Path("results/study.json").write_text(json.dumps(study))
    assert main([*job, "--made-for", digest]) == 0
    assert Path("results/targets/liquid_drop_2.csv").read_bytes() == before


def test_a_second_run_changes_nothing(tiny_copy: Path) -> None:
    """Not even what the study is: the first run's jobs read it."""
    locks = tiny_copy / ".snakemake" / "locks"
    locks.mkdir(exist_ok=True)
    (locks / "0.output.lock").write_text("results/targets/liquid_drop_2.csv\n")
    (tiny_copy / "results" / "tables" / "errors.csv").write_text("being written")
    before = results_of(tiny_copy)
    run = snakemake(tiny_copy, config=f"{TINY}  liquid_drop_2: {{sample: {{k: 21.0}}}}\n")
    assert run.status == 1
    assert results_of(tiny_copy) == before


def test_what_is_made_of_outdated_results_is_outdated(
    copied: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its own settings may be the same: a table of errors knows of no noise."""
    run = biogrip_run(copied, "results/measurements/liquid_drop_2/seeds_0-0.parquet", config=SEEDED)
    assert run.status == 0, run.output
    monkeypatch.chdir(copied)
    for only in ("errors*", "verdicts*"):
        assert main(["publish", "results", "published", "--only", only]) == 1
    monkeypatch.chdir("results")
    assert main(["verify", "."]) == 1
    assert "tables/errors.csv: was made for other settings" in capsys.readouterr().err


def test_nothing_is_made_by_hand_through_a_link(
    copied: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(copied)
    for name in ("results/tables", "results/.manifest", "results"):
        Path(name).rename("elsewhere")
        Path(name).symlink_to(Path("elsewhere").absolute())
        before = {path: path.read_bytes() for path in sorted(Path("elsewhere").rglob("*.csv"))}
        assert main(["make", "errors_of_case", "--case", "liquid_drop_2"]) == 1
        assert f"{name}: " in capsys.readouterr().err
        assert {
            path: path.read_bytes() for path in sorted(Path("elsewhere").rglob("*.csv"))
        } == before
        Path(name).unlink()
        Path("elsewhere").rename(name)
