"""Text for a terminal: untrusted text escaped, and cells aligned in columns."""

import os
import sys
from collections.abc import Sequence
from itertools import zip_longest

# Control characters, marks that change the writing direction, line separators, and surrogates,
# which stand for bytes in file names that are not valid text.
_OBEYED = (
    *(range(0x20), range(0x7F, 0xA0), range(0x61C, 0x61D), range(0x200E, 0x2010)),
    *(range(0x2028, 0x202F), range(0x2066, 0x206A), range(0xD800, 0xE000)),
)
_SHOWN = {number: ascii(chr(number))[1:-1] for numbers in _OBEYED for number in numbers}
_STREAMS = {"stdin": "r", "stdout": "w", "stderr": "w"}


def visible(text: object) -> str:
    r"""Return text with control characters escaped, e.g. ``\x1b[31m`` of a change of colour."""
    return str(text).translate(_SHOWN)


def visible_lines(text: object) -> str:
    """Return text escaped like `visible`, keeping line ends."""
    return "\n".join(map(visible, str(text).split("\n")))


def aligned(rows: Sequence[Sequence[str]], header: Sequence[str]) -> str:
    """Return rows below a header and a line of dashes, in columns as wide as their widest cell."""
    widths = [max(map(len, column)) for column in zip_longest(header, *rows, fillvalue="")]
    lines = [header, ["-" * width for width in widths], *rows]
    return "\n".join("  ".join(map(str.ljust, line, widths)).rstrip() for line in lines)


def open_closed_streams() -> None:
    """Open standard streams that are closed, so that output to them is lost.

    Otherwise the next file opened would receive the output of this process or its children.
    """
    while (opened := os.open(os.devnull, os.O_RDWR)) < len(_STREAMS):
        os.set_inheritable(opened, True)
    os.close(opened)
    for number, (name, mode) in enumerate(_STREAMS.items()):
        if getattr(sys, name) is None:
            setattr(sys, name, os.fdopen(number, mode, encoding="utf-8", closefd=False))
