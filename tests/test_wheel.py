"""The package as others install it: built, put where nothing else is, and used far from here."""

import json
import os
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
import yaml

import biogrip
from tests.helpers.places import EXAMPLE, ROOT
from tests.helpers.runs import TINY, ran

pytestmark = pytest.mark.nightly


def test_the_version_is_the_same_everywhere() -> None:
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    deposited = [
        json.loads((ROOT / name).read_text()) for name in ("codemeta.json", ".zenodo.json")
    ]
    versions = {about["version"] for about in (citation, *deposited)}
    assert versions == {biogrip.__version__}


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., str]:
    """What a command says in a folder, with the wheel before the libraries of this environment."""
    folder = tmp_path_factory.mktemp("wheel")
    options = ("--quiet", "--no-deps", "--no-index", "--no-build-isolation")

    def said(place: Path, *command: str | Path) -> str:
        paths = [str(folder / "there" / "bin"), str(Path(sys.executable).parent)]
        path = os.pathsep.join([*paths, os.environ["PATH"]])
        run = ran(place, *command, PATH=path, PYTHONPATH=str(folder / "there"))
        assert run.status == 0, run.output
        return run.output

    pip = (sys.executable, "-m", "pip", "--disable-pip-version-check")
    said(folder, *pip, "wheel", *options, "--wheel-dir", ".", ROOT)
    said(folder, *pip, "install", *options[:3], "--target", "there", *folder.glob("*.whl"))
    return said


def test_the_wheel_identifies_the_example(installed: Callable[..., str], tmp_path: Path) -> None:
    (tmp_path / "trace.csv").write_bytes(EXAMPLE.read_bytes())
    installed(tmp_path, "biogrip", "identify", "trace.csv")
    assert (tmp_path / "trace.identified.json").is_file()


def test_the_wheel_runs_a_study(installed: Callable[..., str], tmp_path: Path) -> None:
    """Snakefile, rules, profile and config come with it, and the claims of the paper."""
    (tmp_path / "tiny.yaml").write_text(yaml.safe_dump(TINY))
    (tmp_path / "mine.csv").write_bytes(EXAMPLE.read_bytes())
    place = installed(tmp_path, "python", "-c", "import biogrip; print(biogrip.__file__)")
    assert not Path(place).is_relative_to(ROOT)
    workflow = Path(place).parent / "workflow" / "Snakefile"
    given = ("-m", "snakemake", "-s", workflow, "-j2", "--configfile", "tiny.yaml")
    wanted = ["results/tables/contact_loss.md", "results/targets/liquid_drop_2.csv"]
    installed(tmp_path, "python", *given, "--", *wanted)
    assert [name for name in wanted if not (tmp_path / name).is_file()] == []
    installed(tmp_path, "python", *given, "-n", "--", "results/tables/claims.csv")
