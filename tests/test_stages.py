from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from biogrip.arrays import Array
from biogrip.errors import BiogripError
from biogrip.stages import joined, target

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


def test_what_is_left_from_a_larger_study_is_not_joined(tmp_path: Path) -> None:
    """Methods may have batches that end at different seeds; their files then have as many rows."""
    batches = [tmp_path / name for name in ("a.csv", "b.csv", "c.csv")]
    for batch, method, seeds in zip(batches, "xxy", ((0, 1), (2, 3), (0, 1, 2)), strict=True):
        lines = [f"drop,{method},{seed},0.5" for seed in seeds]
        batch.write_text("\n".join(["case,method,seed,cpu_s", *lines, ""]))
    joined.run({"seeds": 3}, batches, tmp_path / "all.csv")
    rows = (tmp_path / "all.csv").read_text().splitlines()
    wanted = [f"drop,{method},{seed},0.5" for method in "xy" for seed in range(3)]
    assert rows == ["case,method,seed,cpu_s", *wanted]
    batches[1].write_text("case,method,seed\n")
    with pytest.raises(BiogripError, match=r"b.csv, line 1: found case,method,seed; wanted"):
        joined.run({"seeds": 3}, batches, tmp_path / "all.csv")


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_target_that_is_not_finite_is_refused_where_it_arises(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, value: float
) -> None:
    def odd(*_: object, **__: object) -> Array:
        return np.where(np.arange(101) < 7, 1e-5, value)[None]

    monkeypatch.setattr(target, "simulated_rotation", odd)
    with pytest.raises(BiogripError) as error:
        target.run(settings(1e-9), tmp_path / "t.csv")
    said = str(error.value)
    assert f"the simulated rotation of Maxwell liquid with k = 1, c = 1 is {value} at 7 s" in said
    assert not list(tmp_path.iterdir())
