import os

# Workers share the cores; BLAS reads this once, while numpy is imported.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import pytest

from biogrip.experiment.protocol import Phase, TorqueHistory, held, torque_history
from biogrip.instrument.gripper import Arm, Gripper


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with the test that mostly waits, for Slurm: the others run beside it."""
    items.sort(key=lambda item: item.path.name != "test_slurm.py")


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
    return (held(200.0, 1.6e-9), held(200.0, 0.32e-9))


@pytest.fixture(scope="session")
def steps(phases: tuple[Phase, ...]) -> TorqueHistory:
    return torque_history(phases)
