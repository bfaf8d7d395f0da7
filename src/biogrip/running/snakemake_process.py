"""Process in which `biogrip run` runs Snakemake, stoppable at any time without a traceback.

Snakemake shows a traceback, or ignores the signal, if it is interrupted while it loads or plans.
"""

import atexit
import gc
import io
import os
import signal
import sys
import time
from contextlib import nullcontext, redirect_stderr
from pathlib import Path
from types import FrameType

from biogrip.running.locks import is_locked, is_locked_by_dead

_AGAIN_S = 0.05
# Interrupt anyway after this, in case a version of Snakemake waits in another function.
_PATIENCE_S = 10.0
_stop_requests_s: list[float] = []


def main() -> None:
    """Run Snakemake with the arguments of this process."""
    # Skip garbage collection at exit, see `biogrip.__main__`.
    atexit.register(gc.freeze)
    # Background scripts start children with SIGINT ignored.
    for number in (signal.SIGINT, signal.SIGALRM):
        signal.signal(number, _stop)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
    from snakemake import cli
    from snakemake.exceptions import print_exception

    from biogrip.running import preparation
    from biogrip.running.job_lines import register
    from biogrip.running.wholeness import message_only

    sys.argv[0] = "snakemake"
    register()
    with message_only():
        sys.argv[1:] = preparation.prepared(sys.argv[1:])
    # What has been checked can be parsed; that would only print the name of the profile.
    with redirect_stderr(io.StringIO()) if preparation.done else nullcontext():
        parser, options = cli.parse_args(sys.argv[1:])
    try:
        status = 0 if cli.args_to_api(options, parser) else 1
    except Exception as error:
        print_exception(error)
        status = 1
    sys.exit(status)


def _stop(_: int, frame: FrameType | None) -> None:
    """Exit if no job can be running; otherwise interrupt Snakemake while it waits for jobs."""
    if not is_locked(Path(".snakemake")) or is_locked_by_dead(Path(".snakemake")):
        os._exit(128 + signal.SIGINT)
    # Try again later: planning may not have reached the wait, or a job may have just begun.
    signal.setitimer(signal.ITIMER_REAL, _AGAIN_S)
    _stop_requests_s.append(time.monotonic())
    waits = _waits_for_jobs(frame) or _stop_requests_s[-1] - _stop_requests_s[0] > _PATIENCE_S
    # Interrupt only once: a second time would interrupt the cancelling of jobs.
    interrupts = waits and signal.getsignal(signal.SIGTERM) is not _cancelling
    if interrupts:
        signal.signal(signal.SIGTERM, _cancelling)
    if signal.getsignal(signal.SIGTERM) is _cancelling:
        # Unlike SIGINT, SIGTERM shows no traceback of a Python that is just starting.
        os.killpg(0, signal.SIGTERM)
    if interrupts:
        raise KeyboardInterrupt


def _cancelling(_: int, __: FrameType | None) -> None:
    """Ignore the signal, which is meant for the jobs only."""


def _waits_for_jobs(frame: FrameType | None) -> bool:
    """Return True if the frame is Snakemake's scheduler waiting for a job to end."""
    names: list[str] = []
    while frame is not None and len(names) < 3:
        names.append(frame.f_code.co_name)
        frame = frame.f_back
    return names == ["wait", "acquire", "schedule"]


if __name__ == "__main__":
    main()
