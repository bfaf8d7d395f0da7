import numpy as np

from biogrip.experiment.sample import MODELS
from biogrip.instrument.gripper import Gripper
from biogrip.response.linear import step_response
from biogrip.response.two_modes import two_modes
from tests.helpers.responses import random_samples


def test_is_the_general_solution(gripper: Gripper) -> None:
    network = MODELS["generalized_maxwell"].network(random_samples(2000, 1))
    static, rates, weights = two_modes(gripper.left, gripper.lever_m, network)
    general = step_response(gripper, network, inertia=False)
    np.testing.assert_allclose(static, general.static[:, 0, 0], rtol=1e-14)
    np.testing.assert_allclose(rates.T, general.rates, rtol=1e-9)
    # What weighs next to nothing may be a difference of equals.
    scale = np.abs(static)[:, None]
    np.testing.assert_allclose(weights.T / scale, general.weights[:, 0, 0] / scale, atol=1e-9)
