"""The package as others install it: built, put where nothing else is, and used far from here."""

import json
import os
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest
import yaml

import biogrip
from tests.helpers.places import EXAMPLE, ROOT
from tests.helpers.runs import TINY

pytestmark = pytest.mark.nightly

PIP = (sys.executable, "-m", "pip", "--disable-pip-version-check")


def called(*command: str | Path, folder: Path) -> str:
    """What a command says in a folder, with nothing of this process' environment."""
    environment = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "VIRTUAL"))}
    done = subprocess.run(
        [*map(str, command)],
        cwd=folder,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stdout
    return done.stdout


def test_the_version_is_the_same_everywhere() -> None:
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    deposited = [
        json.loads((ROOT / name).read_text()) for name in ("codemeta.json", ".zenodo.json")
    ]
    versions = {about["version"] for about in (citation, *deposited)}
    assert versions == {biogrip.__version__}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    options = ("--quiet", "--no-deps", "--no-index", "--no-build-isolation", "--wheel-dir", ".")
    called(*PIP, "wheel", *options, ROOT, folder=folder)
    (built,) = folder.glob("*.whl")
    return built


@pytest.fixture(scope="module")
def commands(wheel: Path) -> Path:
    """The commands of an environment that has the wheel, and borrows the libraries of this one."""
    folder = wheel.parent / "empty"
    called(sys.executable, "-m", "venv", "--without-pip", folder, folder=wheel.parent)
    python = folder / "bin" / "python"
    called(*PIP, "--python", python, "install", "--no-deps", "--no-index", wheel, folder=folder)
    own = called(
        python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))", folder=folder
    )
    places = {sysconfig.get_path("purelib"), sysconfig.get_path("platlib")}
    # Lines of a .pth file come after what is installed, and theirs are not read in turn: so the
    # biogrip that is being developed is not found.
    Path(own.strip(), "borrowed.pth").write_text("".join(f"{place}\n" for place in sorted(places)))
    where = called(python, "-c", "import biogrip; print(biogrip.__file__)", folder=folder)
    assert Path(where.strip()).is_relative_to(folder)
    return folder / "bin"


def test_the_wheel_identifies_the_example(commands: Path, tmp_path: Path) -> None:
    (tmp_path / "trace.csv").write_bytes(EXAMPLE.read_bytes())
    said = called(commands / "biogrip", "identify", "trace.csv", folder=tmp_path)
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    shown = readme.split("example: begin")[1].split("\n\n")[1].strip().splitlines()
    assert shown
    printed = [line.strip() for line in said.splitlines()]
    assert [line for line in shown if line.strip() not in printed] == []
    assert (tmp_path / "trace.identified.json").is_file()


def test_the_wheel_runs_a_study(commands: Path, tmp_path: Path) -> None:
    """Snakefile, rules, profile and config come with it, and published results for the claims."""
    (tmp_path / "tiny.yaml").write_text(yaml.safe_dump(TINY))
    (tmp_path / "mine.csv").write_bytes(EXAMPLE.read_bytes())
    python = commands / "python"
    place = called(python, "-c", "import biogrip; print(biogrip.__file__)", folder=tmp_path)
    workflow = Path(place.strip()).parent / "workflow" / "Snakefile"
    options = ("-s", workflow, "-j2", "--directory", tmp_path, "--configfile", "tiny.yaml")
    wanted = ["results/tables/contact_loss.md", "results/targets/liquid_drop_2.csv"]
    called(python, "-m", "snakemake", *wanted, *options, folder=tmp_path)
    assert [name for name in wanted if not (tmp_path / name).is_file()] == []
    called(python, "-m", "snakemake", "-n", "results/tables/claims.csv", *options, folder=tmp_path)
