"""What the tutorial and the how-tos tell to write and to type, written and typed as they say.

A fenced block with a title is a file, one in sh is commands and one in python runs. Runs of the
workflow, and fits of a trace that need no config, are made small by one which the documents do
not show; runs that make a whole study, by naming what the reader is to look at, too. Designs are
searched for among fewer candidates and steps.
"""

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryFile

import pytest

from tests.helpers import loaded
from tests.helpers.places import ROOT
from tests.helpers.runs import TINY, Tree, copied_tree

BLOCK = re.compile(r'^```(\w+)(?: title="([^"]+)")?\n(.*?)^```$', re.DOTALL | re.MULTILINE)
# Of each document, what there is when the reader is through.
LEFT = {
    "tutorial.md": [
        *("first.json", "second.json", "results/summaries/mine.html"),
        "results/tables/verdicts_longer.md",
    ],
    "groups.md": ["found.csv"],
    "design.md": ["my_designed.yaml"],
    "howto/case.md": ["results/tables/errors_my_cell.md", "results/summaries/my_cell.html"],
    "howto/trace.md": [
        *("found.json", "drifting.json", "coloured.json", "page.html", "traces.csv"),
        *("maxwell.json", "uncertain.json"),
    ],
    "howto/creep.md": ["mucus.json", "hl60.json"],
    "howto/relaxation.md": ["fish.json", "dwell.json"],
    "howto/noise.md": [
        *("results/tables/verdicts_noisy_drop.md", "results/figures/robustness_levels.png"),
        "results/tables/robustness_levels.md",
    ],
    "howto/posterior.md": [],
    "howto/doubts.md": ["found.json", "page.html", "coloured.json"],
    "howto/module.md": ["lab/mine.csv", "lab/results/tables/errors_my_cell.csv"],
    # These change the copy's code.
    "howto/noise_kind.md": ["results/tables/verdicts_laplace_drop.md"],
    "howto/figure.md": ["results/figures/heights.png"],
}
TAKES_LONG = {"howto/relaxation.md", "howto/creep.md", "design.md"}
LOOKED_AT = {
    "study.yaml": ["results/summaries/mine.html"],
    "my.yaml": ["results/tables/errors_my_cell.md", "results/summaries/my_cell.html"],
}
# A trace fitted from few starts, with few models, of which the chosen one has two parameters unless
# the document says which.
TINY_FIT = """
least_squares: {candidates: 50, starts: 3}
model_selection: {models: [damper, maxwell]}
"""


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Tree:
    """A copy of the repository, in which a reader works."""
    tree = copied_tree(tmp_path_factory.mktemp("reader"))
    shutil.copytree(ROOT / "data", tree.root / "data")
    # A long trace; few of its readings do.
    fish = tree.root / "data" / "measured" / "fish_muscle.csv"
    header, *rows = fish.read_text().splitlines()
    fish.write_text("\n".join([header, *rows[::20]]) + "\n")
    return tree


def test_every_howto_is_followed() -> None:
    howtos = {f"howto/{file.name}" for file in (ROOT / "docs" / "howto").glob("*.md")}
    assert howtos | {"tutorial.md", "groups.md", "design.md"} == set(LEFT)


@pytest.mark.parametrize(
    "document",
    [
        pytest.param(name, marks=[pytest.mark.nightly] if name in TAKES_LONG else [])
        for name in LEFT
    ],
)
def test_what_is_said_can_be_done(document: str, place: Tree) -> None:
    shutil.rmtree(place.root / "results", ignore_errors=True)
    text = (ROOT / "docs" / document).read_text(encoding="utf-8")
    # Most bring a case of their own.
    needed = "cases:" not in text or "[liquid_drop_2]" in text
    (place.root / "tiny.yaml").write_text(TINY if needed else f"{TINY}  liquid_drop_2: null\n")
    (place.root / "tiny_fit.yaml").write_text(TINY_FIT)
    blocks = BLOCK.findall(text)
    # Else the copy's code is the repository's, which is loaded already.
    own_code = any(title.endswith((".py", ".diff")) for _, title, _ in blocks)
    environment = place.environment if own_code else {**os.environ, loaded.COARSE: "1"}
    for language, title, content in blocks:
        if title:
            of_a_fit = re.search(f"identify .*--config {title}", text)
            (place.root / title).parent.mkdir(parents=True, exist_ok=True)
            content = re.sub(r"candidates: \d+", "candidates: 128", content)
            content = re.sub(r"most_steps: \d+", "most_steps: 3", content)
            (place.root / title).write_text(content + (TINY_FIT if of_a_fit else ""))
        elif language == "sh":
            for line in content.splitlines():
                program, *arguments = shlex.split(line, comments=True)
                if program == "biogrip":
                    arguments = _typed(arguments)
                _call(program, arguments, place.root, environment)
        elif language == "python":
            _run(content, place)
    assert [name for name in LEFT[document] if not (place.root / name).is_file()] == []


def _typed(arguments: list[str]) -> list[str]:
    """Arguments of biogrip, such that a run is small."""
    if arguments[0] == "run":
        return ["run", "tiny.yaml", *arguments[1:], *LOOKED_AT.get(arguments[-1], [])]
    if arguments[0] == "identify" and "--config" not in arguments:
        model = [] if "--model" in arguments else ["--model", "maxwell"]
        return [*arguments, *model, "--config", "tiny_fit.yaml"]
    return arguments


def _call(program: str, arguments: list[str], folder: Path, environment: dict[str, str]) -> None:
    with TemporaryFile("w+") as said:
        if program in ("biogrip", "snakemake"):
            status = loaded.call(program, arguments, folder, environment, (said, said))
        else:
            command = [program, *arguments]
            status = subprocess.run(command, cwd=folder, stdout=said, stderr=said).returncode
        said.seek(0)
        assert status == 0, said.read()


def _run(code: str, place: Tree) -> None:
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=place.root,
        env=place.environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=600,
    )
    assert done.returncode == 0, done.stdout
