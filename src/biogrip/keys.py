"""Definition of config keys, as annotations of dataclass fields.

A field of a frozen dataclass is a key if it is annotated with a `Key`, e.g.
``fingers: Annotated[int, Key("Number of floating fingers.", low=1)]``. Checks, messages, the JSON
Schema and the documentation follow from it (`biogrip.study`). Conflicts between keys are found by
the optional method ``problems`` of the class.
"""

from collections.abc import Hashable
from dataclasses import dataclass

Problem = tuple[tuple[Hashable, ...], str]
"""Path of a key, relative to its block, and a message: what was found and what is allowed."""


@dataclass(frozen=True)
class Key:
    """Description and constraints of a config key.

    Parameters
    ----------
    text
        Description of the key.
    unit
        Unit of its value.
    low, above, high
        Lower bound, exclusive lower bound, and upper bound.
    choices
        Allowed values.
    pattern, form
        Regular expression for the whole text, and the same in words.
    fewest, most
        Bounds on the items of a list, characters of a text, or keys of a block.
    unique
        True if all items of a list must differ.
    needed
        True if a config must give the key although the class has a default.
    spread
        True if the field collects all keys of its block that no other field names.
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
    """Return a key for text that is safe in tables, figures and file formats."""
    return Key(
        text,
        pattern=r"(?![ +-])[\w .,:;()+/%'-]{1,60}",
        form="text of 1 to 60 letters, digits, spaces and . , : ; ( ) + / % ' - _, not beginning "
        "with a space, + or -",
    )
