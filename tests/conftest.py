import fcntl
import gc
import os
import shutil

# Workers share the cores; BLAS reads this once, while numpy is imported.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# Else every job that a test starts would compile all the source code for itself.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, sync_playwright

from biogrip.physics.gripper import Arm, Gripper
from biogrip.physics.protocol import Course, join_phases
from tests.helpers.browser import Opened
from tests.helpers.default import STUDY
from tests.helpers.identified import FEW
from tests.helpers.places import EXAMPLE
from tests.helpers.required import cannot_run
from tests.helpers.runs import TINY, snakemake


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--pin", action="store_true", help="draw the pinned pictures of figures anew")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with the test that mostly waits, for Slurm, and with the study that many need.

    One worker runs that study; what needs it comes last, so that no other waits for it.
    """
    items.sort(key=lambda item: (item.path.name != "test_slurm.py", _needs_tiny(item)))
    if first := next((item for item in items if _needs_tiny(item)), None):
        items.remove(first)
        items.insert(0, first)


def _needs_tiny(item: pytest.Item) -> bool:
    return "tiny" in getattr(item, "fixturenames", ())


def pytest_collection_finish() -> None:
    """Leave what is loaded out of every later search for cycles, a twelfth of the time else."""
    gc.collect()
    gc.freeze()


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    """Debian's Chromium, driven by Playwright."""
    executable = shutil.which("chromium") or shutil.which("chromium-browser")
    if executable is None:
        cannot_run("BIOGRIP_REQUIRE_CHROMIUM", "Chromium is missing: apt-get install chromium")
    with sync_playwright() as driver:
        # A sandbox of its own is not to be had in every container; the pages are ours.
        started = driver.chromium.launch(executable_path=executable, args=["--no-sandbox"])
        yield started
        started.close()


@pytest.fixture
def visit(browser: Browser) -> Iterator[Callable[..., Opened]]:
    """Opens pages, which must have no problems, and closes them."""
    pages: list[Opened] = []

    def opened(*given: Any, **context: Any) -> Opened:
        pages.append(Opened(browser, *given, **context))
        return pages[-1]

    yield opened
    for page in pages:
        page.close()


@pytest.fixture(scope="session")
def gripper() -> Gripper:
    return STUDY.gripper


@pytest.fixture(scope="session")
def unequal_gripper() -> Gripper:
    return Gripper(1.5e-3, 75.0, Arm(1.0e-14, 3.3e-12, 4.4e-7), Arm(1.3e-14, 2.5e-12, 5.5e-7))


@pytest.fixture(scope="session")
def steps() -> Course:
    """The paper's protocol, Figure 3."""
    return join_phases(STUDY.phases)


@pytest.fixture(scope="session")
def few(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A config with few starts, and few models to compare: leave it as it is."""
    (config := tmp_path_factory.mktemp("few") / "few.yaml").write_text(FEW)
    return config


@pytest.fixture(scope="session")
def tiny(tmp_path_factory: pytest.TempPathFactory, worker_id: str) -> Path:
    """Folder of a small study that Snakemake has run, one for all workers: leave it as it is."""
    own = tmp_path_factory.getbasetemp()
    folder = (own if worker_id == "master" else own.parent) / "tiny"
    with folder.with_suffix(".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not folder.exists():
            building = tmp_path_factory.mktemp("building")
            header, *rows = EXAMPLE.read_text().splitlines(keepends=True)
            (building / "mine.csv").write_text("".join([header, *rows[::8]]))
            snakemake(building, config=TINY)
            building.rename(folder)
    return folder


@pytest.fixture
def tiny_copy(tiny: Path, tmp_path: Path) -> Path:
    """The tiny study to be changed, file times kept."""
    return shutil.copytree(tiny, tmp_path / "study")
