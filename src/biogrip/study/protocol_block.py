"""Config block of the protocol: what is held over time, as torques or voltages of comb drives."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Annotated

from pydantic import Field

from biogrip.experiment.protocol import Phase, largest_load, load
from biogrip.instrument.actuator import CombDrive, capacitance_slope
from biogrip.instrument.instrument import Instrument
from biogrip.instrument.instruments import CONTROLLED
from biogrip.keys import Block, Problem

_LONGEST_S = 1e9
_VOLTAGE = "voltage_V"
_BASES = (CONTROLLED[0].column, _VOLTAGE, *(each.column for each in CONTROLLED[1:]))
# What a comb drive pulls with.
_PULLS = _BASES[:2]
# A load or a deformation, either way.
_Signed = Annotated[float | None, Field(ge=-1e12, le=1e12)]


@dataclass(frozen=True)
class PhaseBlock(Block):
    """A phase of the protocol: a hold, a ramp or a sinusoid, of one quantity in all phases."""

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
    force_N: _Signed = None
    """Force on the sample, instead of torque_Nm, where the instrument is `creep`; so is stress_Pa.
    Where it is `relaxation`, displacement_m or strain."""
    to_force_N: _Signed = None
    """Force at the end of a ramp."""
    amplitude_N: _Signed = None
    """Amplitude of a sinusoid on top of a held force."""
    stress_Pa: _Signed = None
    """Stress on the sample."""
    to_stress_Pa: _Signed = None
    """Stress at the end of a ramp."""
    amplitude_Pa: _Signed = None
    """Amplitude of a sinusoid on top of a held stress."""
    displacement_m: _Signed = None
    """Displacement of the sample."""
    to_displacement_m: _Signed = None
    """Displacement at the end of a ramp, as the ramp of loading."""
    amplitude_m: _Signed = None
    """Amplitude of a sinusoid on top of a held displacement."""
    strain: _Signed = None
    """Strain of the sample."""
    to_strain: _Signed = None
    """Strain at the end of a ramp, as the ramp of loading."""
    amplitude_strain: _Signed = None
    """Amplitude of a sinusoid on top of a held strain."""
    frequency_Hz: Annotated[float | None, Field(ge=1e-9, le=1e9)] = None
    """Frequency of the sinusoid, which starts at its mean, rising."""

    @property
    def bases(self) -> list[str]:
        """Keys that say what is held; in a valid phase, one."""
        return [key for key in _BASES if getattr(self, key) is not None]

    @property
    def drives(self) -> bool:
        """True if anything that the phase holds differs from zero."""
        own = vars(self).items()
        return any(value for key, value in own if key not in ("duration_s", "frequency_Hz"))

    def phase(self, per_square_volt: float) -> Phase:
        """Return the phase in torques; a voltage's torque is `per_square_volt` V^2 (eq. 9)."""
        (base,) = self.bases
        value, to, amplitude = (getattr(self, key) for key in (base, *further_keys(base)))
        left = right = load(self.duration_s, value, to, amplitude, self.frequency_Hz)
        of_right = getattr(self, base.replace("_", "_right_")) if base in _PULLS else None
        if of_right is not None:
            right = replace(left, value_Nm=of_right)
        if base == _VOLTAGE:
            left, right = left.squared(per_square_volt), right.squared(per_square_volt)
        return Phase(self.duration_s, left, right)

    def problems(self) -> Iterator[Problem]:
        """Find keys that are in conflict."""
        given = {name: value for name, value in vars(self).items() if value is not None}
        if len(self.bases) != 1:
            found, others = " and ".join(self.bases) or "neither", ", ".join(_BASES[2:])
            text = f"found {found}, allowed is one of {' and '.join(_PULLS)}, or with another "
            yield (), f"{text}instrument of {others}."
            return
        by = self.bases[0]
        ramp, swing = further_keys(by)
        right = by.replace("_", "_right_") if by in _PULLS else ""
        for key in sorted(given.keys() - {"duration_s", by, right, ramp, swing, "frequency_Hz"}):
            yield (key,), f"does not go with {by}."
        if (swing in given) != ("frequency_Hz" in given):
            yield (), f"has one of {swing} and frequency_Hz; allowed are both or neither."
        if right in given and ramp in given:
            yield (right,), "does not go with a ramp; allowed is a held torque."
        if swing in given and ramp in given:
            yield (), "has a ramp and a sinusoid; allowed is one of them in a phase."
        if by in _PULLS and given.get(swing, 0) > min(given[by], given.get(right, given[by])):
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

    def make_phases(self, instrument: Instrument, comb: CombDrive) -> tuple[Phase, ...]:
        """Return all phases in units of what the instrument holds, or of the largest load."""
        per_square_volt = 0.5 * capacitance_slope(comb)
        phases = tuple(phase.phase(per_square_volt) for phase in self.phases)
        if not instrument.relative:
            return phases
        largest = largest_load(phases)
        divided = [(phase.duration_s, phase.left.divided(largest)) for phase in phases]
        return tuple(Phase(duration_s, load, load) for duration_s, load in divided)

    def problems(self) -> Iterator[Problem]:
        """Refuse a protocol that is too long, or in which all torques are zero."""
        if self.end_s > _LONGEST_S:
            text = f"found {self.end_s:g} s in all phases together, allowed is at most "
            yield ("phases",), f"{text}{_LONGEST_S:g} s."
        if not any(phase.drives for phase in self.phases):
            name = self.phases[0].bases[0].partition("_")[0]
            text = f"no phase has a {name}, so nothing would move; allowed is at least one above 0."
            yield ("phases",), text

    def instrument_problems(self, instruments: Sequence[Instrument]) -> Iterator[Problem]:
        """Find phases that hold what none of some instruments, of one kind, holds."""
        columns = list(dict.fromkeys(instrument.controlled.column for instrument in instruments))
        allowed = [*columns, _VOLTAGE] if _BASES[0] in columns else columns
        for index, phase in enumerate(self.phases):
            for base in phase.bases:
                if base not in allowed:
                    text = f"is not what {instruments[0].kind} holds; allowed is "
                    yield ("phases", index, base), f"{text}{' or '.join(allowed)}."
                elif base not in _PULLS and base != self.phases[0].bases[0]:
                    text = f"does not go with {self.phases[0].bases[0]} in another phase; allowed "
                    yield ("phases", index, base), f"{text}is one of them."


def further_keys(base: str) -> tuple[str, str]:
    """Return the keys of a ramp's end and of a sinusoid's amplitude."""
    return f"to_{base}", f"amplitude_{base.rpartition('_')[2]}"
