"""Reading of YAML config files within bounds on size, nesting and values.

Aliases of aliases can expand few lines to billions of values, and deep nesting crashes readers.
Both are counted on the stream of parsing events, before anything is expanded.
"""

import re
from dataclasses import dataclass
from pathlib import Path

import yaml

from biogrip.errors import BiogripError
from biogrip.terminal import visible

LARGEST_BYTES = 1_000_000
DEEPEST = 50
MOST_VALUES = 100_000
"""Bound on keys, values and blocks of a file, those of an alias counted at every use."""

LONGEST_TEXT = 5000
LONGEST_NUMBER = 100
"""Bound on characters of a number; Python refuses 4300 digits or more."""

# libyaml is ten times faster, but not part of every PyYAML.
_Loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)

_NO_TEXT = re.compile("[^\t\n\r\x20-\x7e\x85\xa0-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_TAG = "tag:yaml.org,2002:"
_OCTAL = re.compile(r"[-+]?0[0-7_]+")
_SHOWN = 40


@dataclass
class _Open:
    """A block or list whose end has not been reached in the parsing events."""

    anchor: str | None
    """Its anchor, if it has one."""
    before: int
    """Number of values before it."""
    levels: int = 1
    """Levels of nesting inside, itself included."""


def shown_path(file: Path) -> str:
    """Return a path relative to the working directory, if it is below."""
    here = Path.cwd()
    return visible(file.relative_to(here) if file.is_relative_to(here) else file)


def compose(file: Path, text: str) -> yaml.Node | None:
    """Parse the text of a file to a tree of nodes, with aliases not expanded; None if empty.

    Raises
    ------
    BiogripError
        With file and line, if it is not YAML, exceeds a bound on levels, values or text, or has
        tags.
    """
    try:
        _check_size(file, text)
        root: yaml.Node | None = yaml.compose(text, Loader=_Loader)
    except yaml.MarkedYAMLError as error:
        raise no_yaml(file, error) from error
    return root


def no_yaml(file: Path, error: yaml.MarkedYAMLError) -> BiogripError:
    """Return an error that names the line at which a file is not YAML."""
    mark = error.problem_mark or error.context_mark
    said = error.problem or error.context
    return BiogripError(_at(file, mark.line if mark else 0, f"not valid YAML: {said}."))


def scalar_problem(node: yaml.ScalarNode) -> str | None:
    """Return what is wrong with a value that YAML 1.1 reads unexpectedly (dates, base 60)."""
    kind, text = node.tag.removeprefix(_TAG), node.value
    reading = None
    if kind in ("int", "float"):
        if len(text) > LONGEST_NUMBER:
            return f"found a number of {len(text)} characters, allowed are {LONGEST_NUMBER}."
        if ":" in text:
            reading = "in base 60; allowed is a number without colons"
        elif kind == "int" and _OCTAL.fullmatch(text):
            reading = "in base 8; allowed is a number that does not begin with 0"
    elif kind == "timestamp":
        reading = "as a date; allowed is a number"
    elif kind == "value":
        reading = "as a default; allowed is a value"
    return reading and f"found {text[:_SHOWN]}, which YAML reads {reading}, or text in quotes."


def read_text(file: Path) -> str:
    """Read a YAML file as text.

    Raises
    ------
    BiogripError
        With file and line, if it cannot be read, is not UTF-8 or exceeds the bound on bytes.
    """
    try:
        # Opening a pipe without a writer would block forever.
        if file.exists() and not (file.is_file() or file.is_dir()):
            raise BiogripError(f"{shown_path(file)}: is no regular file; allowed is one.")
        with file.open("rb") as stream:
            content = stream.read(LARGEST_BYTES + 1)
    except OSError as error:
        raise BiogripError(f"{shown_path(file)}: cannot be read: {error.strerror}.") from error
    if len(content) > LARGEST_BYTES:
        raise BiogripError(
            f"{shown_path(file)}: found more than {LARGEST_BYTES} bytes, allowed are "
            f"{LARGEST_BYTES}."
        )
    try:
        text = content.decode("utf-8")
    except UnicodeDecodeError as error:
        found = f"found the byte 0x{content[error.start]:02x}, allowed is text in UTF-8."
        line = content.count(b"\n", 0, error.start)
        raise BiogripError(_at(file, line, found)) from error
    # A byte order mark is allowed at the start, and only there.
    if odd := _NO_TEXT.search(text) or re.compile("\ufeff").search(text, 1):
        found = f"found the character U+{ord(odd[0]):04X}, allowed is text."
        raise BiogripError(_at(file, text.count("\n", 0, odd.start()), found))
    return text


def _check_size(file: Path, text: str) -> None:
    """Refuse too many values or levels, counting an alias as large as its anchor."""
    values = 0
    open_: list[_Open] = []
    sizes: dict[str, tuple[int, int]] = {}
    for event in yaml.parse(text, Loader=_Loader):
        wrong = None
        levels = 0
        if isinstance(event, yaml.CollectionEndEvent):
            block = open_.pop()
            levels = block.levels
            if block.anchor is not None:
                sizes[block.anchor] = values - block.before, levels
        elif isinstance(event, yaml.AliasEvent):
            if any(block.anchor == event.anchor for block in open_):
                wrong = f"the alias *{event.anchor} contains itself."
            more, levels = sizes.get(str(event.anchor), (1, 0))
            values += more
        elif isinstance(event, yaml.NodeEvent):
            values += 1
            wrong = _node_problem(event)
            if isinstance(event, yaml.CollectionStartEvent):
                open_.append(_Open(event.anchor, values - 1))
        if open_:
            open_[-1].levels = max(open_[-1].levels, 1 + levels)
        if len(open_) + levels > DEEPEST:
            wrong = f"found more than {DEEPEST} levels of nesting, allowed are {DEEPEST}."
        elif values > MOST_VALUES:
            wrong = (
                f"found more than {MOST_VALUES} values, those of an alias counted wherever it is "
                f"used; allowed are {MOST_VALUES}."
            )
        if wrong:
            line = event.start_mark.line if event.start_mark else 0
            raise BiogripError(_at(file, line, wrong))


def _node_problem(event: yaml.NodeEvent) -> str | None:
    tag = getattr(event, "tag", None)
    if tag is not None:
        return f"found the tag {tag.replace(_TAG, '!!')[:_SHOWN]}, allowed are values without tags."
    if isinstance(event, yaml.ScalarEvent) and len(event.value) > LONGEST_TEXT:
        return f"found text of {len(event.value)} characters, allowed are {LONGEST_TEXT}."
    return None


def _at(file: Path, line: int, text: str) -> str:
    """Return a message with file and line; `line` counts from 0."""
    return f"{shown_path(file)}, line {line + 1}: {text}"
