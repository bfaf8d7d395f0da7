"""Stage 0: calibration of the gripper's arms by a test without sample."""

from pathlib import Path

from biogrip.experiment.noise import Noise, add_noise
from biogrip.experiment.protocol import sample_times
from biogrip.experiment.random_streams import stream
from biogrip.files import write_text
from biogrip.instrument.calibrated_gripper import calibration_yaml
from biogrip.instrument.calibration import FreeMotion, calibrate, free_motion
from biogrip.records.parquet import table_of, write_tables
from biogrip.study.study import Case


def run(case: Case, gripper: Path, records: Path) -> None:
    """Simulate both arms' free motion with noise, and identify their properties."""
    test = case.calibration
    time_s = sample_times(test.duration_s, test.rate_Hz)
    noise = Noise("gaussian", test.noise_level, "peak")
    causes = test.step_torque_Nm, test.impulse_Nms
    columns, found = {"time_s": time_s}, {}
    for name in ("left", "right"):
        motion = free_motion(getattr(case.gripper, name), time_s, *causes)
        rng = stream(case.study.study_seed, case.name, 0, f"calibration {name}")
        record = FreeMotion(
            time_s,
            add_noise(motion.step_rad, noise, rng),
            add_noise(motion.impulse_rad, noise, rng),
        )
        columns |= {f"{name}_step_rad": record.step_rad, f"{name}_impulse_rad": record.impulse_rad}
        found[name] = calibrate(record, *causes)
    write_tables(records, [table_of(columns, len(time_s))], dictionary=False)
    write_text(gripper, calibration_yaml(found["left"], found["right"]))
