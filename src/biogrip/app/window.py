"""What one window has: its files, what is chosen, the command that follows, and what that gave."""

import json
import re
import signal
import subprocess
import sys
import time
from base64 import b64decode
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from shlex import join
from threading import Lock, Timer
from typing import IO, Any

from biogrip.app.choices import CHOICES, likely_choices, options_typed
from biogrip.cli import options_of
from biogrip.command.files import traces_of
from biogrip.command.settings import Asked, check_settings, is_table, read_trace
from biogrip.command.words import limits_in_short
from biogrip.errors import BiogripError
from biogrip.physics.instruments import INSTRUMENTS
from biogrip.traces.reader import Recording
from biogrip.traces.tables import Sheet, Table, numbers_in, overview

LARGEST_MB, LONGEST_S = 200, 1800
"""Of files that are dropped at once, and of the time after which a command is stopped."""

_UNSAFE = re.compile(r"[^\w .,=()+-]|^[ .-]+")
# Of a table so many traces are checked before all run.
_LONGEST_NAME, _MOST_POINTS, _CHECKED = 100, 1000, 3
_PICTURE = re.compile(rb'<img class="(?:fit-picture|all)" src="data:image/png;base64,([^"]+)"')


@dataclass
class Window:
    """Files and choices of one window; all of it is in its folder, and goes with that."""

    folder: Path
    """Folder of the files; what the command writes is in others beside it."""
    names: list[str] = field(default_factory=list)
    config: list[str] = field(default_factory=list)
    """The option with the name of a dropped config."""
    chosen: dict[str, str] = field(default_factory=lambda: dict.fromkeys(CHOICES, ""))
    lock: Lock = field(default_factory=Lock)
    sheet: Sheet | None = None
    """Cells of the first trace, or of the first that a table lists."""
    tables: list[Table] = field(default_factory=list)
    table: Table | None = None
    """That of the tables in it that is shown."""
    points: dict[str, list[str]] = field(default_factory=dict)
    """Numbers of its columns, of some rows."""
    looked_at: tuple[str, int, str] = "", 0, ""
    """The file, its time and the block, of which these are."""
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
    ran: str = ""
    """What had been typed for it; nothing if a file has come since."""
    compared: str = ""
    """What the comparison of groups says."""

    def add(self, name: str, content: IO[bytes]) -> None:
        """Keep a file under a name of letters, digits and few marks, in no other folder."""
        plain = _UNSAFE.sub("_", re.split(r"[/\\]", name)[-1])[-_LONGEST_NAME:] or "_"
        if plain.endswith((".yaml", ".yml")):
            self.config = ["--config", plain]
        else:
            self.names = [*dict.fromkeys([*self.names, plain])]
        (self.folder / plain).write_bytes(content.read())
        self.ran = ""

    @property
    def inputs(self) -> list[str]:
        """Files to identify: tables of traces, or else all."""
        return [name for name in self.names if is_table(Asked(self.folder / name))] or self.names

    @property
    def typed(self) -> list[str]:
        """The command as it is typed, but for what it writes."""
        return ["identify", *self.inputs, *options_typed(self.chosen), *self.config]

    @property
    def axis(self) -> str:
        """What readings follow: time or frequency."""
        return "frequency" if INSTRUMENTS[self.chosen["reading"] or "rotation"].sweeps else "time"

    @property
    def units(self) -> dict[str, str]:
        """Units of columns that have one, as they are read or stand below the names."""
        below = zip(self.table.names, self.table.units or (), strict=False) if self.table else ()
        read = self.recording.form["columns"].values() if self.recording else ()
        units = dict(below) | {it["column"]: it["unit"] for it in read}
        return {name: unit.strip("[]() ") for name, unit in units.items() if unit not in ("1", "-")}

    def look(self) -> None:
        """Read the first trace; if it has not what is chosen, choose what names of columns tell."""
        first = next((name for name in self.names if name not in self.inputs), self.names[0])
        now = first, (self.folder / first).stat().st_mtime_ns, self.chosen["block"]
        if now == self.looked_at:
            return
        self.looked_at, self.table = now, None
        self.sheet, self.tables = overview(self.folder / first)
        block, longest = self.chosen["block"], max(self.tables, key=lambda it: it.end - it.first)
        self.table = {f"{n}": table for n, table in enumerate(self.tables, 1)}.get(block, longest)
        numbers = numbers_in(self.sheet, self.table)
        every = (self.table.end - self.table.first) // _MOST_POINTS + 1
        self.points = {name: [f"{it:.8g}" for it in own[::every]] for name, own in numbers.items()}
        if self.chosen["column"] not in numbers:
            self.chosen |= likely_choices(numbers)

    def check(self) -> None:
        """Find out what the command would do with what is chosen."""
        self.command, self.problem, self.traces, self.recording = "", "", [], None
        try:
            self.look()
            self.command = join(["biogrip", *self.typed]) + " --report page.html --csv table.csv"
            self.traces = self._traces()
            there = [own for own in self.traces if own.trace.is_file()]
            check_settings(there[:_CHECKED])
            self.recording = read_trace(there[0])[0] if there else None
        except BiogripError as error:
            self.problem = self._missing() or self.shown(error)

    def _missing(self) -> str:
        """Ask for the column of readings, or of what they follow, before anything else."""
        given = self.config or self.chosen["more"] or self.names != self.inputs
        asked = {} if given or not self.table else {"column": "reading", self.axis: self.axis}
        missing = [what for name, what in asked.items() if not self.chosen[name]]
        return f"Which column is the {missing[0]}? Choose it under 2." if missing else ""

    def _traces(self) -> list[Asked]:
        """Return what is asked; a `BiogripError` says what the window does not do."""
        given = options_of(self.typed)
        allowed = {"command", "files", "settings", *(["config"] if self.config else [])}
        if others := {*given} - allowed:
            raise BiogripError(f"--{min(others)}: not here; download results, drop a config.")
        files = [self.folder / name for name in self.inputs]
        config = self.folder / self.config[1] if self.config else None
        traces = traces_of(files, config, given["settings"])
        for own in (trace for sample in traces for trace in sample.traces):
            if own.trace.resolve().parent != self.folder.resolve():
                raise BiogripError(f"{own.place}: found {own.trace}, allowed are dropped files.")
        return traces

    def shown(self, message: object) -> str:
        """Return a message without the folder, which is nobody's."""
        return str(message).replace(f"{self.folder}/", "").replace(f" in {self.folder}", "")

    @property
    def running_s(self) -> int:
        """How long the command runs, at least 1; 0 if it does not."""
        return int(time.time() - self.started) + 1 if self.work and self.work.poll() is None else 0

    @property
    def of_table(self) -> bool:
        """True of several traces, or of a table of them."""
        return len(self.traces) > 1 or any(own.place != Asked.place for own in self.traces)

    def start(self) -> None:
        """Start the command in a process of its own, in place of what ran before."""
        self.stop()
        self.started, self.compared, self.ran = time.time(), "", self.command
        self.out = self.folder.with_name(f"{self.folder.name} {time.monotonic_ns()}")
        self.out.mkdir()
        names = {"--report": "page.html", "--csv": "table.csv", "--output": "result.json"}
        outputs = [f"{option}={self.out / name}" for option, name in names.items()]
        command = [sys.executable, "-m", "biogrip", *self.typed, *outputs[: 3 - self.of_table]]
        with (self.out / "stdout").open("wb") as stdout, (self.out / "stderr").open("wb") as stderr:
            self.work = subprocess.Popen(command, cwd=self.folder, stdout=stdout, stderr=stderr)
        limit = Timer(LONGEST_S, self.work.send_signal, [signal.SIGTERM])
        limit.daemon = True
        limit.start()

    def stop(self) -> None:
        """Stop the command, which leaves no file half-written, and wait for its end."""
        if self.work and self.running_s:
            self.work.send_signal(signal.SIGTERM)
            self.work.wait()

    def said(self, stream: str) -> str:
        """Return what the command has printed, but for the files that it has written."""
        said = (self.out / stream).read_text("utf-8", "replace")
        return self.shown(said.partition("\nWritten to ")[0])

    def compare(self) -> None:
        """Compare groups of the traces, by columns of their table."""
        by = [f"--{name}={self.chosen[name]}" for name in ("by", "unit") if self.chosen[name]]
        typed = ["groups", "table.csv", *by, "--csv", "groups.csv", "--plot", "groups.png"]
        command = [sys.executable, "-m", "biogrip", *typed]
        ended = subprocess.run(command, cwd=self.out, capture_output=True, text=True, timeout=60)
        self.compared = f"{join(['biogrip', *typed])}\n\n{ended.stderr}{ended.stdout}"

    def done(self) -> Iterator[tuple[str, str, Mapping[str, str]]]:
        """Yield name, status and quantities of several traces; nothing of those that wait."""
        for own in self.traces:
            data: dict[str, Any] = {"fit": "", "quantities": []}
            if own.output.exists() and own.output.stat().st_mtime > self.started:
                data = json.loads(own.output.read_text("utf-8"))
            told = {it["quantity"]: limits_in_short(it) for it in data["quantities"]}
            yield self.shown(own.name), data["fit"], told

    def output(self, name: str) -> bytes:
        """Return a file of the results, or the picture of the fit; nothing if there is none."""
        file = self.out / ("page.html" if name == "figure.png" else name)
        content = file.read_bytes() if self.work and file.is_file() else b""
        picture = _PICTURE.search(content) if name == "figure.png" else None
        return b64decode(picture[1]) if picture else content
