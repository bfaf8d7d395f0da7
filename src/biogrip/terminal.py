"""What leaves for a terminal: text of others with nothing in it that a terminal obeys."""

import os
import sys

# Control characters, marks and overrides of the direction of writing, separators of lines, and
# halves of characters, which stand for bytes in the name of a file that are no text.
_OBEYED = (
    *(range(0x20), range(0x7F, 0xA0), range(0x61C, 0x61D), range(0x200E, 0x2010)),
    *(range(0x2028, 0x202F), range(0x2066, 0x206A), range(0xD800, 0xE000)),
)
_SHOWN = {number: ascii(chr(number))[1:-1] for numbers in _OBEYED for number in numbers}
_STREAMS = {"stdin": "r", "stdout": "w", "stderr": "w"}


def visible(text: object) -> str:
    r"""Return text in which a terminal obeys nothing, e.g. ``\x1b[31m`` of a change of colour."""
    return str(text).translate(_SHOWN)


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
