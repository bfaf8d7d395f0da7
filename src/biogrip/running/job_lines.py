"""A logger plugin of Snakemake: one line per finished job, as ``biogrip run`` shows a study."""

import os
import shutil
import sys
import time
from logging import WARNING, LogRecord
from typing import Any

from snakemake_interface_logger_plugins.base import LogHandlerBase
from snakemake_interface_logger_plugins.common import LogEvent
from snakemake_interface_logger_plugins.registry import LoggerPluginRegistry

from biogrip.progress import QUIET
from biogrip.terminal import visible, visible_lines

NAME = "biogrip"
_NOTHING = "Nothing to be done"
# Reasons of a first run, which say nothing.
_USUAL = ("Missing output files", "Input files updated by another job", "Rules with")


def register() -> None:
    """Make the plugin known to Snakemake, for its option ``--logger``."""
    LoggerPluginRegistry().register_plugin(f"snakemake_logger_plugin_{NAME}", sys.modules[__name__])


class LogHandler(LogHandlerBase):
    """Prints warnings and errors, and on a terminal one line per finished job."""

    writes_to_stream = True
    writes_to_file = False
    has_filter = False
    has_formatter = False
    needs_rulegraph = False

    def __post_init__(self) -> None:
        """Silence the progress that jobs print themselves."""
        os.environ[QUIET] = "1"
        self._lines = JobLines()

    def emit(self, record: LogRecord) -> None:
        """Print what is to be shown of a record; Snakemake's own log has all of it."""
        if record.levelno >= WARNING or str(record.msg).startswith(_NOTHING):
            print(visible_lines(self.format(record)), file=sys.stderr, flush=True)
            return
        for line in self._lines.of(record):
            if sys.stderr.isatty():
                print(_cut(visible(line)), file=sys.stderr, flush=True)


class JobLines:
    """Lines for the finished jobs of a run, with the share of the whole and the time left."""

    def __init__(self) -> None:
        self._begun_s = time.monotonic()
        self._messages: dict[int, str] = {}
        self._finished: list[int] = []

    def of(self, record: Any) -> list[str]:
        """Return the lines that a record of Snakemake adds."""
        event = getattr(record, "event", None)
        if event == LogEvent.RUN_INFO:
            self._begun_s = time.monotonic()
            return [f"{record.stats['total']} jobs"]
        if event == LogEvent.JOB_INFO:
            self._messages[record.jobid] = f"{record.rule_msg or record.rule_name}{_again(record)}"
        elif event == LogEvent.JOB_FINISHED:
            self._finished.append(record.job_id)
        elif event == LogEvent.PROGRESS:
            before = f"{_share(record)}  {self._left(record):>13}  "
            finished, self._finished = self._finished, []
            return [before + self._messages.pop(job, f"job {job}") for job in finished]
        return []

    def _left(self, record: Any) -> str:
        """Return the time left if the remaining jobs take as long as the finished ones."""
        elapsed_s = time.monotonic() - self._begun_s
        left_s = round(elapsed_s / record.done * (record.total - record.done))
        return f"{left_s} s left" if left_s < 120 else f"{left_s // 60} min left"


def _cut(line: str) -> str:
    """Return a line that is no longer than the terminal is wide."""
    most = shutil.get_terminal_size().columns
    return line if len(line) <= most else f"{line[: most - 1]}…"


def _share(record: Any) -> str:
    return f"{100 * record.done // record.total:3d} %"


def _again(record: Any) -> str:
    """Return the reasons for which a job is done that is not done for the first time."""
    reasons = [reason.partition(":")[0] for reason in record.reason.split("; ")]
    unusual = [reason.lower() for reason in reasons if not reason.startswith(_USUAL)]
    return f" ({', '.join(unusual)})" if any(unusual) else ""
