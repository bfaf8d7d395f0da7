"""The window, typed and clicked as its users do, in a browser; and what it refuses."""

import re
import shlex
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import Any
from urllib.request import Request, urlopen

import numpy as np
import pytest
from flask.testing import FlaskClient
from playwright.sync_api import Page, expect

import biogrip.app.window as window_of
from biogrip.app.choices import (
    CHOICES,
    likely_choices,
    options_typed,
    remedies_by_column,
    remedies_in,
    with_option,
)
from biogrip.app.server import _SHOWN, app_of
from biogrip.app.window import Window
from biogrip.cli import main
from biogrip.files import read_table
from biogrip.physics.models import CANDIDATES, MODELS
from biogrip.traces.tables import numbers_in, overview
from tests.helpers.browser import Opened
from tests.helpers.identified import write_trace
from tests.helpers.places import ROOT
from tests.helpers.runs import ran

DATA = ROOT / "data"
PHONE = {"width": 400, "height": 800}
TOKEN = "token"
# Fits and comparisons take seconds, more where other tests run beside them.
expect.set_options(timeout=60_000)


@contextmanager
def served() -> Iterator[tuple[str, int]]:
    """The address of the command as it is typed, and its process; what it keeps goes with it."""
    command = [sys.executable, "-m", "biogrip", "app", "--no-browser"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        assert server.stdout
        place = server.stdout.readline().strip()
        assert re.fullmatch(r"http://127\.0\.0\.1:\d+/[\w-]{32}/", place)
        kept = [*Path("/tmp").glob("biogrip.*")]
        yield place, server.pid
        server.send_signal(signal.SIGINT)
        assert server.wait(20) == 0
    assert any(not folder.exists() for folder in kept)


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    with served() as (place, _):
        yield place


@pytest.fixture
def window(visit: Callable[..., Opened], address: str) -> Page:
    page: Page = visit(address).page
    page.set_default_timeout(60_000)
    return page


def drop(page: Page, *files: Path) -> None:
    """Drop files, as from the desktop, and wait until they are read."""
    contents = [[file.name, [*file.read_bytes()]] for file in files]
    script = """all => { const data = new DataTransfer();
        for (const [name, bytes] of all) data.items.add(new File([new Uint8Array(bytes)], name));
        return data; }"""
    dropped = page.evaluate_handle(script, contents)
    page.dispatch_event("#drop", "drop", {"dataTransfer": dropped})
    for file in files:
        expect(page.locator("#files")).to_contain_text(file.name)


def choose(page: Page, chosen: Mapping[str, str]) -> None:
    for name, value in chosen.items():
        if name == "model":
            page.check(f"#model-{value}")
        elif name in ("load", "reading", "column"):
            page.select_option(f"#{name}", value)
        else:
            page.fill(f"#{name}", value)
            page.press(f"#{name}", "Tab")
    for value in chosen.values():
        expect(page.locator("#typed")).to_contain_text(value)


def identified(page: Page, folder: Path) -> list[dict[str, str]]:
    """The table that is downloaded, after it is compared with what the shown command writes."""
    page.click("button.main")
    link = page.locator("a.button", has_text="table.csv")
    link.wait_for(timeout=120_000)
    with page.expect_download() as download:
        link.click()
    download.value.save_as(folder / "downloaded.csv")
    command = shlex.split(page.inner_text("#typed"))
    assert command[:2] == ["biogrip", "identify"]
    ran(folder, *command)
    assert (folder / "downloaded.csv").read_bytes() == (folder / "table.csv").read_bytes()
    return read_table(folder / "table.csv")


def copied(folder: Path, *names: str) -> list[Path]:
    for name in names:
        (folder / name).write_bytes((DATA / name).read_bytes())
    return [folder / name for name in names]


def pipette_sheet(folder: Path) -> list[Path]:
    """Two cells of 500 and 250 Pa, before 400 Pa and 5 s in parallel, with a radius each."""
    time_s, noise = np.arange(0.5, 30, 0.5), np.random.default_rng(1)
    rows = ["file;treatment;dish;hold;shape"]
    for name, k_s, radius_um in (("ä 1.txt", 500, 3.0), ("b.txt", 250, 2.0)):
        strain = 400 / k_s + 400 / 400 * (1 - np.exp(-time_s / 5))
        length_um = 3 * 2.1 * radius_um / (2 * np.pi) * strain
        write_trace(
            folder / name,
            time_s,
            length_um + 0.005 * noise.standard_normal(len(time_s)),
            header="t [s],L [µm]",
        )
        rows.append(
            f"{name};{'treated' if k_s < 400 else 'control'};1;400 Pa;pipette {radius_um} um"
        )
    (folder / "cells.csv").write_text("\n".join(rows) + "\n")
    return [folder / name for name in ("cells.csv", "ä 1.txt", "b.txt")]


def cone(folder: Path) -> list[Path]:
    """A dwell of a cone of 35 degrees at 500 nm, after 0.1 s; 700 Pa, 800 Pa and 2 s."""
    time_s = np.arange(0, 12, 0.05)
    relaxed = 700 + 800 * np.exp(-time_s / 2)
    force_nN = 2 / np.pi * np.tan(np.radians(35)) / 0.75 * relaxed * 0.5e-6**2 * 1e9
    force_nN *= 1 + 0.002 * np.random.default_rng(2).standard_normal(len(time_s))
    depth = np.full(len(time_s), 500.0)
    write_trace(folder / "cone.csv", time_s, force_nN, depth, header="Time (s),F (nN),Depth (nm)")
    return [folder / "cone.csv"]


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("files", "chosen", "quantity", "truth"),
    [
        (pipette_sheet, {"model": "zener_kelvin"}, "k_s", 500),
        (cone, {"shape": "cone 35 deg", "model": "zener_maxwell"}, "k_p", 700),
        (
            lambda folder: copied(folder, "sweep.csv"),
            {"model": "springpot_beside_damper"},
            "k_alpha",
            600,
        ),
        (lambda folder: copied(folder, "example_trace.csv"), {}, "k_p", 5),
    ],
    ids=["pipettes", "cone", "sweep", "gripper"],
)
def test_a_daily_job_has_the_commands_numbers(
    window: Page,
    tmp_path: Path,
    files: Callable[[Path], list[Path]],
    chosen: Mapping[str, str],
    quantity: str,
    truth: float,
) -> None:
    drop(window, *files(tmp_path))
    choose(window, chosen)
    window.check("#no-compare")
    expect(window.locator("#typed")).to_contain_text("--no-compare")
    row = identified(window, tmp_path)[0]
    value, low, high = (
        next(float(cell) for name, cell in row.items() if name.startswith(f"{quantity} {what}"))
        for what in ("value", "low", "high")
    )
    assert low < value < high
    assert value == pytest.approx(truth, rel=0.03)
    assert window.frame_locator("iframe").locator("h1").inner_text().startswith("What ")
    if len(row.get("treatment", "")):
        expect(window.locator("#result tbody tr")).to_have_count(2)
        window.select_option("#by", "treatment")
        window.click("text=Compare >> nth=-1")
        expect(window.locator("#result")).to_contain_text("biogrip groups table.csv --by=treatment")
        expect(window.locator("#result figure img")).to_be_visible()


@pytest.mark.nightly
def test_what_is_missing_or_stopped_is_told_and_mended_in_place(
    window: Page, tmp_path: Path
) -> None:
    """A file that is none, a unit, a stop while it fits, a page that is loaded anew."""
    (tmp_path / "broken.csv").write_bytes(b"PK\x03\x04\x81\x00")
    drop(window, tmp_path / "broken.csv")
    expect(window.locator("[role=status] .problem")).to_contain_text("allowed is text in UTF-8")
    window.click("text=Begin anew")
    time_s = np.arange(0.5, 30, 0.1)
    strain = 5 / 500 + 5 / 400 * (1 - np.exp(-time_s / 5))
    write_trace(tmp_path / "creep.csv", 1e3 * time_s, strain, header="clock,strain")
    drop(window, tmp_path / "creep.csv")
    window.select_option("#time", "clock")
    choose(window, {"hold": "5 Pa"})
    window.click("button:text-is('ms')")
    picture = window.locator("#picture svg")
    expect(picture).to_have_attribute("data-unit", "0.001")
    picture.scroll_into_view_if_needed()
    box = picture.bounding_box()
    assert box
    window.mouse.move(box["x"] + box["width"] / 2, box["y"] + 50)
    window.mouse.down()
    window.mouse.move(box["x"] + box["width"], box["y"] + 60)
    window.mouse.up()
    expect(window.locator("#typed")).to_contain_text("--until 29.9")
    assert 10 < float(window.input_value("#from")) < 20
    expect(window.locator("#picture rect")).to_have_count(1)
    expect(window.locator("#typed")).to_contain_text("--set measurement.time_unit=ms")
    expect(window.locator("#files")).to_contain_text("clock, in ms")
    choose(window, {"model": "generalized_maxwell_2"})
    window.click("button.main")
    expect(window.locator("#result [role=status]")).to_contain_text(re.compile("for [2-9] s"))
    window.click("text=Stop >> nth=-1")
    expect(window.locator("#result [role=alert]")).to_contain_text("no file was left half-written")
    expect(window.locator("iframe")).to_have_count(0)
    shown = window.inner_text("main")
    window.reload()
    assert window.inner_text("main") == shown


def test_a_window_looks_and_tells_without_a_mouse_on_a_phone(
    visit: Callable[..., Opened], address: str, tmp_path: Path
) -> None:
    """Of two windows each has its own; what a file has is text; Axe finds nothing serious."""
    opened, other = visit(address, viewport=PHONE), visit(address)
    page, hostile = opened.page, "<img src=x onerror=alert(1)>"
    time_s = np.arange(0.5, 30, 0.5)
    file = tmp_path / "a&b <1>.csv"
    write_trace(file, time_s, 1 + time_s, header=f"time_s,length_um {hostile}")
    page.set_input_files("#upload", file)
    expect(page.locator("th", has_text=hostile)).to_be_visible()
    assert page.locator("th img").count() == 0
    expect(page.locator("[role=status] .problem")).to_contain_text("--hold: is missing")
    page.focus("#hold")
    page.keyboard.type("3 nN")
    page.keyboard.press("Tab")
    expect(page.locator("#typed")).to_contain_text("--hold '3 nN'")
    expect(page.locator("#load")).to_be_focused()
    assert "a_b _1_.csv" in page.inner_text("#typed")
    assert page.locator("#picture path").get_attribute("d").count("M") == len(time_s)  # type: ignore[union-attr]
    assert opened.barriers() == []
    assert page.evaluate("document.documentElement.scrollWidth") <= PHONE["width"]
    other.page.reload()
    assert other.page.locator("#typed").count() == 0


@pytest.fixture
def windows(tmp_path: Path) -> dict[str, Window]:
    (folder := tmp_path / "window").mkdir()
    return {"one": Window(folder)}


@pytest.fixture
def client(windows: dict[str, Window]) -> FlaskClient:
    return app_of(windows, TOKEN).test_client()


HOST, ORIGIN = "http://127.0.0.1:8123", {"Origin": "http://127.0.0.1:8123"}


@pytest.mark.parametrize(
    ("host", "path", "headers"),
    [
        ("http://127.0.0.1:8123", "/", {}),
        ("http://127.0.0.1:8123", "/other/one/", {}),
        ("http://evil.example:8123", f"/{TOKEN}/one/", {}),
        ("http://127.0.0.1:8123", f"/{TOKEN}/one/", {"Origin": "http://evil.example"}),
        ("http://127.0.0.1:8123", f"/{TOKEN}/one/", {"Origin": "null"}),
    ],
)
def test_others_are_refused(
    client: FlaskClient, host: str, path: str, headers: dict[str, str]
) -> None:
    assert client.get(path, base_url=host, headers=headers).status_code == 403
    assert client.get(f"/{TOKEN}/one/", base_url=HOST).status_code == 200
    for own, status in ((headers, 403), (ORIGIN, 200)):
        given = (path, host) if own is headers else (f"/{TOKEN}/one/", HOST)
        sent = client.post(f"{given[0]}show", base_url=given[1], headers=own)
        assert sent.status_code == status


def test_who_sends_too_much_is_refused(client: FlaskClient) -> None:
    client.application.config["MAX_CONTENT_LENGTH"] = 1000
    data = {"files": (BytesIO(b"1" * 2000), "a.csv")}
    sent = client.post(f"/{TOKEN}/one/files", base_url=HOST, headers=ORIGIN, data=data)
    assert sent.status_code == 413


@pytest.mark.nightly
def test_what_runs_ends_with_the_program() -> None:
    with served() as (place, server):
        with urlopen(place) as page:
            window = page.url
        for action, do in (("example", "the gripper"), ("start", "")):
            origin = {"Origin": place[:-34]}
            with urlopen(Request(f"{window}{action}", f"do={do}".encode(), origin)) as sent:
                assert sent.status == 200
        tasks = Path(f"/proc/{server}/task").iterdir()
        (command,) = " ".join((task / "children").read_text() for task in tasks).split()
        assert Path(f"/proc/{command}").exists()
    assert not Path(f"/proc/{command}").exists()


@pytest.mark.nightly
def test_what_a_killed_program_has_left_goes_with_the_next() -> None:
    """But not what one that runs keeps."""
    command = [sys.executable, "-m", "biogrip", "app", "--no-browser"]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as killed:
        assert killed.stdout
        assert killed.stdout.readline()
        (left,) = Path("/tmp").glob(f"biogrip.{killed.pid}.*")
        with served():
            assert left.exists()
        killed.kill()
    assert left.exists()
    with served():
        assert not left.exists()


@pytest.mark.nightly
def test_a_command_that_takes_too_long_is_stopped(
    client: FlaskClient, windows: dict[str, Window], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(window_of, "LONGEST_S", 2)
    post(client, "example", do="the gripper")
    post(client, "choose", model="generalized_maxwell_2")
    post(client, "start")
    work = windows["one"].work
    assert work
    assert work.wait(60) == 128 + signal.SIGTERM
    assert "no file was left half-written" in post(client, "show")


def test_without_its_libraries_it_says_what_brings_them(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delitem(sys.modules, "biogrip.app.server")
    monkeypatch.setitem(sys.modules, "waitress", None)
    assert main(["app"]) == 1
    assert "needs waitress: python -m pip install '.[app]'" in capsys.readouterr().err


def test_no_other_command_loads_them() -> None:
    typed = "main(['identify', 'no_such.csv', '--model', 'maxwell'])"
    code = f"import sys; from biogrip.cli import main; {typed}; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert {"biogrip.command.files"} == {*done.stdout.split()} & {
        *("biogrip.command.files", "flask", "werkzeug", "waitress", "biogrip.app")
    }


def post(client: FlaskClient, action: str, **form: Any) -> str:
    sent = client.post(f"/{TOKEN}/one/{action}", base_url=HOST, headers=ORIGIN, data=form)
    assert sent.status_code == 200
    return sent.text


def test_names_are_no_paths(
    client: FlaskClient, windows: dict[str, Window], tmp_path: Path
) -> None:
    (tmp_path / "secret.csv").write_text("time_s,strain\n1,2\n")
    names = "../up.csv", "/etc/b.csv", "..\\c.csv", ".d.csv", "-e.csv", "..", "x\ny.csv"
    for name in names:
        post(client, "files", files=(BytesIO(b"time_s,strain\n1,2\n"), name))
    kept = [*windows["one"].folder.iterdir()]
    assert {*windows["one"].names} == {path.name for path in kept}
    assert all(re.fullmatch(r"\w[\w .]*", name) for name in windows["one"].names)
    assert {path.name for path in tmp_path.iterdir()} == {"secret.csv", "window"}
    for cell in ("../secret.csv", str(tmp_path / "secret.csv")):
        page = post(client, "files", files=(BytesIO(f"file\n{cell}\n".encode()), "cells.csv"))
        assert "allowed are dropped files" in page
        assert windows["one"].traces == []
    for name in ("page.html", "..%2Fsecret.csv", "secret.csv"):
        assert client.get(f"/{TOKEN}/one/out/{name}", base_url=HOST).status_code == 404


@pytest.mark.parametrize(
    "more", ["--report /tmp/x.html", "--config ../x.yaml", "-h", "'", "--typo 1"]
)
def test_what_the_window_does_not_do_is_told(
    client: FlaskClient, windows: dict[str, Window], more: str
) -> None:
    post(client, "example", do="the gripper")
    assert windows["one"].traces
    post(client, "choose", more=more)
    assert windows["one"].problem
    assert windows["one"].traces == []
    post(client, "start")
    assert windows["one"].work is None


@pytest.mark.parametrize(
    ("message", "typed"),
    [
        ("a: use --rows 'T (C)=20'.", ["--rows", "T (C)=20"]),
        ("allowed is one, as by --block 1, or", ["--block", "1"]),
        ("as by --reading 'storage=G'\"'\"' (Pa)'.", ["--reading", "storage=G' (Pa)"]),
        ("goes with it: (--offset) or --no-drift,", ["--offset", "--no-drift"]),
        ("(by --set measurement.time_unit=UNIT); allowed are s, N m.", ["s", "N m"]),
        ("by --time and --load, or --config; --start SECONDS; --reading loss=COLUMN.", []),
    ],
)
def test_remedies_are_options_that_a_message_names(message: str, typed: list[str]) -> None:
    found = remedies_in(message)
    told = [word for pair in found for word in pair if word]
    if "=UNIT" in message:
        assert [*found.values()] == typed
        assert told[1::2] == [f"measurement.time_unit={unit}" for unit in typed]
    else:
        assert told == typed


@pytest.mark.parametrize(
    ("file", "typed"),
    [
        ("pipette.csv", "--reading displacement=length_um --time time_s"),
        ("afm.csv", "--reading force=force_nN --time time_s --load indentation_nm"),
        (
            "sweep.csv",
            '--reading "storage=G\' (Pa)" --reading "loss=G\'\' (Pa)" '
            "--frequency 'frequency (Hz)'",
        ),
        ("example_trace.csv", "--reading rotation=rotation_rad --time time_s"),
        ("measured/mucus.csv", "--reading compliance=compliance_per_Pa --time time_s"),
        ("measured/fish_muscle.csv", "--reading modulus=modulus_Pa --time time_s"),
    ],
)
def test_columns_are_chosen_by_their_names(file: str, typed: str) -> None:
    sheet, (table,) = overview(DATA / file)
    chosen = dict.fromkeys(CHOICES, "") | likely_choices(numbers_in(sheet, table))
    assert options_typed(chosen) == shlex.split(typed)


@pytest.mark.parametrize(
    ("text", "names", "blocks", "last"),
    [
        ("Zeit;Weg\ns;mm\n0,5;1,25\n1;1,5\n1,5;2\n", ["Zeit", "Weg"], 1, [1.5, 2.0]),
        ("1 2\n2 3\n3 5\n", ["1", "2"], 1, [3.0, 5.0]),
        ("# t (s) F (nN)\n1 2\n2 3\n3 5\n", ["t (s)", "F (nN)"], 1, [3.0, 5.0]),
        ("a,b\n1,2\n2,3\n\na,b\n1,7\n2,8\n3,9\n", ["a", "b"], 2, [3.0, 9.0]),
        ("t,x\n10:00:01,1\n10:00:02,NA\n10:00:03,4\n", ["t", "x"], 1, [36003.0, 4.0]),
    ],
)
def test_a_file_is_shown_before_its_columns_are_said(
    tmp_path: Path, text: str, names: list[str], blocks: int, last: list[float]
) -> None:
    (tmp_path / "a.txt").write_text(text)
    window = Window(tmp_path, names=["a.txt"])
    window.look()
    assert window.table
    assert window.sheet
    numbers = numbers_in(window.sheet, window.table)
    assert [*numbers] == [*window.points] == names
    assert [column[-1] for column in numbers.values()] == last
    assert len(window.tables) == blocks


def test_every_model_is_drawn_with_its_elements() -> None:
    assert {*MODELS} <= {*_SHOWN["models"]} <= {*CANDIDATES}
    for name in _SHOWN["models"]:
        text = _SHOWN["sketched"](CANDIDATES[name].model)
        names = [own.name for own in CANDIDATES[name].model.parameters]
        springpots = sum(own in ("alpha", "beta") for own in names)
        dampers = sum(own.startswith("c") for own in names)
        counts = text.count("/\\/\\"), text.count("[==]"), text.count("<>")
        assert counts == (len(names) - dampers - 2 * springpots, dampers, springpots)


def window_of_columns(folder: Path, header: str, **chosen: str) -> Window:
    """A window with a file of these columns, of which some things are chosen."""
    time_s = np.arange(0, 30, 0.5)
    write_trace(folder / "a.csv", *[1 + time_s] * len(header.split(",")), header=header)
    window = Window(folder, names=["a.csv"])
    window.look()
    window.chosen |= chosen
    window.check()
    return window


@pytest.mark.parametrize(
    ("header", "chosen", "typed"),
    [
        (
            "time_s,length_um",
            {"hold": "300 Pa"},
            [{"shape": "pipette 2.5 um"}],
        ),
        (
            "time_s,length_um,pressure_Pa",
            {},
            [{"shape": "pipette 2.5 um"}],
        ),
        (
            "time_s,length_um",
            {"reading": "strain", "hold": "300 Pa"},
            [
                {"shape": "cylinder 8 mm x 4 mm"},
                {"reading": "displacement", "column": "length_um"},
                {"shape": "pipette 2.5 um"},
            ],
        ),
    ],
)
def test_what_has_a_unit_of_another_kind_needs_a_shape(
    tmp_path: Path, header: str, chosen: dict[str, str], typed: list[dict[str, str]]
) -> None:
    """No button calls a length a pure number; by the buttons one after the other it can run."""
    for expected in typed:
        window = window_of_columns(tmp_path, header, **chosen)
        (remedy,) = remedies_in(window.problem)
        assert with_option(*remedy, "") == expected
        chosen |= expected
    assert window_of_columns(tmp_path, header, **chosen).problem == ""
    forced = {"shape": "", "reading": "strain", "load": "", "hold": "300 Pa"}
    forced |= {"more": "--set measurement.reading_unit=1"}
    window = window_of_columns(tmp_path, header, **{**chosen, **forced})
    assert "found the unit '1' where the name says 'um'" in window.problem


def test_each_column_without_a_unit_has_its_own(
    client: FlaskClient, windows: dict[str, Window]
) -> None:
    rows = b"time,stress\n1,2\n2,3\n3,4\n"
    post(client, "files", files=(BytesIO(rows), "a.csv"))
    page = post(client, "choose", hold="2 %")
    found = remedies_by_column(windows["one"].problem)
    assert [*found] == ["time", "stress"]
    assert [*found["time"].values()] == ["s", "ms", "us", "min", "h", "d"]
    assert [*found["stress"].values()][:3] == ["Pa", "kPa", "MPa"]
    rows_shown = re.findall(r'<p class="buttons">(\w+): .*?value="--set ([\w.]+)=', page)
    assert rows_shown == [
        ("time", "measurement.time_unit"),
        ("stress", "measurement.reading_unit"),
    ]


def test_it_asks_for_columns_first(client: FlaskClient, windows: dict[str, Window]) -> None:
    rows = b"clock,y\ns,um\n1,2\n2,3\n3,4\n4,4\n5,5\n6,5\n"
    asked = 'class="problem">Which column is the {}?'
    assert asked.format("reading") in post(client, "files", files=(BytesIO(rows), "a.csv"))
    chosen = {"reading": "displacement", "column": "y", "hold": "20 pN"}
    assert asked.format("time") in post(client, "choose", **chosen)
    post(client, "choose", time="clock")
    assert windows["one"].problem == ""


def test_a_result_of_other_choices_is_told(client: FlaskClient, windows: dict[str, Window]) -> None:
    post(client, "example", do="a pipette")
    assert ">Working on it …</span>" in post(client, "start")
    changed = post(client, "choose", hold="300 Pa")
    assert ">Settings changed: identify again.</span>" in changed
    assert "--hold &#39;400 Pa&#39;" in changed.partition("This is the result of: ")[2][:200]
    assert ' class="stale"' in changed
    assert ' class="stale"' not in post(client, "choose", hold="400 Pa")
    work = windows["one"].work
    assert work
    post(client, "stop")
    assert ">Ended early: see the result.</span>" in post(client, "show")
    file = BytesIO((DATA / "pipette.csv").read_bytes()), "pipette.csv"
    assert "the result of: files before these" in post(client, "files", files=file)


def test_the_picture_follows_the_reading_and_says_units(
    client: FlaskClient, windows: dict[str, Window]
) -> None:
    rows = "time;length;force\nmin;um;nN\n" + "".join(f"{n};{n + 1};{2 * n}\n" for n in range(9))
    page = post(client, "files", files=(BytesIO(rows.encode()), "a.csv"))
    chosen = windows["one"].chosen
    assert (chosen["across"], chosen["upward"]) == ("time", "length")
    assert windows["one"].units == {"time": "min", "length": "um", "force": "nN"}
    assert "Use nothing after (s)" in page
    assert "range of times, in s; the picture is in min." in page
    post(client, "choose", across="length")
    assert (chosen["across"], chosen["upward"]) == ("length", "length")
    post(client, "choose", reading="force", column="force", load="length")
    chosen = windows["one"].chosen
    assert (chosen["across"], chosen["upward"]) == ("time", "force")
    assert "Use nothing below (Hz)" in post(client, "example", do="a frequency sweep")


def test_what_was_held_has_its_name_and_example(client: FlaskClient) -> None:
    page = post(client, "example", do="a pipette")
    assert "What was held (pressure), with its unit" in page
    assert 'placeholder="300 Pa"' in page
    assert "What was held (force), with its unit" in post(client, "choose", shape="")
    page = post(client, "choose", reading="stress", hold="2")
    assert "What was held (strain), with its unit" in page
    assert 'placeholder="2 %"' in page
    assert "A strain of 2 is 200 %." in page
    for hold in ("2 %", "0.02"):
        assert "A strain of" not in post(client, "choose", hold=hold)


def test_a_phone_shows_numbers_whole_what_is_copied_and_the_result(
    visit: Callable[..., Opened], address: str, tmp_path: Path
) -> None:
    page = visit(address, viewport=PHONE, permissions=["clipboard-write", "clipboard-read"]).page
    time_s = np.arange(0.5, 30, 0.5)
    strain = -1.2345e-7 * (1 - 0.5 * np.exp(-time_s / 5))
    write_trace(tmp_path / "a.csv", time_s, strain, header="time_s,strain")
    page.set_input_files("#upload", tmp_path / "a.csv")
    page.fill("#hold", "300 Pa")
    page.press("#hold", "Tab")
    expect(page.locator("#typed")).to_contain_text("300 Pa")
    inside = "all => all.map(text => text.getBBox().x)"
    numbers = page.locator("#picture text", has_text="e-")
    expect(numbers).to_have_count(2)
    # The name of the axis stands left of them, within 40 of 660.
    assert min(numbers.evaluate_all(inside)) > 30
    page.click("#copy")
    expect(page.locator("#copied")).to_have_text("Copied.")
    assert page.evaluate("navigator.clipboard.readText()") == page.inner_text("#typed")
    page.click("button.main")
    expect(page.locator("#state")).to_have_text(re.compile("Working|Done"))
    expect(page.locator("#h-result")).to_be_in_viewport()
    page.fill("#hold", "200 Pa")
    page.press("#hold", "Tab")
    expect(page.locator("#state")).to_have_text("Settings changed: identify again.")
    expect(page.locator("#result.stale .problem")).to_contain_text("--hold '300 Pa'")
