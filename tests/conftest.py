import gc
import os

# Workers share the cores; BLAS reads this once, while numpy is imported.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# Else every job that a test starts would compile all the source code for itself.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser

from biogrip.physics.gripper import Arm, Gripper
from biogrip.physics.protocol import Course, Phase, hold, join_phases
from tests.helpers.browser import Opened, chromium, executable
from tests.helpers.identified import FEW
from tests.helpers.required import cannot_run
from tests.helpers.runs import built_once, run_tiny


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--pin", action="store_true", help="draw the pinned pictures of figures anew")


@pytest.fixture(scope="session")
def pinning(request: pytest.FixtureRequest) -> bool:
    """Whether pinned pictures are drawn anew instead of compared."""
    return bool(request.config.getoption("--pin"))


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
    if executable() is None:
        cannot_run("BIOGRIP_REQUIRE_CHROMIUM", "Chromium is missing: apt-get install chromium")
    with chromium() as started:
        yield started


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
    """The default study's gripper."""
    arm = Arm(1.0e-14, 3.3e-12, 4.4e-7)
    return Gripper(1.5e-3, 75.0, arm, arm)


@pytest.fixture(scope="session")
def unequal_gripper() -> Gripper:
    return Gripper(1.5e-3, 75.0, Arm(1.0e-14, 3.3e-12, 4.4e-7), Arm(1.3e-14, 2.5e-12, 5.5e-7))


@pytest.fixture(scope="session")
def phases() -> tuple[Phase, ...]:
    """The paper's protocol, Figure 3."""
    return (hold(200.0, 1.6e-9), hold(200.0, 0.32e-9))


@pytest.fixture(scope="session")
def steps(phases: tuple[Phase, ...]) -> Course:
    return join_phases(phases)


@pytest.fixture(scope="session")
def few(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A config with few starts, and few models to compare: leave it as it is."""
    (config := tmp_path_factory.mktemp("few") / "few.yaml").write_text(FEW)
    return config


@pytest.fixture(scope="session")
def tiny(tmp_path_factory: pytest.TempPathFactory, worker_id: str) -> Path:
    """Folder of a small study that Snakemake has run, one for all workers: leave it as it is."""
    return built_once("tiny", run_tiny, tmp_path_factory, worker_id)
