"""Processes that work side by side for a command, and end with it."""

import os
import signal
import threading
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from contextlib import suppress
from multiprocessing import get_context

from biogrip.stopping import unfinished

_EVERY_S = 0.5


def worker_processes(count: int, begin: Callable[[], None] | None = None) -> ProcessPoolExecutor:
    """Return an executor whose processes end when this one does, however that ends.

    They are forked; a callback that is given is called first in each, and may hold what cannot be
    pickled.
    """
    return ProcessPoolExecutor(
        count, get_context("fork"), initializer=_begin, initargs=(os.getpid(), begin)
    )


def _begin(parent: int, begin: Callable[[], None] | None) -> None:
    """Leave signals of the terminal to the parent, and end with it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    threading.Thread(target=_watch, args=(parent,), daemon=True).start()
    if begin is not None:
        begin()


def _watch(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(_EVERY_S)
    for path in unfinished:
        with suppress(OSError):
            os.unlink(path)
    os._exit(1)
