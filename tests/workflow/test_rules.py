import re
import sys
from importlib import import_module
from inspect import signature
from pathlib import Path

import pytest

from tests.helpers.places import ROOT
from tests.helpers.runs import ran

RULES = sorted((ROOT / "workflow").rglob("*.smk"))
SCRIPTS = sorted((ROOT / "workflow").glob("[ps]*/*.py"))
_RULE = re.compile(r"^ *rule (\w+):\n((?: *\n| +.*\n)*)", re.MULTILINE)
WRITTEN = {
    name: (file, body) for file in RULES for name, body in _RULE.findall(file.read_text("utf-8"))
}
# Of what the reader asks for, with no files of its own.
TARGETS = ("check", "publish")
COLLECTING = ("markdown_tables",)


@pytest.mark.parametrize("name", [name for name in WRITTEN if name not in COLLECTING])
def test_a_rule_says_what_it_does_and_depends_on(name: str) -> None:
    body = WRITTEN[name][1]
    for part in ("log:", "message:"):
        assert part in body, part
    assert "script:" in body or "shell:" in body
    if name not in TARGETS:
        assert "output:" in body
        assert "settings_of(" in body or name == "traces"
    logs = re.findall(r'"results/logs/(.+)\.log"', body)
    assert {*re.findall(r'"results/benchmarks/(.+)\.tsv"', body)} <= {*logs}


def test_the_functions_that_a_rule_names_take_what_it_has() -> None:
    seen = set()
    for name, (_, body) in WRITTEN.items():
        has = {*re.findall(r"^ +(\w+)=", body, re.MULTILINE), *re.findall(r"{(\w+)}", body)}
        for module, function in re.findall(
            r'"(biogrip[\w.]+)\.(\w+)"', body.partition("stages=")[2]
        ):
            stage = getattr(import_module(module), function)
            assert {*signature(stage).parameters} <= has | {"case", "study", "seeds"}, name
            seen.add(name)
    assert {"target", "case_tables", "sweep", "markdown_table", "page"} <= seen


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda file: file.stem)
def test_a_job_reads_no_config_but_its_params(script: Path) -> None:
    text = script.read_text("utf-8")
    for way in ("load_study", "read_config", "default_config", "snakemake.config", "results/"):
        assert way not in text, way
    assert f'"../{script.parent.name}/{script.name}"' in "".join(
        body for _, body in WRITTEN.values()
    )


def test_no_private_name_of_snakemake_is_used_and_the_library_does_not_import_it() -> None:
    library = [*(ROOT / "src").rglob("*.py")]
    inner = "overwrite_configfiles|config_settings|main_snakefile"
    private = re.compile(rf"(snakemake|workflow|rules|checkpoints)(\.\w+)*\.(_\w+|{inner})")
    code = [*RULES, *SCRIPTS, *library, ROOT / "workflow" / "Snakefile"]
    assert [file.name for file in code if private.search(file.read_text())] == []
    imported = re.compile(r"^\s*(import|from) snakemake", re.MULTILINE)
    assert [file.name for file in library if imported.search(file.read_text("utf-8"))] == []


@pytest.mark.nightly
def test_the_picture_of_the_rules_is_the_same_whenever_it_is_drawn(tmp_path: Path) -> None:
    pictures = []
    for seed in ("1", "2"):
        drawn = tmp_path / f"{seed}.png"
        command = sys.executable, ROOT / "docs" / "rules.py", drawn
        ran(tmp_path, *command, PYTHONHASHSEED=seed)
        pictures.append(drawn.read_bytes())
    assert pictures[0] == pictures[1]
