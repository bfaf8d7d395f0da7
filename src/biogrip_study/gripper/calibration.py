"""No-load calibration: an arm's inertia, damping and stiffness from its free motion (section 2).

A calibrated gripper is written as a config block that can be laid over a study.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import numpy as np
import yaml
from pydantic import Field

from biogrip.arrays import Array
from biogrip.errors import BiogripError
from biogrip.fit.experiment import Experiment
from biogrip.keys import Block, Complaint
from biogrip.physics.gripper import ARM_KEYS, Arm


def calibration_yaml(arms: Mapping[str, Arm], uncertainty: Mapping[str, Arm]) -> str:
    """Write calibrated arms as a config file that can be laid over a study.

    Parameters
    ----------
    arms, uncertainty
        Estimates of the ``left`` and the ``right`` arm, and their standard uncertainties, SI units.
    """
    block = {
        **{name: _rounded_arm(arm, 7) for name, arm in arms.items()},
        "uncertainty": {name: _rounded_arm(arm, 2) for name, arm in uncertainty.items()},
    }
    return yaml.safe_dump({"gripper": block}, sort_keys=False)


def _rounded_arm(arm: Arm, digits: int) -> dict[str, float]:
    return {key: float(f"{getattr(arm, key):.{digits}g}") for key in ARM_KEYS}


def with_calibration(experiment: Experiment, file: Path) -> Experiment:
    """Take the arms and their standard uncertainties from a calibration file.

    A file that is missing or is no calibration is a `BiogripError`.
    """
    try:
        text = file.read_text(encoding="utf-8")
        if not text.endswith("\n"):
            raise ValueError("its end is missing")
        block = yaml.safe_load(text)["gripper"]
        left, right = (Arm(**_numbers_in(block[name])) for name in ("left", "right"))
        uncertainty = {name: _numbers_in(block["uncertainty"][name]) for name in ("left", "right")}
    except (OSError, yaml.YAMLError, KeyError, TypeError, ValueError) as error:
        raise BiogripError(f"{file}: cannot be read as a calibration: {error}.") from error
    calibrated = replace(experiment.gripper, left=left, right=right)
    return replace(
        experiment, gripper=calibrated, uncertainty={**experiment.uncertainty, **uncertainty}
    )


def _numbers_in(block: dict[str, float]) -> dict[str, float]:
    return {key: float(block[key]) for key in ARM_KEYS}


_MOST_SAMPLES_OF_RECORD = 10_000_000


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


def free_motion(arm: Arm, time_s: Array, step_Nm: float, impulse_Nms: float) -> Array:
    """Solve I phi'' + c phi' + k phi = tau for a step and an impulse, from rest.

    With p_1, p_2 the roots of I s^2 + c s + k the impulse turns the arm by
    J (e^(p_1 t) - e^(p_2 t)) / (I (p_1 - p_2)), whether they are real or complex.

    Parameters
    ----------
    arm
        The free arm.
    time_s
        Time since step and impulse, (n_samples,).
    step_Nm, impulse_Nms
        Height of the torque step in N m, and the torque impulse in N m s.

    Returns
    -------
    Array
        Rotation in rad after the step and after the impulse, (2, n_samples).
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
    return np.stack((step_Nm * step, impulse_Nms * impulse))


def calibrate(
    time_s: Array, measured: Array, step_Nm: float, impulse_Nms: float
) -> tuple[Arm, Arm]:
    """Identify an arm by least squares on both records, in the logarithms of I, c and k.

    Parameters
    ----------
    time_s, measured
        Times, (n_samples,), and what was measured of `free_motion`, (2, n_samples).
    step_Nm, impulse_Nms
        Torque step in N m and impulse in N m s that caused it.

    Returns
    -------
    tuple[Arm, Arm]
        Estimates and their standard uncertainties.

    Raises
    ------
    BiogripError
        If the arm does not follow the step, or no arm fits.
    """
    # Imported here, for settings of calibrations do not need SciPy.
    from scipy.optimize import least_squares

    def differences(logarithms: Array) -> Array:
        return free_motion(Arm(*np.exp(logarithms)), time_s, step_Nm, impulse_Nms) - measured

    logarithms, scale = np.log(_first_guess(time_s, measured, step_Nm)), np.ptp(measured, axis=1)
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
    values = np.exp(logarithms)
    return Arm(*values), Arm(*(values * np.sqrt(np.diag(variance))))


def _first_guess(time_s: Array, measured: Array, step_Nm: float) -> Array:
    """Estimate stiffness from the step's end, frequency from the spectrum, damping from decay."""
    step, impulse = measured
    stiffness = step_Nm / np.mean(step[-(len(time_s) // 4) :])
    if not stiffness > 0:
        raise BiogripError("calibration: the arm does not follow the torque step.")
    interval = time_s[1] - time_s[0]
    peak = int(np.argmax(np.abs(np.fft.rfft(impulse))[1:])) + 1
    omega = 2 * np.pi * np.fft.rfftfreq(len(time_s), interval)[peak]
    early, late = (float(np.std(part)) for part in np.array_split(impulse, 8)[:2])
    decay = np.log(max(early / late, 1.01)) / (len(time_s) // 8 * interval)
    inertia = stiffness / omega**2
    return np.array([inertia, 2 * inertia * decay, stiffness])
