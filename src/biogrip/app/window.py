"""What one window has: its files, what is chosen, the command that follows, and what that gave."""

import json
import re
import signal
import subprocess
import sys
import time
from base64 import b64decode
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from shlex import join
from threading import Lock, Timer
from typing import IO

import numpy as np

from biogrip.app.choices import CHOICES, likely_choices, options_typed
from biogrip.arrays import Array
from biogrip.cli import options_of
from biogrip.command.files import traces_of
from biogrip.command.settings import Asked, check_settings, read_trace
from biogrip.command.sheet import is_table
from biogrip.command.words import limits_in_short
from biogrip.errors import BiogripError
from biogrip.terminal import visible
from biogrip.traces.reader import Recording
from biogrip.traces.tables import Sheet, Table, find_marks, is_clock, overview, seconds_or_inf

MOST_FILES, LONGEST_S = 500, 1800
"""Files of a window at most, and the time after which its command is stopped."""

_UNSAFE = re.compile(r"[^\w .,=()+-]|^[ .-]+")
_CONFIGS = ".yaml", ".yml"
_LONGEST_NAME, _ROWS_SHOWN, _MOST_POINTS = 100, 6, 1000
# So many traces of a table are checked before all run.
_CHECKED = 3
_PICTURE = re.compile(rb'<img class="(?:fit-picture|all)" src="data:image/png;base64,([^"]+)"')


@dataclass(frozen=True)
class Preview:
    """A file as it was read, before anybody says which columns are to be used."""

    sheet: Sheet
    tables: list[Table]
    table: Table
    """The one that is shown."""

    @property
    def rows(self) -> list[list[str]]:
        """Its first rows."""
        rows = slice(self.table.first, min(self.table.first + _ROWS_SHOWN, self.table.end))
        return [[*map(str, row)] for row in self.sheet.cells[rows, : len(self.table.names)]]

    @cached_property
    def points(self) -> dict[str, list[float | None]]:
        """Numbers of every column, of some rows; None for none."""
        every = -(-(self.table.end - self.table.first) // _MOST_POINTS) or 1
        names = filter(None, self.table.names)
        columns = {name: self.numbers(name)[::every].tolist() for name in names}
        return {
            name: [value if np.isfinite(value) else None for value in values]
            for name, values in columns.items()
        }

    def numbers(self, name: str) -> Array:
        """Return the numbers of a column, (n_rows,), times of day in s; NaN or inf for others."""
        rows = slice(self.table.first, self.table.end)
        cells = [*map(str, self.sheet.cells[rows, self.table.names.index(name)])]
        marks = find_marks(cells, self.sheet.separator)
        return np.array([*map(seconds_or_inf if is_clock(cells) else marks.number, cells)], float)


@dataclass
class Window:
    """Files and choices of one window; all of it is in its folder, and goes with that."""

    folder: Path
    """Folder of the files; what the command writes is in others beside it."""
    names: list[str] = field(default_factory=list)
    chosen: dict[str, str] = field(default_factory=lambda: dict.fromkeys(CHOICES, ""))
    lock: Lock = field(default_factory=Lock)
    preview: Preview | None = None
    """How the first trace looks."""
    command: str = ""
    """What gives the same in a terminal."""
    problem: str = ""
    """Why it would be refused."""
    traces: list[Asked] = field(default_factory=list)
    recording: Recording | None = None
    """The first trace, as it is read."""
    work: subprocess.Popen[bytes] | None = None
    """The command, while it runs and when it has ended."""
    out: Path = Path()
    started: float = 0.0
    compared: str = ""
    """What the comparison of groups says."""

    def add(self, name: str, content: IO[bytes]) -> None:
        """Keep a file under a name of letters, digits and few marks, in no other folder."""
        plain = _UNSAFE.sub("_", re.split(r"[/\\]", name)[-1])[-_LONGEST_NAME:] or "_"
        self.names = [*dict.fromkeys([*self.names, plain])][:MOST_FILES]
        if plain in self.names:
            (self.folder / plain).write_bytes(content.read())

    @property
    def inputs(self) -> list[str]:
        """Files to identify: tables of traces, or else all that are no configs."""
        names = [name for name in self.names if not name.endswith(_CONFIGS)]
        return [name for name in names if is_table(Asked(self.folder / name))] or names

    @property
    def typed(self) -> list[str]:
        """The command as it is typed, but for what it writes."""
        configs = [name for name in self.names if name.endswith(_CONFIGS)]
        config = ["--config", configs[-1]] if configs else []
        return ["identify", *self.inputs, *options_typed(self.chosen), *config]

    def look(self) -> None:
        """Read the first trace; if nothing is chosen yet, choose what names of columns tell."""
        self.preview = None
        names = [name for name in self.names if not name.endswith(_CONFIGS)]
        first = next((name for name in names if name not in self.inputs), names[0])
        sheet, tables = overview(self.folder / first)
        block, longest = self.chosen["block"], max(tables, key=lambda it: it.end - it.first)
        shown = dict(enumerate(tables, 1)).get(int(block) if block.isdecimal() else 0, longest)
        self.preview = Preview(sheet, tables, shown)
        if not self.chosen["column"]:
            self.chosen |= likely_choices([*filter(None, shown.names)], self.preview.numbers)

    def check(self) -> None:
        """Find out what the command would do with what is chosen."""
        self.command, self.problem, self.traces, self.recording = "", "", [], None
        try:
            self.look()
            written = ["--report", "page.html", "--csv", "table.csv"]
            self.command = join(["biogrip", *self.typed, *written])
            self.traces = self._traces()
            check_settings(self.traces[:_CHECKED])
            self.recording, _ = read_trace(self.traces[0])
        except BiogripError as error:
            self.problem = self.shown(error)

    def _traces(self) -> list[Asked]:
        """Return what is asked; a `BiogripError` says what the window does not do."""
        given = options_of(self.typed)
        config = given.pop("config", None)
        others = {*given} - {"files", "settings", "command"}
        if others or (config and str(config) not in self.names):
            text = "not here; results can be downloaded, and a config is dropped."
            raise BiogripError(f"--{min(others, default='config')}: {text}")
        files = [self.folder / name for name in self.inputs]
        traces = traces_of(files, config and self.folder / config, given["settings"])
        for own in traces:
            if own.trace.resolve().parent != self.folder:
                found = f"found '{visible(own.trace)}', allowed are names of dropped files"
                raise BiogripError(f"{own.place}: {found}.")
        return traces

    def shown(self, message: object) -> str:
        """Return a message without the folder, which is nobody's."""
        return str(message).replace(f"{self.folder}/", "").replace(f" in {self.folder}", "")

    @property
    def runs(self) -> bool:
        """True until the command has ended."""
        return self.work is not None and self.work.poll() is None

    @property
    def seconds(self) -> int:
        """How long it runs."""
        return int(time.time() - self.started)

    @property
    def of_table(self) -> bool:
        """True of several traces, or of a table of them."""
        return len(self.traces) > 1 or any(own.place != Asked.place for own in self.traces)

    @property
    def copied(self) -> list[str]:
        """Columns of a table of traces that set nothing: groups, dishes, ..."""
        return [*dict.fromkeys(name for own in self.traces for name in own.copied if name)]

    def start(self) -> None:
        """Start the command in a process of its own, in place of what ran before."""
        self.stop()
        self.started, self.compared = time.time(), ""
        self.out = self.folder.with_name(f"{self.folder.name} {time.monotonic_ns()}")
        self.out.mkdir()
        names = {"--report": "page.html", "--csv": "table.csv", "--output": "result.json"}
        outputs = [f"{option}={self.out / name}" for option, name in names.items()]
        command = [sys.executable, "-m", "biogrip", *self.typed, *outputs[: 3 - self.of_table]]
        with (self.out / "stdout").open("wb") as stdout, (self.out / "stderr").open("wb") as stderr:
            self.work = subprocess.Popen(command, cwd=self.folder, stdout=stdout, stderr=stderr)
        limit = Timer(LONGEST_S, self.work.send_signal, [signal.SIGINT])
        limit.daemon = True
        limit.start()

    def stop(self) -> None:
        """Stop the command as its user would in a terminal, and wait for its end."""
        if self.work is not None and self.runs:
            self.work.send_signal(signal.SIGINT)
            self.work.wait()

    def said(self, stream: str) -> str:
        """Return what the command has printed, but for the files that it has written."""
        said = (self.out / stream).read_text("utf-8")
        return self.shown(re.sub(r"(?m)^Written to .*$", "", said).strip())

    def compare(self) -> None:
        """Compare groups of the traces, by columns of their table."""
        by = [f"--{name}={self.chosen[name]}" for name in ("by", "unit") if self.chosen[name]]
        typed = ["groups", "table.csv", *by, "--csv", "groups.csv", "--plot", "groups.png"]
        command = [sys.executable, "-m", "biogrip", *typed]
        ended = subprocess.run(command, cwd=self.out, capture_output=True, text=True, timeout=60)
        self.compared = f"{join(['biogrip', *typed])}\n\n{ended.stderr}{ended.stdout}"

    def done(self) -> list[tuple[str, Mapping[str, str]]]:
        """Return what is known of each of several traces: nothing while it waits."""
        rows: list[tuple[str, Mapping[str, str]]] = []
        for own in self.traces:
            data = {"fit": "", "quantities": []}
            if own.output.exists() and own.output.stat().st_mtime > self.started:
                data = json.loads(own.output.read_text("utf-8"))
            told = {it["quantity"]: limits_in_short(it) for it in data["quantities"]}
            rows.append((self.shown(own.name), {"fit": data["fit"], **told}))
        return rows

    def output(self, name: str) -> bytes:
        """Return a file of the results, or the picture of the fit; nothing if there is none."""
        file = self.out / ("page.html" if name == "figure.png" else name)
        content = file.read_bytes() if self.work and file.is_file() else b""
        picture = _PICTURE.search(content) if name == "figure.png" else None
        return b64decode(picture[1]) if picture else content
