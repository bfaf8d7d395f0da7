from pathlib import Path
from typing import Any

import pytest
import yaml

from biogrip.errors import BiogripError
from biogrip.stages import target

CONFIG = yaml.safe_load((Path(__file__).parents[1] / "config" / "config.yaml").read_text())


def settings(torque_Nm: float) -> dict[str, Any]:
    keys = ("arm_length_m", "reference_angle_deg", "left", "right")
    return {
        "gripper": {key: CONFIG["gripper"][key] for key in keys},
        "protocol": {"phases": [{"duration_s": 100.0, "torque_Nm": torque_Nm}]},
        "sampling": {"rate_Hz": 1.0},
        "model": "maxwell",
        "parameters": {"k": 1.0, "c": 1.0},
        "nonlinear": False,
        "stroke_rad": 0.0785,
    }


def test_arms_cannot_turn_further_than_their_combs(tmp_path: Path) -> None:
    with pytest.raises(
        BiogripError, match=r"turns the arms by 90.\d+ mrad, allowed is .* 78.5 mrad"
    ):
        target.run(settings(4e-8), tmp_path / "t.csv")
    assert not list(tmp_path.iterdir())
    target.run(settings(3e-8), tmp_path / "t.csv")
    assert len((tmp_path / "t.csv").read_text().splitlines()) == 102
