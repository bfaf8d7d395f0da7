"""The crate of a study, and what an independent validator says of it."""

import hashlib
import json
import shutil
from collections.abc import Callable
from importlib.resources import files
from io import BytesIO
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import pytest
from requests import PreparedRequest, Response
from requests.adapters import HTTPAdapter
from requests_cache import CachedSession
from rocrate_validator.models import Severity, ValidationSettings
from rocrate_validator.services import validate
from urllib3 import HTTPResponse

from biogrip.cli import main
from tests.helpers.places import EXAMPLE

CONTEXT = "https://w3id.org/ro/crate/1.1/context"
# Terms of version 1.1 that have moved in the context of 1.3, which rocrate ships.
BIOSCHEMAS = "https://bioschemas.org"
MOVED = {
    "ComputationalWorkflow": f"{BIOSCHEMAS}/ComputationalWorkflow",
    "FormalParameter": f"{BIOSCHEMAS}/FormalParameter",
    "input": f"{BIOSCHEMAS}/ComputationalWorkflow#input",
    "output": f"{BIOSCHEMAS}/ComputationalWorkflow#output",
}


@pytest.fixture(scope="module")
def study(finished: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return shutil.copytree(finished, tmp_path_factory.mktemp("crate") / "study")


@pytest.fixture(scope="module")
def crate(study: Path) -> Path:
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(study)
        assert main(["crate"]) == 0
        # It is the study's own, so that it may be renewed, and is verified and cleaned away.
        assert main(["crate"]) == 0
        assert main(["verify"]) == 0
    return study / "results" / "crate.zip"


class AsShipped(HTTPAdapter):
    """Answers with the context that rocrate ships, as it was in version 1.1."""

    def send(self, request: PreparedRequest, *_: Any, **__: Any) -> Response:
        context = json.loads(files("rocrate").joinpath("data/ro-crate.jsonld").read_text())
        context["@context"] |= MOVED
        answer = HTTPResponse(
            BytesIO(json.dumps(context).encode()),
            {"Content-Type": "application/ld+json"},
            status=200,
            preload_content=False,
            request_url=request.url,
        )
        return self.build_response(request, answer)


@pytest.fixture
def known_context(tmp_path: Path) -> Path:
    """A cache with the one document that a validator would fetch."""
    cache = tmp_path / "http"
    with CachedSession(cache_name=str(cache), backend="sqlite") as session:
        session.mount(CONTEXT, AsShipped())
        assert session.get(CONTEXT).ok
    return cache


def issues(crate: Path, cache: Path) -> list[str]:
    """What a crate lacks of what the profile requires."""
    settings = ValidationSettings(
        rocrate_uri=str(crate),
        profile_identifier="workflow-run-crate-0.5",
        requirement_severity=Severity.REQUIRED,
        offline=True,
        cache_path=cache,
    )
    return [str(issue.message) for issue in validate(settings).get_issues()]


def entities(crate: Path) -> dict[str, dict[str, Any]]:
    with ZipFile(crate) as archive:
        graph = json.loads(archive.read("ro-crate-metadata.json"))["@graph"]
    return {entity["@id"]: entity for entity in graph}


def test_it_conforms_to_the_profile(crate: Path, known_context: Path) -> None:
    assert issues(crate, known_context) == []


def test_the_validator_would_notice(crate: Path, known_context: Path, tmp_path: Path) -> None:
    folder = tmp_path / "crate"
    with ZipFile(crate) as archive:
        archive.extractall(folder)
    (folder / "results" / "tables" / "errors.csv").unlink()
    file = folder / "ro-crate-metadata.json"
    metadata = json.loads(file.read_text())
    (run,) = (entity for entity in metadata["@graph"] if entity["@id"] == "#run")
    del run["instrument"]
    file.write_text(json.dumps(metadata))
    found = "\n".join(issues(folder, known_context))
    assert "instrument" in found
    assert "errors.csv" in found


def test_it_holds_the_results_with_their_hashes(crate: Path, study: Path) -> None:
    told = entities(crate)
    made = [item["@id"] for item in told["#run"]["result"]]
    tables = sorted((study / "results" / "tables").glob("*.*"))
    figures = sorted((study / "results" / "figures").glob("*.*"))
    assert {file.relative_to(study).as_posix() for file in [*tables, *figures]} <= set(made)
    with ZipFile(crate) as archive:
        for name in [*made, "results/study.json"]:
            content = archive.read(name)
            assert content == (study / name).read_bytes()
            assert told[name]["sha256"] == hashlib.sha256(content).hexdigest()
            assert told[name]["contentSize"] == str(len(content))
        assert {"Snakefile", "config/config.yaml"} <= set(archive.namelist())
    assert told["#run"]["startTime"] <= told["#run"]["endTime"]
    software = {e["name"] for e in told.values() if e["@type"] == "SoftwareApplication"}
    assert {"Python", "biogrip", "numpy", "snakemake"} <= software


def test_a_recorded_trace_goes_along(
    recorded: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    study = shutil.copytree(recorded, tmp_path / "study")
    monkeypatch.chdir(study)
    assert main(["crate", "--output", "mine.zip"]) == 0
    told = entities(study / "mine.zip")
    assert {"@id": "traces/my_trace.csv"} in told["#run"]["object"]
    with ZipFile(study / "mine.zip") as archive:
        assert archive.read("traces/my_trace.csv") == EXAMPLE.read_bytes()
    # What was not written among the results is nobody's to replace.
    assert main(["crate", "--output", "mine.zip"]) == 1


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        (lambda file: file.unlink(), "errors.csv is missing"),
        (lambda file: file.write_text("edited"), "errors.csv: is not what was written"),
    ],
)
def test_only_a_whole_study_is_packed(
    damage: Callable[[Path], None],
    said: str,
    study: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    copied = shutil.copytree(study, tmp_path / "study")
    damage(copied / "results" / "tables" / "errors.csv")
    monkeypatch.chdir(copied)
    assert main(["crate", "--output", "another.zip"]) == 1
    assert said in capsys.readouterr().err
    assert not Path("another.zip").exists()
