"""How a command and its worker processes end: at once and with one line when they are stopped.

Signals have handlers that exit, for an exception would not do: libraries that are loading, or call
back, replace or swallow it. Files are written atomically, so only scratch files need to be removed.
Processes that work side by side for a command (`side_by_side`) end with it.
"""

import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from types import FrameType
from typing import TYPE_CHECKING, Any, TypeVar

from biogrip.terminal import CLEARED

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

J = TypeVar("J")
R = TypeVar("R")

_SAID = {signal.SIGINT: "stopped", signal.SIGTERM: "ended by SIGTERM"}

_EVERY_S = 0.5

unfinished: set[str] = set()
"""Scratch files that are being written, to be removed if the command is stopped."""


def end_when_stopped() -> None:
    """Install handlers for stop signals, except those ignored, as with ``nohup``."""
    for number in _SAID:
        if signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, _end)


def _end(number: int, _: FrameType | None) -> None:
    """Exit with a message after the command's name; the status is 128 plus the signal's number."""
    # Ignore further signals.
    for other in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(other, signal.SIG_IGN)
    _remove_unfinished()
    # A signal may arrive during a write to either stream.
    with suppress(OSError, RuntimeError, ValueError):
        sys.stdout.flush()
    with suppress(OSError):
        cleared = CLEARED if os.isatty(2) else ""
        said = f"{_SAID[signal.Signals(number)]}; no file was left half-written."
        os.write(2, f"{cleared}biogrip: {said}\n".encode())
    os._exit(128 + number)


def _remove_unfinished() -> None:
    for path in unfinished:
        with suppress(OSError):
            os.unlink(path)


def end_with(parent: int) -> None:
    """Leave signals of the terminal to the parent of this process, and end with it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    threading.Thread(target=_watch, args=(parent,), daemon=True).start()


def _watch(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(_EVERY_S)
    _remove_unfinished()
    os._exit(1)


def side_by_side(work: Callable[[J], R], jobs: Sequence[J], most: int) -> Iterator[R | None]:
    """Yield what work gives of each job, in their order; None if its process was killed.

    Each job has a process of its own, so that a kill costs no other its result. At most some are
    there at once; they are forked, and end when this one does, however that ends. An error that
    work raises is raised here.
    """
    # Imported here: this module is loaded before everything else.
    from multiprocessing import get_context
    from multiprocessing.connection import wait

    fork = get_context("fork")
    running: dict[Any, tuple[int, Any]] = {}
    done: dict[int, R | None] = {}
    started = given = 0
    try:
        while given < len(jobs):
            while started < len(jobs) and len(running) < most:
                ours, theirs = fork.Pipe(duplex=False)
                job = ours, theirs, os.getpid(), work, jobs[started]
                process = fork.Process(target=_send, args=job)
                process.start()
                # What nobody can write to any more has an end.
                theirs.close()
                running[ours] = started, process
                started += 1
            ready: list[Any] = wait([*running])
            for one in ready:
                number, process = running.pop(one)
                try:
                    done[number], error = one.recv()
                except (EOFError, OSError):
                    done[number], error = None, None
                process.join()
                if error is not None:
                    raise error
            while given in done:
                yield done.pop(given)
                given += 1
    finally:
        for ours, (_, process) in running.items():
            ours.close()
            process.join()


def _send(
    ours: "Connection", theirs: "Connection", parent: int, work: Callable[[J], R], job: J
) -> None:
    """Send what work gives, and the error that it raises, of which one is None."""
    end_with(parent)
    # If the parent ends before, nobody reads what is sent.
    ours.close()
    try:
        found: tuple[R | None, Exception | None] = work(job), None
    except Exception as error:
        found = None, error
    with suppress(OSError):
        theirs.send(found)
