"""Search ranges that follow from a trace."""

from pathlib import Path

import numpy as np
import pytest
import yaml

from biogrip.identify.settings import Asked, case_of
from biogrip.identify.trace_case import ranges_of, read_trace
from biogrip.physics.gripper import Arm, Gripper
from biogrip.physics.models import MODELS
from biogrip.physics.protocol import hold, torque_history
from biogrip.physics.simulation import simulated_rotation
from tests.helpers.default import STUDY
from tests.helpers.identified import by_quantity, identified, write_trace

# Creep of polystyrene, in Pa and Pa s, as of a gripper: jaws of l = b at 90 degrees whose arms have
# 0.25 % of the sample's stiffness.
K_P, C = 5.26e3, 8.7e7
LEVER_M, DURATION_S, TORQUE_NM, NOISE_RAD = 1.5e-3, 3e4, 2.7e-5, 1e-5
ARM = {
    "inertia_kgm2": 1e-14,
    "damping_Nms_per_rad": 1e-9,
    "stiffness_Nm_per_rad": 0.0025 * K_P * 2 * LEVER_M**2,
}
CONFIG = {
    "gripper": {"arm_length_m": LEVER_M, "reference_angle_deg": 90.0, "left": ARM, "right": ARM},
    "protocol": {"phases": [{"duration_s": DURATION_S, "torque_Nm": TORQUE_NM}]},
    "model_selection": {"models": []},
    "least_squares": {"candidates": 500, "starts": 8},
}


@pytest.fixture(scope="module")
def polystyrene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    gripper = Gripper(LEVER_M, 90.0, Arm(**ARM), Arm(**ARM))
    network = MODELS["generalized_maxwell"].network(np.array([1e6, K_P, C, 1e3]))
    times = np.geomspace(1.0, DURATION_S, 200)
    torque = torque_history((hold(DURATION_S, TORQUE_NM),))
    clean = simulated_rotation(gripper, network, torque, times, nonlinear=False)[0]
    noisy = clean + NOISE_RAD * np.random.default_rng(1).standard_normal(len(times))
    return write_trace(tmp_path_factory.mktemp("creep") / "polystyrene.csv", times, noisy)


def test_a_sample_beyond_the_ranges_of_the_paper_is_found(polystyrene: Path) -> None:
    found = identified(polystyrene.parent, polystyrene, config=yaml.safe_dump(CONFIG))
    assert found["fit"] == "ok"
    for name, truth in (("k_p", K_P), ("c + c_p", C + 1e3)):
        own = by_quantity(found)[name]
        assert own["verdict"] == "determined"
        assert own["low"] < truth < own["high"]


def test_a_given_range_stays(polystyrene: Path) -> None:
    given = {name: {"exponent": [-4, 5]} for name in ("c", "c_p")}
    config = polystyrene.with_name("given.yaml")
    config.write_text(yaml.safe_dump({**CONFIG, "search_range": given}))
    asked = Asked(polystyrene, config)
    ranges = read_trace(polystyrene, case_of(asked), asked.given, print).problem.ranges
    assert ranges["c"].exponent == ranges["c_p"].exponent == (-4, 5)
    assert ranges["k"].exponent != (-3, 8)


@pytest.mark.parametrize("case", ["endothelial_cell", "liquid_drop_1", "liquid_drop_2"])
def test_elements_at_the_ends_do_not_show(case: str) -> None:
    """A spring or damper beyond either end is as good as absent, or rigid: less than the noise."""
    chosen = STUDY.cases[case]
    problem, time_s = chosen.problem, chosen.sampling.over(chosen.problem.torque.end_s)

    def response(**changes: float) -> np.ndarray:
        network = problem.searched.sample({**chosen.parameters, **changes})
        known = (problem.gripper, network, problem.torque, time_s)
        return simulated_rotation(*known, nonlinear=False)[0]

    simulated = response()
    noise_rad = 0.1 * simulated.max()
    rng = np.random.default_rng(2)
    trace = simulated + noise_rad * rng.standard_normal(len(time_s))
    ranges = ranges_of(problem, time_s, trace)

    for name, genes in ranges.items():
        for end, beyond in ((genes.low, 1e-3), (genes.high, 1e3)):
            change = response(**{name: end}) - response(**{name: end * beyond})
            assert np.linalg.norm(change) < noise_rad, (name, end)
