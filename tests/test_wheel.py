import os
import sys
from pathlib import Path

import pytest
import yaml

import biogrip
from tests.helpers.places import EXAMPLE, ROOT
from tests.helpers.runs import TINY, ran

pytestmark = pytest.mark.nightly


def test_the_version_is_that_of_the_citation() -> None:
    """As which `make site` checks the other files."""
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert citation["version"] == biogrip.__version__


def test_the_wheel_identifies_a_trace_and_runs_a_study(tmp_path: Path) -> None:
    """Put where nothing else is, before the libraries of this environment, and used elsewhere."""
    there, place = tmp_path / "there", tmp_path / "place"
    place.mkdir()
    path = os.pathsep.join([f"{there}/bin", str(Path(sys.executable).parent), os.environ["PATH"]])

    def said(*command: str | Path) -> str:
        return ran(place, *command, PATH=path, PYTHONPATH=str(there))

    pip = (sys.executable, "-m", "pip", "--disable-pip-version-check")
    options = ("--quiet", "--no-deps", "--no-index", "--no-build-isolation")
    said(*pip, "wheel", *options, "--wheel-dir", tmp_path, ROOT)
    said(*pip, "install", *options[:3], "--target", there, *tmp_path.glob("*.whl"))
    (place / "tiny.yaml").write_text(yaml.safe_dump(TINY))
    (place / "mine.csv").write_bytes(EXAMPLE.read_bytes())
    said("biogrip", "identify", "mine.csv")
    assert (place / "mine.identified.json").is_file()
    package = Path(said("python", "-c", "import biogrip; print(biogrip.__file__)")).parent
    assert package == there / "biogrip"
    given = ("-s", package / "workflow" / "Snakefile", "-j2", "--configfile", "tiny.yaml")
    wanted = "results/tables/contact_loss.md", "results/targets/liquid_drop_2.csv"
    said("python", "-m", "snakemake", *given, "--", *wanted)
    said("python", "-m", "snakemake", *given, "-n", "--", "results/tables/claims.csv")
