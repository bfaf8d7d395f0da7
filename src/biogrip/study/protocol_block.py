"""Config block of the protocol: torques or voltages of the comb drives over time."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Annotated

from pydantic import Field

from biogrip.experiment.protocol import Harmonic, Load, Phase, load
from biogrip.instrument.actuator import CombDrive, capacitance_slope
from biogrip.keys import Block, Problem

_LONGEST_S = 1e9
_MOST_PERIODS = 10_000


@dataclass(frozen=True)
class PhaseBlock(Block):
    """A phase of the protocol: a hold, a ramp or a sinusoid, in torque or in voltage."""

    duration_s: Annotated[float, Field(ge=1e-6, le=_LONGEST_S)]
    """Duration of the phase; of all together at most 1e9 s."""
    torque_Nm: Annotated[float | None, Field(ge=0, le=1.0)] = None
    """Closing torque of both arms, held or, with to_torque_Nm, at the start of a ramp."""
    to_torque_Nm: Annotated[float | None, Field(ge=0, le=1.0)] = None
    """Torque at the end of a ramp."""
    amplitude_Nm: Annotated[float | None, Field(ge=0, le=1.0)] = None
    """Amplitude of a sinusoid on top of a held torque; needs frequency_Hz."""
    torque_right_Nm: Annotated[float | None, Field(ge=0, le=1.0)] = None
    """Held torque of the right arm, where it differs."""
    voltage_V: Annotated[float | None, Field(ge=0, le=1e4)] = None
    """Voltage on both comb drives, instead of torque_Nm. As in the paper, eq. (9) converts it to
    grip torque, counted from contact; the voltage that closes the jaws onto a sample comes on
    top."""
    to_voltage_V: Annotated[float | None, Field(ge=0, le=1e4)] = None
    """Voltage at the end of a ramp of the voltage."""
    amplitude_V: Annotated[float | None, Field(ge=0, le=1e4)] = None
    """Amplitude of a sinusoid on top of a held voltage; needs frequency_Hz."""
    voltage_right_V: Annotated[float | None, Field(ge=0, le=1e4)] = None
    """Held voltage of the right arm, where it differs."""
    frequency_Hz: Annotated[float | None, Field(ge=1e-9, le=1e9)] = None
    """Frequency of the sinusoid, which starts at its mean, rising."""

    @property
    def drives(self) -> bool:
        """True if any torque or voltage of the phase is above zero."""
        torques = self.torque_Nm, self.to_torque_Nm, self.torque_right_Nm
        return any((*torques, self.voltage_V, self.to_voltage_V, self.voltage_right_V))

    def phase(self, per_square_volt: float) -> Phase:
        """Return the phase in torques; a voltage's torque is `per_square_volt` V^2 (eq. 9)."""
        if self.voltage_V is not None:
            left = self._load(self.voltage_V, self.to_voltage_V, self.amplitude_V)
            loads = left, _at(left, self.voltage_right_V)
            return Phase(self.duration_s, *(_squared(load, per_square_volt) for load in loads))
        assert self.torque_Nm is not None
        left = self._load(self.torque_Nm, self.to_torque_Nm, self.amplitude_Nm)
        return Phase(self.duration_s, left, _at(left, self.torque_right_Nm))

    def _load(self, value: float, to: float | None, amplitude: float | None) -> Load:
        return load(self.duration_s, value, to, amplitude, self.frequency_Hz)

    def problems(self) -> Iterator[Problem]:
        """Find keys that are in conflict."""
        given = {name: value for name, value in vars(self).items() if value is not None}
        bases = [key for key in ("torque_Nm", "voltage_V") if key in given]
        if len(bases) != 1:
            found = " and ".join(bases) or "neither"
            yield (), f"found {found}, allowed is one of torque_Nm and voltage_V."
            return
        by = bases[0]
        quantity, unit = by.split("_")
        swing, right, ramp = f"amplitude_{unit}", f"{quantity}_right_{unit}", f"to_{by}"
        for key in given:
            if key not in ("duration_s", by, right, ramp, swing, "frequency_Hz"):
                yield (key,), f"does not go with {by}."
        if (swing in given) != ("frequency_Hz" in given):
            yield (), f"has one of {swing} and frequency_Hz; allowed are both or neither."
        if right in given and ramp in given:
            yield (right,), "does not go with a ramp; allowed is a held torque."
        if given.get("frequency_Hz", 0) * self.duration_s > _MOST_PERIODS:
            text = f"found {self.frequency_Hz}, allowed are at most {_MOST_PERIODS} periods"
            yield ("frequency_Hz",), f"{text} in a phase."
        if swing in given and ramp in given:
            yield (), "has a ramp and a sinusoid; allowed is one of them in a phase."
        if given.get(swing, 0) > min(given[by], given.get(right, given[by])):
            text = f"found {given[swing]}, allowed is at most {by}: comb drives only pull."
            yield (swing,), text


@dataclass(frozen=True)
class ProtocolBlock(Block):
    """Torques or voltages of the comb drives over time (Figure 3)."""

    phases: Annotated[tuple[PhaseBlock, ...], Field(min_length=1, max_length=1000)]
    """Phases that follow one another from t = 0; the experiment ends with the last."""

    @property
    def end_s(self) -> float:
        """Duration of the protocol."""
        return sum(phase.duration_s for phase in self.phases)

    def torques(self, comb: CombDrive) -> tuple[Phase, ...]:
        """Return all phases in torques, converting voltages (eq. 9)."""
        per_square_volt = 0.5 * capacitance_slope(comb)
        return tuple(phase.phase(per_square_volt) for phase in self.phases)

    def problems(self) -> Iterator[Problem]:
        """Refuse a protocol that is too long, or in which all torques are zero."""
        if self.end_s > _LONGEST_S:
            text = f"found {self.end_s:g} s in all phases together, allowed is at most "
            yield ("phases",), f"{text}{_LONGEST_S:g} s."
        if not any(phase.drives for phase in self.phases):
            text = "no phase has a torque, so nothing would move; allowed is at least one above"
            yield ("phases",), f"{text} 0 N m."


def _at(load: Load, value: float | None) -> Load:
    return load if value is None else replace(load, value_Nm=value)


def _squared(volts: Load, per_square_volt: float) -> Load:
    """Return the torque of a voltage V + r t or V + A sin(omega t): tau = kappa V^2.

    The squared sinusoid is V^2 + A^2/2 + 2 V A sin(omega t) - A^2/2 cos(2 omega t).
    """
    kappa, value = per_square_volt, volts.value_Nm
    mean = value**2
    harmonics: list[Harmonic] = []
    for h in volts.harmonics:
        a, omega = h.amplitude_Nm, h.omega_rad_per_s
        mean += a**2 / 2
        harmonics.append(Harmonic(2 * kappa * value * a, omega, h.phase_rad))
        harmonics.append(Harmonic(kappa * a**2 / 2, 2 * omega, math.pi))
    return Load(
        kappa * mean,
        2 * kappa * value * volts.slope_Nm_per_s,
        2 * kappa * volts.slope_Nm_per_s**2,
        tuple(harmonics),
    )
