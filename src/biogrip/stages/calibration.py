"""Stage 0: the gripper's arms from a test without sample, for identifications that rely on it."""

from pathlib import Path
from typing import Any

from biogrip.calibrated_gripper import calibration_yaml
from biogrip.calibration import FreeMotion, calibrate, free_motion
from biogrip.files import write_text
from biogrip.measurement import Noise, add_noise
from biogrip.parquet import table_of, write_tables
from biogrip.protocol import sample_times
from biogrip.random_streams import stream
from biogrip.study import build


def run(settings: dict[str, Any], output: Path, traces: Path) -> None:
    """Record both arms' free motion with noise, and identify them from it.

    Parameters
    ----------
    settings
        ``study_seed``, ``case``, ``gripper`` (the true one), ``calibration``.
    output
        The calibrated gripper, YAML.
    traces
        The records, Parquet.
    """
    block = settings["calibration"]
    gripper = build.gripper(settings["gripper"])
    time_s = sample_times(block["duration_s"], block["rate_Hz"])
    noise = Noise("gaussian", block["noise_level"], "peak")
    causes = block["step_torque_Nm"], block["impulse_Nms"]
    columns, found = {"time_s": time_s}, {}
    for name in ("left", "right"):
        motion = free_motion(getattr(gripper, name), time_s, *causes)
        rng = stream(settings["study_seed"], settings["case"], 0, f"calibration {name}")
        record = FreeMotion(
            time_s,
            add_noise(motion.step_rad, noise, rng),
            add_noise(motion.impulse_rad, noise, rng),
        )
        columns |= {f"{name}_step_rad": record.step_rad, f"{name}_impulse_rad": record.impulse_rad}
        found[name] = calibrate(record, *causes)
    write_tables(traces, [table_of(columns, len(time_s))], dictionary=False)
    write_text(output, calibration_yaml(found["left"], found["right"]))
