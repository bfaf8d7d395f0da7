import pytest

from biogrip.physics.gripper import Gripper


@pytest.fixture(params=["equal arms", "unequal arms"])
def either_gripper(
    request: pytest.FixtureRequest, gripper: Gripper, unequal_gripper: Gripper
) -> Gripper:
    return gripper if request.param == "equal arms" else unequal_gripper
