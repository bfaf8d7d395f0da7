"""CONTRIBUTING's table of words, and the names that it retires."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
SECTION = (ROOT / "CONTRIBUTING.md").read_text().partition("## Words\n")[2].partition("\n## ")[0]
# Where a retired word has its plain meaning: a drift rises, figures and pages have colours.
PLAIN = {
    "rise": ("experiment",),
    "colour": ("figures", "pages"),
    "held": ("tables",),
}


def names(tree: ast.AST) -> Iterator[str]:
    """Yield all names of a module: of functions, classes, arguments, variables and attributes."""
    for node in ast.walk(tree):
        for field in ("name", "id", "attr", "arg"):
            if isinstance(name := getattr(node, field, None), str):
                yield name


def test_retired_words_are_in_no_name() -> None:
    said = re.search(r"several things each: ([\w,\s]+)\.", SECTION)
    assert said
    retired = set(re.split(r",\s+", said[1]))
    assert len(retired) > 10
    found = {
        f"{path.relative_to(ROOT)}: {name}"
        for path in ROOT.glob("src/biogrip/**/*.py")
        for name in [path.stem, *names(ast.parse(path.read_text()))]
        for word in retired.intersection(
            re.findall(r"[A-Z]?[a-z]+", name.replace("_", " ").lower())
        )
        if not set(PLAIN.get(word, ())) & set(path.parts)
    }
    assert not found


def test_each_word_is_explained_once() -> None:
    rows = re.findall(r"^\| ([^|]+?) +\| ([^|]+?) +\|", SECTION, re.MULTILINE)[2:]
    words = [word for row, _ in rows for word in row.split(", ")]
    assert len(words) > 30
    assert len(words) == len(set(words))
