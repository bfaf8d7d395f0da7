"""How far a long job has come, said every few seconds and not at all in a short one; warnings."""

import sys
import time
from typing import Self

from biogrip.terminal import visible, visible_lines

_EVERY_S = 5.0
_CLEARED = "\r\x1b[K"


class Progress:
    """Counts what is done.

    Parameters
    ----------
    what
        Name of the job.
    total
        How many pieces it has.
    live
        Whether somebody who waits at a terminal sees every phase as it begins, in a line
        that goes when all is done. Not for jobs that share a terminal.
    """

    def __init__(self, what: str, total: int, *, live: bool = False) -> None:
        self._what = visible(what)
        self._total = total
        self._live = live and sys.stderr.isatty()
        self._done = 0
        self._phase = ""
        self._said = time.monotonic()

    def __enter__(self) -> Self:
        """Begin."""
        return self

    def __exit__(self, *_: object) -> None:
        """Leave nothing on the terminal."""
        if self._live:
            print(_CLEARED, end="", file=sys.stderr, flush=True)

    def done(self, pieces: int = 1) -> None:
        """Count what is done."""
        self._done += pieces
        self._phase = ""
        self._say("")

    def doing(self, phase: str) -> None:
        """Name what comes next, until it is done."""
        self._phase = f", {visible(phase)}"
        self._say("")

    def within(self, evaluations: int, misfit_rad: float) -> None:
        """Follow what an identifier does within a piece."""
        self._say(f", {evaluations} responses, misfit {misfit_rad:.4g} rad")

    def _say(self, more: str) -> None:
        now = time.monotonic()
        said = f"{self._what}: {self._done} of {self._total} done{self._phase}{more}"
        if self._live:
            print(f"{_CLEARED}{said}", end="", file=sys.stderr, flush=True)
        elif now - self._said >= _EVERY_S:
            self._said = now
            # Past the job's log, to whoever waits at the terminal.
            print(said, flush=True)


def warn(text: str) -> None:
    """Say what should be doubted: to whoever waits at the terminal, and in the job's log."""
    line = f"biogrip: warning: {visible_lines(text)}"
    print(line, flush=True)
    if not sys.stderr.isatty():
        print(line, file=sys.stderr, flush=True)
