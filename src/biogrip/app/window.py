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
from pathlib import Path
from shlex import join
from threading import Lock, Timer
from typing import IO, Any

from biogrip.app.choices import CHOICES, likely_choices, options_typed
from biogrip.app.preview import Preview, previewed
from biogrip.cli import options_of
from biogrip.command.files import traces_of
from biogrip.command.settings import Asked, check_settings, read_trace
from biogrip.command.sheet import is_table
from biogrip.command.words import limits_in_short
from biogrip.errors import BiogripError
from biogrip.terminal import visible
from biogrip.traces.reader import Recording, form_in_words

MOST_FILES, LONGEST_S = 500, 1800
"""Files of a window at most, and the time after which its command is stopped."""

_UNSAFE = re.compile(r"[^\w .,=()+-]|^[ .-]+")
_LONGEST_NAME = 100
_CONFIGS = ".yaml", ".yml"
# So many traces of a table are checked before all run.
_CHECKED = 3
_PICTURE = re.compile(rb'<img class="(?:fit-picture|all)" src="data:image/png;base64,([^"]+)"')


@dataclass(frozen=True)
class Checked:
    """What the command would do with what is chosen."""

    problem: str = ""
    """Why it would refuse it."""
    traces: tuple[Asked, ...] = ()
    recording: Recording | None = None
    """The first trace."""
    read_as: str = ""

    @property
    def copied(self) -> list[str]:
        """Columns of a table of traces that set nothing: groups, dishes, ..."""
        return [*dict.fromkeys(name for own in self.traces for name in own.copied if name)]


@dataclass
class Window:
    """Files and choices of one window; all of it is in its folder, and goes with that."""

    folder: Path
    """Folder of the files; what the command writes is in others beside it."""
    names: list[str] = field(default_factory=list)
    chosen: dict[str, str] = field(default_factory=lambda: dict.fromkeys(CHOICES, ""))
    work: subprocess.Popen[bytes] | None = None
    """The command, while it runs and when it has ended."""
    out: Path = Path()
    started: float = 0.0
    compared: str = ""
    """What the comparison of groups says."""
    lock: Lock = field(default_factory=Lock)
    _checked: tuple[Any, Checked] = (None, Checked())

    def add(self, name: str, content: IO[bytes]) -> None:
        """Keep a file under a name of letters, digits and few marks, in no other folder."""
        plain = _UNSAFE.sub("_", re.split(r"[/\\]", name)[-1])[-_LONGEST_NAME:] or "_"
        if len({*self.names, plain}) > MOST_FILES:
            raise BiogripError(f"found more than {MOST_FILES} files; allowed are fewer.")
        (self.folder / plain).write_bytes(content.read())
        self.names = [*dict.fromkeys([*self.names, plain])]

    def choose_likely(self) -> None:
        """Choose what names and units of the columns tell."""
        preview = self.preview()
        table = preview.table
        self.chosen |= likely_choices(table.names, table.units, preview.numbers)

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

    @property
    def command(self) -> str:
        """What gives the same in a terminal."""
        return join(["biogrip", *self.typed, "--report", "page.html", "--csv", "table.csv"])

    def preview(self) -> Preview:
        """Return how the first trace looks, in the block that is chosen."""
        names = [name for name in self.names if not name.endswith(_CONFIGS)]
        path = self.folder / next((own for own in names if own not in self.inputs), names[0])
        return previewed(path, path.stat().st_mtime_ns, self.chosen["block"])

    def checked(self) -> Checked:
        """Return what the command would do; of the same choices it is found once."""
        times = [(name, (self.folder / name).stat().st_mtime_ns) for name in self.names]
        if self._checked[0] != (times, self.chosen):
            self._checked = (times, {**self.chosen}), self._check()
        return self._checked[1]

    def _check(self) -> Checked:
        traces: list[Asked] = []
        try:
            traces += self._traces()
            check_settings(traces[:_CHECKED])
            recording, _ = read_trace(traces[0])
        except BiogripError as error:
            return Checked(self.shown(error), tuple(traces))
        said = [form_in_words(Path(traces[0].trace.name), recording.form), *recording.remarks()]
        return Checked("", tuple(traces), recording, "\n".join(said))

    def _traces(self) -> list[Asked]:
        """Return what is asked; a `BiogripError` says what the window does not do."""
        given = options_of(self.typed)
        config = given.pop("config", None)
        if more := {*given} - {"files", "settings", "command"}:
            text = "is not for more options: the window writes what you can download."
            raise BiogripError(f"--{min(more)}: {text}")
        if config is not None and str(config) not in self.names:
            raise BiogripError("--config: drop the file; its name alone is allowed.")
        files, config = (
            [self.folder / name for name in self.inputs],
            config and self.folder / config,
        )
        traces = traces_of(files, config, given["settings"])
        for own in traces:
            if own.trace.resolve().parent != self.folder:
                found = f"found '{visible(own.trace)}', which is not among the dropped files"
                raise BiogripError(f"{own.place}: {found}; allowed are their names.")
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
        traces = self.checked().traces
        return len(traces) > 1 or any(own.place != Asked.place for own in traces)

    def start(self) -> None:
        """Start the command in a process of its own, in place of what ran before."""
        self.stop()
        self._traces()
        self.started, self.compared = time.time(), ""
        self.out = self.folder.with_name(f"{self.folder.name} {time.monotonic_ns()}")
        self.out.mkdir()
        outputs = ["--report", str(self.out / "page.html"), "--csv", str(self.out / "table.csv")]
        outputs += [] if self.of_table else ["--output", str(self.out / "result.json")]
        command = [sys.executable, "-m", "biogrip", *self.typed, *outputs]
        with (self.out / "said").open("wb") as said:
            self.work = subprocess.Popen(command, cwd=self.folder, stdout=said, stderr=said)
        limit = Timer(LONGEST_S, self.work.send_signal, [signal.SIGINT])
        limit.daemon = True
        limit.start()

    def stop(self) -> None:
        """Stop the command as its user would in a terminal, and wait for its end."""
        if self.work is not None and self.runs:
            self.work.send_signal(signal.SIGINT)
            self.work.wait()

    def said(self) -> str:
        """Return what the command has printed, but for the files that it has written."""
        said = (self.out / "said").read_text("utf-8")
        return self.shown(re.sub(r"(?m)^Written to .*$", "", said).strip())

    def compare(self) -> None:
        """Compare groups of the traces, by columns of their table."""
        by = [f"--{name}={self.chosen[name]}" for name in ("by", "unit") if self.chosen[name]]
        typed = ["groups", "table.csv", *by]
        typed += ["--csv", "groups.csv", "--plot", "groups.png"]
        command = [sys.executable, "-m", "biogrip", *typed]
        ended = subprocess.run(command, cwd=self.out, capture_output=True, text=True, timeout=60)
        self.compared = f"{join(['biogrip', *typed])}\n\n{ended.stderr}{ended.stdout}"

    def done(self) -> list[tuple[str, Mapping[str, str]]]:
        """Return what is known of each of several traces: nothing while it waits."""
        rows: list[tuple[str, Mapping[str, str]]] = []
        for own in self.checked().traces:
            data: dict[str, Any] = {"fit": "", "quantities": []}
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
