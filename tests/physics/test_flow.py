"""A drift beside the flow of a damper, as the torque has them."""

import numpy as np

from biogrip.physics.drift import drift_is_flow
from biogrip.physics.protocol import hold, torque_history

TIMES = np.linspace(0.0, 100.0, 201)


def test_under_a_constant_torque_a_drift_is_flow() -> None:
    assert drift_is_flow(torque_history((hold(100.0, 1e-9),)), TIMES)


def test_where_the_torque_changes_it_is_not() -> None:
    torque = torque_history((hold(50.0, 1e-9), hold(50.0, 0.2e-9)))
    assert not drift_is_flow(torque, TIMES)
    assert drift_is_flow(torque, TIMES[:100])
