"""What is simulated of a case: its response, noisy traces of it, and a test without sample.

A target is the response without noise: what the instrument reads and, of the gripper, the force of
the jaws. A measurement adds noise to it, a trace a seed; of a recorded trace it is what was read of
the user's file. A calibration identifies the gripper's arms by a test without sample.
"""

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np

from biogrip.arrays import Array
from biogrip.errors import BiogripError
from biogrip.files import write_text
from biogrip.physics.noise import Noise, add_noise, standard_deviation, stream
from biogrip.physics.protocol import evaluate, sample_times
from biogrip.physics.response import simulated_response
from biogrip.terminal import warn
from biogrip.traces.columns import place
from biogrip_study.config.study import Case
from biogrip_study.gripper.calibration import calibrate, calibration_yaml, free_motion
from biogrip_study.gripper.nonlinear import jaw_force, nonlinear_rotation, target_grip
from biogrip_study.gripper.unilateral import unilateral_response
from biogrip_study.records.traces import (
    Measurements,
    measurements_of,
    read_target,
    write_measurements,
    write_target,
)


def simulate_target(case: Case, target: Path) -> None:
    """Simulate a case, and write its target, CSV.

    A response that is not finite, or turns the arms beyond the combs' stroke, is an error.
    """
    time_s = case.times_s
    read, force = response(case, time_s)
    if not np.all(np.isfinite(read)):
        text = f"the simulated {case.instrument.read.name} is not finite; allowed are parameters, "
        raise BiogripError(f"{text}a gripper and a protocol for which it is.")
    if case.instrument.has_jaws:
        largest = float(np.max(np.abs(read)))
        if largest > case.stroke:
            raise BiogripError(
                f"the protocol turns the arms by {1e3 * largest:.4g} mrad, allowed is what the "
                f"comb drive's stroke leaves, {1e3 * case.stroke:.4g} mrad."
            )
        _warn_if_contact_is_lost(case)
    write_target(target, case.instrument, time_s, evaluate(case.torque, time_s), read, force)


def response(case: Case, time_s: Array) -> tuple[Array, Array | None]:
    """Return what is read and, if there are jaws, their force, (n_samples,) each."""
    device, nonlinear = (case.gripper, case.network, case.torque), case.nonlinear_target
    if case.block.contact == "unilateral":
        apart = unilateral_response(*device, time_s)
        return apart.rotation[0], apart.jaw_force_N
    simulate = nonlinear_rotation if nonlinear else simulated_response
    read = simulate(*device, time_s)[0]
    if not case.instrument.has_jaws:
        return read, None
    return read, jaw_force(*device, time_s, nonlinear=nonlinear)[0]


def noise_of_readings(case: Case, time_s: Array) -> Array:
    """Return the standard deviation of a case's noise at some times, (n_samples,) both."""
    return standard_deviation(response(case, time_s)[0], case.noise)


def _warn_if_contact_is_lost(case: Case) -> None:
    device = case.gripper, case.network, case.torque
    grip = target_grip(*device, nonlinear=case.nonlinear_target)
    if words := grip.words():
        then = "without adhesion contact is lost there (contact: unilateral simulates that)"
        if case.block.contact == "unilateral":
            then = "contact is lost there, which its identification ignores"
        warn(f"{case.name}: under this protocol {words}; {then}.")


def measure(case: Case, seeds: Iterable[int], target: Path, measurements: Path) -> None:
    """Add noise of each seed in a batch to a target, CSV, and write the traces, npz."""
    time_s, _, rotation = read_target(target, case.times_s)
    rngs = {seed: stream(case.study.config.study_seed, case.name, seed, "noise") for seed in seeds}
    traces = {seed: add_noise(rotation, case.noise, rng, time_s) for seed, rng in rngs.items()}
    write_measurements(measurements, Measurements(time_s, rotation, traces))


def calibrate_gripper(case: Case, gripper: Path) -> None:
    """Simulate both arms' free motion with noise, and identify their properties.

    Parameters
    ----------
    case
        Whose true gripper is tested as its block `calibration` says.
    gripper
        Written: the calibrated gripper, YAML.
    """
    test = case.block.calibration
    time_s = sample_times(test.duration_s, test.rate_Hz)
    noise = Noise("gaussian", test.noise_level, "peak")
    causes = test.step_torque_Nm, test.impulse_Nms
    arms, uncertainty = {}, {}
    for name in ("left", "right"):
        rng = stream(case.study.config.study_seed, case.name, 0, f"calibration {name}")
        motion = free_motion(getattr(case.gripper, name), time_s, *causes)
        measured = np.stack([add_noise(clean, noise, rng) for clean in motion])
        arms[name], uncertainty[name] = calibrate(time_s, measured, *causes)
    write_text(gripper, calibration_yaml(arms, uncertainty))


def record(case: Case, recorded: Path, measurements: Path) -> None:
    """Read, check and convert the user's file; errors name file, line and column."""
    measured = case.block.measurement
    if measured.load is not None:
        raise BiogripError(f"{place(recorded)}: measurement.load is only for biogrip identify.")
    # Imported here: a simulated trace needs neither.
    from biogrip.identify.prepare import prepare
    from biogrip.traces.reader import read_recording

    trace, _ = prepare(read_recording(recorded, measured), case.experiment)
    remarks = tuple(trace.remarks())
    for remark in remarks:
        warn(f"{place(recorded)}: {remark}")
    write_measurements(measurements, measurements_of(replace(trace, remarks_before=remarks)))
