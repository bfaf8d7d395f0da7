"""What leaves for a terminal: text of others with nothing in it that a terminal obeys."""

import os
import re
import sys

# Control characters, marks and overrides of the direction of writing, separators of lines, and
# halves of characters, which stand for bytes in the name of a file that are no text.
_OBEYED = re.compile(
    r"[\x00-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]"
)
_STREAMS = {"stdin": "r", "stdout": "w", "stderr": "w"}


def visible(text: object) -> str:
    r"""Return text in which a terminal obeys nothing, e.g. ``\x1b[31m`` of a change of colour."""
    return _OBEYED.sub(lambda odd: ascii(odd[0])[1:-1], str(text))


def visible_lines(text: object) -> str:
    """Return text like `visible`, its lines kept."""
    return "\n".join(map(visible, str(text).split("\n")))


def open_closed_streams() -> None:
    """Open the streams that a process was started without, so that what they are told is lost.

    Else the next file to be opened would get what is said, of this process or one that it starts.
    """
    while (opened := os.open(os.devnull, os.O_RDWR)) < len(_STREAMS):
        os.set_inheritable(opened, True)
    os.close(opened)
    for number, (name, mode) in enumerate(_STREAMS.items()):
        if getattr(sys, name) is None:
            setattr(sys, name, os.fdopen(number, mode, encoding="utf-8", closefd=False))
