"""What the tutorial and the how-tos tell to write and to type, written and typed as they say.

A fenced block with a title is a file, one in sh is commands and one in python runs. All is made
small by configs that the documents do not show, or by naming what the reader is to look at.
"""

import re
import shlex
import shutil
import sys
from pathlib import Path

import pytest
import yaml

from tests.helpers.places import ROOT
from tests.helpers.runs import SMALL, clone, ran

BLOCK = re.compile(r'^```(\w+)(?: title="([^"]+)")?\n(.*?)^```$', re.DOTALL | re.MULTILINE)
# Those that change the copy's code come last.
HOWTOS = sorted(
    (ROOT / "docs" / "howto").glob("*.md"), key=lambda it: ("git apply" in it.read_text(), it)
)
DOCUMENTS = ["tutorial.md", "groups.md", "design.md", *(f"howto/{it.name}" for it in HOWTOS)]
LOOKED_AT = {
    "study.yaml": ["results/summaries/mine.html"],
    "my.yaml": ["results/tables/errors_my_cell.html", "results/summaries/my_cell.html"],
}
# A trace fitted from few starts, with few models, of which the chosen one has two parameters unless
# the document says which.
TINY_FIT = """
least_squares: {candidates: 50, starts: 3}
model_selection: {models: [damper, maxwell]}
"""


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("reader")
    clone(folder)
    for name in ("profiles", "data"):
        shutil.copytree(ROOT / name, folder / name)
    # A long trace; few of its readings do.
    fish = folder / "data" / "measured" / "fish_muscle.csv"
    header, *rows = fish.read_text().splitlines()
    fish.write_text("\n".join([header, *rows[::20]]) + "\n")
    return folder


@pytest.mark.nightly
@pytest.mark.parametrize("document", DOCUMENTS)
def test_what_is_said_can_be_done(document: str, place: Path) -> None:
    shutil.rmtree(place / "results" / "tables", ignore_errors=True)
    text = (ROOT / "docs" / document).read_text(encoding="utf-8")
    # Most bring a case of their own.
    others = ["endothelial_cell", "liquid_drop_1"]
    others += [] if "cases:" not in text or "[liquid_drop_2]" in text else ["liquid_drop_2"]
    tiny = SMALL | {"cases": dict.fromkeys(others)}
    (place / "tiny.yaml").write_text(yaml.safe_dump(tiny))
    (place / "tiny_fit.yaml").write_text(TINY_FIT)
    for language, title, content in BLOCK.findall(text):
        commands: list[list[str]] = []
        if title:
            of_a_fit = re.search(f"identify .*--config {title}", text)
            (place / title).parent.mkdir(parents=True, exist_ok=True)
            content = re.sub(r"candidates: \d+", "candidates: 128", content)
            content = re.sub(r"most_steps: \d+", "most_steps: 3", content)
            if title == "lab/my.yaml":
                content = yaml.safe_dump(SMALL | yaml.safe_load(content))
            (place / title).write_text(content + (TINY_FIT if of_a_fit else ""))
        elif language == "sh":
            lines = content.splitlines()
            commands = [_typed(shlex.split(line, comments=True)) for line in lines]
        elif language == "python":
            commands = [[sys.executable, "-c", content]]
        for command in commands:
            ran(place, *command, PYTHONPATH=str(place / "src"))


@pytest.mark.nightly
def test_what_the_readme_types_runs(place: Path) -> None:
    (place / "tiny_fit.yaml").write_text(TINY_FIT)
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    for line in re.findall(r"^    (biogrip .*)$", text, re.MULTILINE):
        ran(place, *_typed(shlex.split(line)), PYTHONPATH=str(place / "src"))
    assert all(
        (place / name).is_file() for name in ("fit.png", "page.html", "found.csv", "cells.png")
    )


def _typed(command: list[str]) -> list[str]:
    program, *arguments = command
    if program == "snakemake" and "--snakefile" not in arguments:
        cut = arguments.index("--configfile") if "--configfile" in arguments else len(arguments)
        rest, files = arguments[:cut], arguments[cut + 1 :]
        looked_at = [target for file in files for target in LOOKED_AT.get(file, [])]
        return [program, "--configfile", "tiny.yaml", *files, *rest, *looked_at]
    if arguments[:1] == ["identify"] and "--config" not in arguments:
        model = [] if "--model" in arguments else ["--model", "maxwell"]
        return [*command, *model, "--config", "tiny_fit.yaml"]
    return command
