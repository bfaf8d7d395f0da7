"""A command that is stopped ends at once and says so in a line, wherever it happens to be.

An exception would not do: what is raised while a library is loaded, or calls back, is made another
error of, or swallowed. Files are written whole or not at all, so that nothing else is to be tidied
up than what is not yet in its place.
"""

import os
import signal
import sys
from contextlib import suppress
from types import FrameType

from biogrip.terminal import visible

_SAID = {signal.SIGINT: "stopped", signal.SIGTERM: "ended by SIGTERM"}
_CLEARED = "\r\x1b[K"

unfinished: set[str] = set()
"""Files that are being written, and removed if the command is stopped meanwhile."""


def end_when_stopped() -> None:
    """Take the signals that stop a command, but for those that are ignored, as with ``nohup``."""
    for number in _SAID:
        if signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, _end)


def end_at_once(number: int, line: str) -> None:
    """End by a signal, with a line about it.

    Parameters
    ----------
    number
        The signal's. The exit status is a shell's for it: 128 more.
    line
        What to say, the name of the command before it.
    """
    # Whoever stops it twice changes nothing.
    for other in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(other, signal.SIG_IGN)
    for path in unfinished:
        with suppress(OSError):
            os.unlink(path)
    # This may have come in the middle of a write to either.
    with suppress(OSError, RuntimeError, ValueError):
        sys.stdout.flush()
    with suppress(OSError):
        cleared = _CLEARED if os.isatty(2) else ""
        os.write(2, f"{cleared}biogrip: {visible(line)}\n".encode())
    os._exit(128 + number)


def _end(number: int, _: FrameType | None) -> None:
    end_at_once(number, f"{_SAID[signal.Signals(number)]}; nothing was written by halves.")
