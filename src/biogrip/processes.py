"""How a command and its worker processes end: at once and with one line when they are stopped.

Signals have handlers that exit, for an exception would not do: libraries that are loading, or call
back, replace or swallow it. Files are written atomically, so only scratch files need to be removed.
Processes that work side by side for a command end with it.
"""

import atexit
import gc
import os
import signal
import sys
import threading
import time
from contextlib import suppress
from types import FrameType

from biogrip.terminal import CLEARED

_ENDINGS = {signal.SIGINT: "stopped", signal.SIGTERM: "ended by SIGTERM"}

_PARENT_CHECK_S = 0.5

unfinished: set[str] = set()
"""Scratch files that are being written, to be removed if the command is stopped."""


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
