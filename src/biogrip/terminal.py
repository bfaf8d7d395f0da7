"""A process and its terminal: untrusted text escaped, columns, progress, warnings, and its end.

When it is stopped, a command ends at once and with one line. Signals have handlers that exit, for
an exception would not do: libraries that are loading, or call back, replace or swallow it. Files
are written atomically, so only scratch files need to be removed. Processes that work side by side
for a command end with it.
"""

import atexit
import gc
import os
import signal
import sys
import threading
import time
from collections.abc import Sequence
from contextlib import AbstractContextManager, suppress
from itertools import zip_longest
from types import FrameType

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
_ENDINGS = {signal.SIGINT: "stopped", signal.SIGTERM: "ended by SIGTERM"}

_PARENT_CHECK_S = 0.5

unfinished: set[str] = set()
"""Scratch files that are being written, to be removed if the command is stopped."""


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


def end_when_stopped() -> None:
    """Install handlers for stop signals, except those ignored, as with ``nohup``."""
    for number in _ENDINGS:
        if signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, _end_with_signal)


def _end_with_signal(number: int, _: FrameType | None) -> None:
    """Exit with a message after the command's name; the status is 128 plus the signal's number."""
    # Ignore further signals.
    for other in ("SIGINT", "SIGTERM", "SIGHUP"):
        if hasattr(signal, other):  # Windows has no SIGHUP.
            signal.signal(getattr(signal, other), signal.SIG_IGN)
    _remove_unfinished()
    # A signal may arrive during a write to either stream.
    with suppress(OSError, RuntimeError, ValueError):
        sys.stdout.flush()
    with suppress(OSError):
        cleared = CLEARED if os.isatty(2) else ""
        said = f"{_ENDINGS[signal.Signals(number)]}; no file was left half-written."
        os.write(2, f"{cleared}biogrip: {said}\n".encode())
    os._exit(128 + number)


def _remove_unfinished() -> None:
    for path in unfinished:
        with suppress(OSError):
            os.unlink(path)


def collect_less() -> None:
    """Look for garbage less often, as loading leaves little, and not at exit: for speed."""
    gc.set_threshold(50_000)
    # That would be a fifth of a short job's time.
    atexit.register(gc.freeze)


def end_with(parent: int) -> None:
    """Leave signals of the terminal to the parent of this process, and end with it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    threading.Thread(target=_watch, args=(parent,), daemon=True).start()


def _watch(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(_PARENT_CHECK_S)
    _remove_unfinished()
    os._exit(1)
