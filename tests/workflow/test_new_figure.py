"""A figure more is a module more: nothing else has to know of it."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.helpers.pictures import assert_drawn
from tests.helpers.runs import TINY, Tree, copied_tree, replaced, waited_for

HEIGHTS = '''
"""How high the sample's response rises."""

from pathlib import Path

from matplotlib.figure import Figure

from biogrip.products.figures.declared import drawing
from biogrip.products.figures.style import COLUMN_IN, figure
from biogrip.products.files.traces import TARGETS, read_target
from biogrip.products.product import Weight, of_cases, the
from biogrip.products.uses import from_case, simulated
from biogrip.study.study import Case, Study


def draw(_: Study, targets: list[Path]) -> Figure:
    """Draw the largest rotation of every case."""
    drawn = figure(COLUMN_IN, 2)
    highest = [read_target(target)[2].max() for target in targets]
    drawn.subplots().bar([target.stem for target in targets], highest)
    return drawn


def draw_case(case: Case, target: Path) -> Figure:
    """Draw the response of a case."""
    time_s, _, rotation = read_target(target)
    drawn = figure(COLUMN_IN, 2)
    axes = drawn.subplots()
    axes.plot(time_s, rotation)
    axes.set_title(case.title)
    return drawn


HEIGHTS = drawing(
    draw,
    name="heights",
    caption="How high every case rises, side by side.",
    reads={"targets": of_cases(TARGETS, simulated)},
    weight=Weight(7, 1234),
)
HEIGHT = drawing(
    draw_case,
    name="height",
    caption="How high one case rises, on its own.",
    uses=from_case("title"),
    reads={"target": the(TARGETS)},
    cases=simulated,
    weight=Weight(8, 2345),
)
'''
WANTED = ["results/figures/heights.png", "results/figures/height_liquid_drop_2.png"]
FILES = [*WANTED, *(file.replace(".png", ".pdf") for file in WANTED)]
# What the executor for Slurm gets.
RESOURCES = """
import json
from pathlib import Path
from biogrip.products.catalogue import products
from biogrip.products.plan import Plan
from biogrip.running.resolved import read_study
from biogrip.running.rules import make_rules
plan = Plan(read_study(Path("results")), Path("results"))
found = {
    product.name: [rule.runtime({}, attempt=2), rule.megabytes({}, attempt=2), rule.weight.local]
    for rule in make_rules(products().values(), plan)
    for product in rule.products
}
print(json.dumps(found))
"""


@pytest.fixture(scope="module")
def tree(tmp_path_factory: pytest.TempPathFactory) -> Tree:
    copied = copied_tree(tmp_path_factory.mktemp("tree"))
    figures = copied.root / "src" / "biogrip" / "products" / "figures"
    (figures / "heights.py").write_text(HEIGHTS)
    copied.study.mkdir()
    run = copied.run(*WANTED, config=TINY)
    assert run.status == 0, run.output
    return copied


def test_a_new_figure_is_drawn(tree: Tree) -> None:
    for file in FILES:
        content = (tree.study / file).read_bytes()
        assert content.startswith(b"\x89PNG" if file.endswith(".png") else b"%PDF")
        if file.endswith(".png"):
            assert_drawn(tree.study / file)


def test_a_new_figure_is_planned_without_being_asked_for(tree: Tree) -> None:
    run = tree.run("-n", "all", "--forcerun", *WANTED, config=TINY)
    assert run.status == 0, run.output
    asked = waited_for(run)
    for file in FILES:
        assert file in asked
    assert re.search(r"(Drawing|Making) .*heights", run.output)


def test_a_new_figure_gets_resources_on_slurm(tree: Tree) -> None:
    command = [sys.executable, "-c", RESOURCES]
    done = subprocess.run(
        command, cwd=tree.study, env=tree.environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["heights"] == [2 * 7, 2 * 1234, False]
    assert found["height"] == [2 * 8, 2 * 2345, False]


def test_a_new_figure_is_captioned_in_the_report(tree: Tree, tmp_path: Path) -> None:
    report = tmp_path / "report.html"
    run = tree.run("--report", str(report), *WANTED, config=TINY)
    assert run.status == 0, run.output
    page = report.read_text()
    for text in ("How high every case rises, side by side.", "How high one case rises, on its own"):
        assert text in page


def test_an_edit_of_a_new_figure_draws_it_again_alone(tree: Tree) -> None:
    file = tree.root / "src" / "biogrip" / "products" / "figures" / "heights.py"
    file.write_text(replaced(HEIGHTS, "COLUMN_IN, 2)", "COLUMN_IN, 3)"))
    jobs = tree.run("-n", *WANTED, config=TINY).all_jobs()
    file.write_text(HEIGHTS)
    assert jobs == {"heights": 1, "height": 1}
