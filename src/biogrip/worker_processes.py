"""Processes that work side by side for a command, and end with it."""

import os
import signal
import threading
import time
from concurrent.futures import ProcessPoolExecutor
from contextlib import suppress

from biogrip.stopping import unfinished

_EVERY_S = 0.5


def worker_processes(count: int) -> ProcessPoolExecutor:
    """Return an executor whose processes end when this one does, however that ends."""
    return ProcessPoolExecutor(count, initializer=_end_with, initargs=(os.getpid(),))


def _end_with(parent: int) -> None:
    """Leave signals of the terminal to the parent, and end with it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    threading.Thread(target=_watch, args=(parent,), daemon=True).start()


def _watch(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(_EVERY_S)
    for path in unfinished:
        with suppress(OSError):
            os.unlink(path)
    os._exit(1)
