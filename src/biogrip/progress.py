"""Progress of long jobs, printed every few seconds, and warnings."""

import os
import sys
import time
from typing import Self

from biogrip.terminal import visible, visible_lines

QUIET = "BIOGRIP_QUIET"
"""Environment variable; if set, jobs print warnings but no progress."""

_EVERY_S = 5.0
_CLEARED = "\r\x1b[K"


class Progress:
    """Counter of the completed pieces of a job.

    If it is live, it shows every phase on the terminal in a line that is cleared at the end: not
    for jobs that share a terminal. If it is quiet, it prints notes only.
    """

    def __init__(self, what: str, total: int, *, live: bool = False, quiet: bool = False) -> None:
        self._what = visible(what)
        self._total = total
        self._live = live and sys.stderr.isatty()
        self._quiet = quiet or QUIET in os.environ
        self._done = 0
        self._phase = ""
        self._said = time.monotonic()

    def __enter__(self) -> Self:
        """Return the counter."""
        return self

    def __exit__(self, *_: object) -> None:
        """Clear the line on the terminal."""
        if self._live:
            print(_CLEARED, end="", file=sys.stderr, flush=True)

    def done(self, pieces: int = 1) -> None:
        """Count completed pieces, and print the progress."""
        self._done += pieces
        self._phase = ""
        self._say("")

    def doing(self, phase: str) -> None:
        """Set the name of the current phase."""
        self._phase = f", {visible(phase)}"
        self._say("")

    def note(self, text: str) -> None:
        """Print lines for people, unless progress is not to be printed."""
        if QUIET not in os.environ:
            cleared = _CLEARED if self._live else ""
            print(f"{cleared}{visible_lines(text)}", file=sys.stderr, flush=True)

    def within(self, evaluations: int, misfit_rad: float) -> None:
        """Print the progress of an identification within a piece."""
        self._say(f", {evaluations} responses, misfit {misfit_rad:.4g}")

    def _say(self, more: str) -> None:
        now = time.monotonic()
        said = f"{self._what}: {self._done} of {self._total} done{self._phase}{more}"
        if self._live:
            print(f"{_CLEARED}{said}", end="", file=sys.stderr, flush=True)
        elif now - self._said >= _EVERY_S and not self._quiet:
            self._said = now
            # To standard output, so that it does not fill the job's log.
            print(said, flush=True)


def warn(text: str) -> None:
    """Print a warning to the terminal and to the job's log."""
    line = f"biogrip: warning: {visible_lines(text)}"
    print(line, flush=True)
    if not sys.stderr.isatty():
        print(line, file=sys.stderr, flush=True)
