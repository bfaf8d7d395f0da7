"""Jobs that run side by side, each in a process of its own."""

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from typing import Any, TypeVar

from biogrip.processes import end_with

J = TypeVar("J")
R = TypeVar("R")


def side_by_side(work: Callable[[J], R], jobs: Sequence[J], most: int) -> Iterator[R | None]:
    """Yield what work gives of each job, in their order; None if its process was killed.

    Each job has a process of its own, so that a kill costs no other its result. At most some are
    there at once; they are forked, and end when this one does, however that ends. An error that
    work raises is raised here.
    """
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
    ours: Connection, theirs: Connection, parent: int, work: Callable[[J], R], job: J
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
