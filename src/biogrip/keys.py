"""How a key of the config is defined: beside the field that holds it.

A field of a frozen dataclass is a key if it is annotated with a `Key`, e.g.
``fingers: Annotated[int, Key("Number of floating fingers.", low=1)]``. Checks, messages, the JSON
Schema and the documentation follow from it (`biogrip.study`). What only several keys together can
get wrong says the class' method ``problems``, if it has one.
"""

from collections.abc import Hashable
from dataclasses import dataclass

Problem = tuple[tuple[Hashable, ...], str]
"""Path of a key, from the block that says it, and what was found and what is allowed."""


@dataclass(frozen=True)
class Key:
    """What is said of a key beside its type and its default.

    Parameters
    ----------
    text
        What it means.
    unit
        Of its value.
    low, above, high
        The value is at least, greater than, at most.
    choices
        All that it may be.
    pattern, form
        All of a text, as a regular expression; the same in words.
    fewest, most
        Items of a list, characters of a text, or keys of a block.
    unique
        Whether no item of a list may be there twice.
    needed
        Whether a config must give it although the class has a default.
    spread
        Whether it has no name of its own: it holds the keys of its block that no other field is
        named like.
    """

    text: str = ""
    unit: str = ""
    low: float | None = None
    above: float | None = None
    high: float | None = None
    choices: tuple[str, ...] = ()
    pattern: str = ""
    form: str = ""
    fewest: int | None = None
    most: int | None = None
    unique: bool = False
    needed: bool = False
    spread: bool = False


def printed(text: str) -> Key:
    """Define a name in print, of which tables, figures and file formats make no more than text."""
    return Key(
        text,
        pattern=r"(?![ +-])[\w .,:;()+/%'-]{1,60}",
        form="text of 1 to 60 letters, digits, spaces and . , : ; ( ) + / % ' - _, not beginning "
        "with a space, + or -",
    )
