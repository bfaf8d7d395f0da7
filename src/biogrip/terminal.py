"""What is printed: untrusted text escaped, cells aligned in columns, progress, and warnings."""

import os
import sys
import time
from collections.abc import Sequence
from contextlib import AbstractContextManager
from itertools import zip_longest

CLEARED = "\r\x1b[K"
"""What clears a line of a terminal."""

_PROGRESS_INTERVAL_S, _BAR = 5.0, 20
# Control characters, marks that change the writing direction, line separators, and surrogates,
# which stand for bytes in file names that are not valid text.
_OBEYED = (
    *(range(0x20), range(0x7F, 0xA0), range(0x61C, 0x61D), range(0x200E, 0x2010)),
    *(range(0x2028, 0x202F), range(0x2066, 0x206A), range(0xD800, 0xE000)),
)
_ESCAPED = {number: ascii(chr(number))[1:-1] for numbers in _OBEYED for number in numbers}
_STREAMS = {"stdin": "r", "stdout": "w", "stderr": "w"}


def visible(text: object) -> str:
    r"""Return text with control characters escaped, e.g. ``\x1b[31m`` of a change of colour."""
    return str(text).translate(_ESCAPED)


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


class Progress(AbstractContextManager["Progress"]):
    """What share of the pieces of a job is done, and how long the rest takes if it goes on so.

    If it is live, it shows a bar on the terminal in a line that is cleared at the end: not for jobs
    that share a terminal. If it is quiet, it prints notes only.
    """

    def __init__(self, what: str, total: int, *, live: bool = False, quiet: bool = False) -> None:
        self._what = visible(what)
        self._total = total
        self._alone, self._live = live, live and sys.stderr.isatty()
        self._quiet = quiet
        self._done = 0
        self._phase = ""
        self._said = self._began = time.monotonic()

    def __exit__(self, *_: object) -> None:
        """Clear the line on the terminal."""
        if self._live:
            print(CLEARED, end="", file=sys.stderr, flush=True)

    def done(self, pieces: int = 1) -> None:
        """Count completed pieces, and print the progress."""
        self._done += pieces
        self.within(0.0)

    def doing(self, phase: str) -> None:
        """Count a completed piece, and name the phase that the next one is."""
        self._done += 1
        self._phase = f"step {self._done + 1} of {self._total}, {visible(phase)}"
        self.within(0.0)

    def note(self, text: str) -> None:
        """Print lines for people."""
        cleared = CLEARED if self._live else ""
        print(f"{cleared}{visible_lines(text)}", file=sys.stderr, flush=True)

    def within(self, share: float) -> None:
        """Print the progress when a share of the next piece is done, 0 to 1."""
        now, part = time.monotonic(), (self._done + share) / self._total
        # Pieces that are phases take unlike times.
        left = f", {(now - self._began) * (1 / part - 1):.0f} s left" if 0 < part < 1 else ""
        said = f"{self._what}: {self._phase or f'{100 * part:.0f} % done{left}'}"
        if self._live:
            bar = "#" * round(_BAR * part)
            print(f"{CLEARED}[{bar:.<{_BAR}}] {said}", end="", file=sys.stderr, flush=True)
        elif now - self._said >= _PROGRESS_INTERVAL_S and not self._quiet:
            self._said = now
            # Of a job to standard output, so that it does not fill the log; there a command prints
            # its results.
            print(said, file=sys.stderr if self._alone else sys.stdout, flush=True)


def warn(text: str) -> None:
    """Print a warning to the terminal and to the job's log."""
    line = f"biogrip: warning: {visible_lines(text)}"
    print(line, flush=True)
    if not sys.stderr.isatty():
        print(line, file=sys.stderr, flush=True)
