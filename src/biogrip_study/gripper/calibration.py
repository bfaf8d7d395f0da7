"""No-load calibration: an arm's inertia, damping and stiffness from its free motion (section 2).

A calibrated gripper is written as a config block that can be laid over a study.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import numpy as np
import yaml
from pydantic import Field

from biogrip.arrays import Array
from biogrip.digits import counted
from biogrip.errors import BiogripError
from biogrip.fit.experiment import Experiment
from biogrip.keys import Block, Complaint
from biogrip.physics.gripper import ARM_KEYS, Arm, Gripper


@dataclass(frozen=True)
class CalibratedArm:
    """A calibrated arm with its standard uncertainties."""

    arm: Arm
    """Estimates."""
    uncertainty: Arm
    """Their standard uncertainties, in the same units."""


def calibration_yaml(left: CalibratedArm, right: CalibratedArm) -> str:
    """Write the calibrated arms as a config file that can be laid over a study."""
    arms = {"left": left, "right": right}
    block = {
        **{name: _rounded_arm(arm.arm, 7) for name, arm in arms.items()},
        "uncertainty": {name: _rounded_arm(arm.uncertainty, 2) for name, arm in arms.items()},
    }
    return yaml.safe_dump({"gripper": block}, sort_keys=False)


def with_calibration(experiment: Experiment, files: Sequence[Path]) -> Experiment:
    """Take the arms of the first calibration file, if any; a bad one is a `BiogripError`."""
    if not files:
        return experiment
    gripper, uncertainty = read_calibrated_arms(files[0], experiment.gripper)
    return replace(
        experiment, gripper=gripper, uncertainty={**experiment.uncertainty, **uncertainty}
    )


def read_calibrated_arms(
    path: Path, gripper: Gripper
) -> tuple[Gripper, dict[str, dict[str, float]]]:
    """Return a gripper with the arms of a calibration in place of its own.

    With it come their standard uncertainties, by arm and key. A file that is missing or is no
    calibration is a `BiogripError`.
    """
    try:
        text = path.read_text(encoding="utf-8")
        if not text.endswith("\n"):
            raise ValueError("its end is missing")
        block = yaml.safe_load(text)["gripper"]
        left, right = (_numbers_in(block[name]) for name in ("left", "right"))
        uncertainty = {name: _numbers_in(block["uncertainty"][name]) for name in ("left", "right")}
    except (OSError, yaml.YAMLError, KeyError, TypeError, ValueError) as error:
        raise BiogripError(f"{path}: cannot be read as a calibration: {error}.") from error
    return replace(gripper, left=Arm(**left), right=Arm(**right)), uncertainty


def _numbers_in(block: dict[str, float]) -> dict[str, float]:
    return {key: float(block[key]) for key in ARM_KEYS}


def _rounded_arm(arm: Arm, digits: int) -> dict[str, float]:
    return {key: float(f"{getattr(arm, key):.{digits}g}") for key in ARM_KEYS}


_FEWEST_SAMPLES_OF_RECORD, _MOST_SAMPLES_OF_RECORD = 64, 10_000_000


@dataclass(frozen=True)
class CalibrationTest(Block):
    """The test of both arms without sample."""

    step_torque_Nm: Annotated[float, Field(ge=1e-20, le=1.0)]
    """Torque step on the free arm."""
    impulse_Nms: Annotated[float, Field(ge=1e-25, le=1.0)]
    """Torque impulse on the free arm."""
    duration_s: Annotated[float, Field(ge=1e-6, le=1e9)]
    """Length of each of the two records."""
    rate_Hz: Annotated[float, Field(ge=1e-9, le=1e9)]
    """Sampling rate of the records."""
    noise_level: Annotated[float, Field(ge=0, le=10)]
    """Standard deviation of the noise as a share of each record's peak."""

    def complaints_of(self, arms: Iterable[Arm]) -> Iterator[Complaint]:
        """Find a test that samples the ringing of free arms too slowly or too briefly."""
        frequency = max(arm.natural_frequency_Hz for arm in arms)
        if self.rate_Hz < 10 * frequency:
            text = f"found {self.rate_Hz}, allowed is at least ten times the arms' natural"
            yield ("rate_Hz",), f"{text} frequency, {10 * frequency:.4g} Hz."
        most = _MOST_SAMPLES_OF_RECORD / self.rate_Hz
        if not 5 / frequency <= self.duration_s <= most:
            text = f"found {self.duration_s}, allowed is from five periods of the arms' ring, "
            yield ("duration_s",), f"{text}{5 / frequency:.3g} s, to {most:.3g} s."


@dataclass(frozen=True)
class FreeMotion:
    """Rotation of a free arm after a torque step and after a torque impulse."""

    time_s: Array
    """Time since step and impulse, (n_samples,)."""
    step: Array
    """Rotation after a step, (n_samples,)."""
    impulse: Array
    """Rotation after an impulse, (n_samples,)."""


def free_motion(arm: Arm, time_s: Array, step_Nm: float, impulse_Nms: float) -> FreeMotion:
    """Solve I phi'' + c phi' + k phi = tau for a step and an impulse, from rest.

    With p_1, p_2 the roots of I s^2 + c s + k the impulse turns the arm by
    J (e^(p_1 t) - e^(p_2 t)) / (I (p_1 - p_2)), whether they are real or complex.
    """
    inertia, damping, stiffness = (getattr(arm, key) for key in ARM_KEYS)
    middle = -damping / (2 * inertia)
    half = np.sqrt(complex(middle**2 - stiffness / inertia))
    slow = np.exp((middle + half) * time_s)
    # (1 - e^(-2 h t)) / (2 h t), which is 1 where the roots coincide.
    z = 2 * half * time_s
    apart = np.where(z == 0, 1, -np.expm1(-z) / np.where(z == 0, 1, z))
    impulse = (slow * apart).real * time_s / inertia
    cosine = 0.5 * (slow + np.exp((middle - half) * time_s)).real
    step = (1 - cosine + middle * inertia * impulse) / stiffness
    return FreeMotion(time_s, step_Nm * step, impulse_Nms * impulse)


def calibrate(record: FreeMotion, step_Nm: float, impulse_Nms: float) -> CalibratedArm:
    """Identify an arm by least squares on both records, in the logarithms of I, c and k.

    The torque step and impulse caused the motion that was measured. If the arm does not ring within
    the record, or no arm fits, it is a `BiogripError`.
    """
    # Imported here, for settings of calibrations do not need SciPy.
    from scipy.optimize import least_squares

    start = _first_guess(record, step_Nm)
    measured = np.stack((record.step, record.impulse))

    def differences(logarithms: Array) -> Array:
        motion = free_motion(Arm(*np.exp(logarithms)), record.time_s, step_Nm, impulse_Nms)
        return np.stack((motion.step, motion.impulse)) - measured

    scale, logarithms = np.ptp(measured, axis=1), np.log(start)
    # In the second fit, each record is weighted by its own noise.
    for _ in range(2):
        weights = 1 / scale[:, None]
        fit = least_squares(
            lambda x, weights=weights: (weights * differences(x)).ravel(), logarithms, method="lm"
        )
        if not fit.success or not np.all(np.isfinite(fit.x)):
            raise BiogripError("calibration: no arm fits the records; is the rate high enough?")
        logarithms = fit.x
        scale = np.maximum(differences(logarithms).std(axis=1), 1e-12 * np.ptp(measured, axis=1))
    variance = np.linalg.inv(fit.jac.T @ fit.jac) * (2 * fit.cost / (len(fit.fun) - 3))
    values = np.exp(fit.x)
    return CalibratedArm(Arm(*values), Arm(*(values * np.sqrt(np.diag(variance)))))


def _first_guess(record: FreeMotion, step_Nm: float) -> Array:
    """Estimate stiffness from the step's end, frequency from the spectrum, damping from decay."""
    if len(record.time_s) < _FEWEST_SAMPLES_OF_RECORD:
        samples = f"found {counted(len(record.time_s), 'sample')}"
        raise BiogripError(
            f"calibration: {samples}, allowed are {_FEWEST_SAMPLES_OF_RECORD} or more."
        )
    tail = len(record.time_s) // 4
    stiffness = step_Nm / np.mean(record.step[-tail:])
    if not stiffness > 0:
        raise BiogripError("calibration: the arm does not follow the torque step.")
    interval = record.time_s[1] - record.time_s[0]
    spectrum = np.abs(np.fft.rfft(record.impulse))
    peak = int(np.argmax(spectrum[1:])) + 1
    omega = 2 * np.pi * np.fft.rfftfreq(len(record.time_s), interval)[peak]
    early, late = (float(np.std(part)) for part in np.array_split(record.impulse, 8)[:2])
    decay = np.log(max(early / late, 1.01)) / (len(record.time_s) // 8 * interval)
    inertia = stiffness / omega**2
    return np.array([inertia, 2 * inertia * decay, stiffness])
