"""Snakemake as `biogrip run` starts it: it can always be stopped, and without a stack.

An interruption while it loads or plans would show where in its code it was, or be swallowed there.
"""

import atexit
import gc
import os
import signal
import sys
import time
from pathlib import Path
from types import FrameType

from biogrip.running.locks import is_locked

_AGAIN_S = 0.05
# Wherever it is by then, as in a version that waits in another way.
_PATIENCE_S = 10.0
_asked_s: list[float] = []


def main() -> None:
    """Run Snakemake with the arguments of this process."""
    # As of a job, see `biogrip.__main__`: looking for cycles at the end takes time.
    atexit.register(gc.freeze)
    # What is started by a script in the background would ignore it.
    for number in (signal.SIGINT, signal.SIGALRM):
        signal.signal(number, _stop)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
    from snakemake.cli import main as snakemake

    sys.argv[0] = "snakemake"
    snakemake()


def _stop(_: int, frame: FrameType | None) -> None:
    """End at once where no job can run, else as Snakemake does where it waits for its jobs."""
    if not is_locked(Path(".snakemake")):
        os._exit(128 + signal.SIGINT)
    # It may have to come that far, and a job may have begun just now.
    signal.setitimer(signal.ITIMER_REAL, _AGAIN_S)
    _asked_s.append(time.monotonic())
    waits = _waits_for_jobs(frame) or _asked_s[-1] - _asked_s[0] > _PATIENCE_S
    # Once: again, it would interrupt the cancelling of jobs.
    interrupts = waits and signal.getsignal(signal.SIGTERM) is not _cancelling
    if interrupts:
        signal.signal(signal.SIGTERM, _cancelling)
    if signal.getsignal(signal.SIGTERM) is _cancelling:
        # Unlike SIGINT, this shows no stack of a Python that is just starting.
        os.killpg(0, signal.SIGTERM)
    if interrupts:
        raise KeyboardInterrupt


def _cancelling(_: int, __: FrameType | None) -> None:
    """Take the signal that is meant for the jobs."""


def _waits_for_jobs(frame: FrameType | None) -> bool:
    """Whether Snakemake's scheduler was interrupted in its wait for a job to end."""
    names: list[str] = []
    while frame is not None and len(names) < 3:
        names.append(frame.f_code.co_name)
        frame = frame.f_back
    return names == ["wait", "acquire", "schedule"]


if __name__ == "__main__":
    main()
