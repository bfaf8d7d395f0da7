import re
from pathlib import Path

import jsonschema
import pytest
import yaml

from tests.generated_docs import DOCUMENTS, GENERATED, renewed
from tests.helpers.default import study_of
from tests.helpers.places import ROOT

# Its tables and their text are written by benchmarks.levels.
WRITTEN = ROOT / "docs" / "levels.md"
# Their commands take longest.
SLOW = ("README.md", "tutorial.md", "relaxation.md", "creep.md", "groups.md", "modulus.md")
NOT_PROSE = re.compile(
    r"<!-- (\w+): begin.*?<!-- \1: end -->|<!--.*?-->|^ *```.*?^ *```$|^    [^\n]*$", re.S | re.M
)


def words(text: str) -> int:
    return sum(any(map(str.isalnum, word)) for word in text.split())


def test_what_is_written_by_hand_is_short() -> None:
    by_hand = {path: words(NOT_PROSE.sub("", path.read_text("utf-8"))) for path in DOCUMENTS}
    del by_hand[WRITTEN]
    assert sum(by_hand.values()) <= 11_000
    assert len((ROOT / "config" / "README.md").read_text("utf-8").split()) <= 1000
    assert len((ROOT / "README.md").read_text("utf-8").split()) <= 450


@pytest.mark.parametrize(
    "document",
    [pytest.param(it, marks=[pytest.mark.nightly] * (it.name in SLOW)) for it in GENERATED],
    ids=lambda path: str(path.relative_to(ROOT)),
)
def test_generated_parts_are_up_to_date(document: Path) -> None:
    """If this fails: make docs."""
    assert renewed(document) == document.read_text(encoding="utf-8")


def test_the_guides_configs_are_allowed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    text = (ROOT / "config" / "README.md").read_text(encoding="utf-8")
    configs = re.findall(r"```yaml\n(.*?)```", text, re.DOTALL)
    assert len(configs) > 5
    for config in configs:
        study_of(config)


def test_promises_are_kept_by_tests_that_there_are() -> None:
    promised = re.findall(r"`(test_\w+)`", (ROOT / "docs" / "reliability.md").read_text())
    tests = "".join(file.read_text() for file in (ROOT / "tests").rglob("test_*.py"))
    assert len(promised) > 5
    assert [name for name in promised if f"def {name}(" not in tests] == []


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_links_lead_somewhere(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    links = re.findall(r"\]\(([^)#]*)(?:#[^)]*)?\)", text)
    own = [link for link in links if link and "://" not in link]
    assert [link for link in own if not (path.parent / link).is_file()] == []


def test_hosted_runs_type_what_the_readme_types_without_make() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    typed = re.findall(r"^    ((?:python|biogrip) .*)$", text, re.M)
    ci = yaml.safe_load((ROOT / ".github" / "workflows" / "ci.yml").read_text(encoding="utf-8"))
    assert len(typed) > 4
    assert typed == [step["run"] for step in ci["jobs"]["install"]["steps"] if "run" in step]


# What the catalogue's page "Adding workflows" allows.
FLAGS = {"anyOf": [{"type": "string"}, {"type": "array", "items": {"type": "string"}}]}
CATALOGUE = {
    "type": "object",
    "required": ["usage"],
    "additionalProperties": False,
    "properties": {
        "usage": {
            "type": "object",
            "required": ["software-stack-deployment", "report"],
            "additionalProperties": False,
            "properties": {
                "mandatory-flags": {
                    "type": "object",
                    "required": ["desc", "flags"],
                    "additionalProperties": False,
                    "properties": {"desc": {"type": "string", "minLength": 1}, "flags": FLAGS},
                },
                "software-stack-deployment": {
                    "type": "object",
                    "required": ["conda", "apptainer", "apptainer+conda"],
                    "additionalProperties": {"type": "boolean"},
                },
                "report": {"type": "boolean"},
            },
        }
    },
}


def test_the_workflow_catalogue_finds_what_it_asks_for() -> None:
    said = (ROOT / ".snakemake-workflow-catalog.yml").read_text(encoding="utf-8")
    jsonschema.validate(yaml.safe_load(said), CATALOGUE)
    readme = (ROOT / "README.md").read_text(encoding="utf-8").lower()
    assert all(word in readme for word in ("snakemake", "workflow"))
    assert (ROOT / "workflow" / "Snakefile").is_file()
    assert (ROOT / "config" / "README.md").is_file()
    assert [*(ROOT / "workflow" / "rules").glob("*.smk")]
