"""Settings of a design, as in the config."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated

from pydantic import Field

from biogrip.design.criteria import CRITERIA, OVER
from biogrip.design.noise import DesignNoise
from biogrip.design.price import PriceSettings
from biogrip.design.shapes import SHAPES
from biogrip.instrument.instrument import Instrument
from biogrip.keys import Block, Distinct, OneOf, Problem
from biogrip.response.whitening import MOST_SAMPLES

NOISES = ("noise_rad", "noise_m", "noise_strain", "noise_N", "noise_Pa")
_VOLTAGE = "largest_voltage_V"
LARGEST = (
    "largest_torque_Nm",
    _VOLTAGE,
    "largest_force_N",
    "largest_stress_Pa",
    "largest_displacement_m",
    "largest_strain",
)

# Shortest duration of a step by default, readings in it by default, and its fewest readings.
_SHORTEST_S, _READINGS, _FEWEST = 0.01, 10, 2

_Size = Annotated[float | None, Field(gt=0, le=1e12)]

_Ends = Annotated[
    tuple[Annotated[float, Field(gt=0, le=1e12)], ...], Field(min_length=2, max_length=2)
]


@dataclass(frozen=True)
class SequenceSettings(Block):
    """Simulated sequences of experiments on cells, which count those needed, see docs/design.md."""

    cells: Annotated[int, Field(ge=2, le=10_000)]
    """Cells, drawn uniformly in the logarithms within `design.ranges`."""
    experiments: Annotated[int, Field(ge=2, le=20)]
    """Experiments with each, by every strategy."""


@dataclass(frozen=True, kw_only=True)
class DesignSettings(Block):
    """Settings of `biogrip design`, which searches for what to hold and when to read."""

    readings: Annotated[int, Field(ge=10, le=1_000_000)]
    """Total number of readings."""
    fastest_Hz: Annotated[float, Field(ge=1e-3, le=1e9)]
    """Most readings in a second."""
    longest_s: Annotated[float, Field(ge=1e-6, le=1e6)]
    """Duration of the experiment."""
    noise_rad: Annotated[float | None, Field(ge=1e-15, le=1.0)] = None
    """Standard deviation of the sensor's noise."""
    noise_m: _Size = None
    """The same of a displacement, where the instrument is `creep`."""
    noise_strain: _Size = None
    """The same of a strain, likewise."""
    noise_N: _Size = None
    """The same of a force, where the instrument is `relaxation`."""
    noise_Pa: _Size = None
    """The same of a stress, likewise."""
    noise: DesignNoise | None = None
    largest_torque_Nm: Annotated[float | None, Field(gt=0, le=1.0)] = None
    """Largest torque, as an increment on what closes the jaws onto the sample."""
    largest_voltage_V: Annotated[float | None, Field(gt=0, le=1e4)] = None
    """Largest voltage, instead; counted like a protocol's."""
    largest_force_N: _Size = None
    """Largest force, where the instrument is `creep`."""
    largest_stress_Pa: _Size = None
    """Largest stress, likewise."""
    largest_displacement_m: _Size = None
    """Largest displacement, where the instrument is `relaxation`."""
    largest_strain: _Size = None
    """Largest strain, likewise."""
    shortest_step_s: Annotated[float | None, Field(ge=1e-6, le=1e6)] = None
    """All steps, ramps and sinusoids last whole multiples of this. By default 0.01 s, or ten
    readings at `fastest_Hz` if these take longer."""
    most_steps: Annotated[int, Field(ge=2, le=1000)] = 40
    """Largest number of steps, ramps and sinusoids. By default 40."""
    shapes: Annotated[
        tuple[Annotated[str, OneOf(SHAPES)], ...], Field(min_length=1), Distinct()
    ] = ("steps",)
    """Torques, or what else is held, that can be made: trains of `steps`, of `ramps` that never
    jump, `sinusoids` on held torques; the best of them is taken. By default steps."""
    criterion: Annotated[str, OneOf(CRITERIA)] = "largest"
    """Function of the covariance of the logarithms asked for to minimize: `largest`, the largest
    relative bound (the default); `D`, its determinant; `A`, the mean of the squared bounds; `E`,
    its largest eigenvalue."""
    over: Annotated[str, OneOf(OVER)] = "worst"
    """Plausible sample that counts, the `worst` (the default), or `mean` over all samples."""
    quantities: Annotated[tuple[str, ...], Field(min_length=1, max_length=40), Distinct()] = ()
    """Parameters that are asked for; the others are free all the same. By default all that are not
    fixed."""
    ranges: Mapping[str, _Ends] | None = None
    """Lowest and highest plausible value of parameters, in SI units. Those without one are as in
    the case's sample. By default, that sample alone is plausible."""
    plausible_samples: Annotated[int, Field(ge=2, le=256)] = 8
    """Plausible samples, spread evenly over these ranges. By default 8."""
    candidates: Annotated[int, Field(ge=128, le=1_000_000)] = 2000
    """Torques that the search tries, about, as many of each shape. By default 2000. Trains of steps
    are then climbed from, by four times as many neighbours."""
    sequence: SequenceSettings | None = None
    price: PriceSettings | None = None

    @property
    def unit_s(self) -> float:
        """Unit of time, of which the durations of steps, ramps and sinusoids are multiples."""
        if self.shortest_step_s is not None:
            return self.shortest_step_s
        return max(_SHORTEST_S, _READINGS / self.fastest_Hz)

    @property
    def noise_level(self) -> float:
        """Standard deviation of the noise, in the unit of what is read."""
        return next(value for key in NOISES if (value := getattr(self, key)) is not None)

    def largest(self, instrument: Instrument) -> float | None:
        """Return the largest value of what an instrument controls, if it is given."""
        value: float | None = getattr(self, largest_key(instrument))
        return value

    def instrument_problems(self, instrument: Instrument) -> Iterator[Problem]:
        """Find keys in another unit than the instrument's, and a limit or noise not given once."""
        if instrument.relative:
            text = f"found readings of {instrument.read.name}, allowed with a design are those of "
            yield (), f"{text}{'stress' if instrument.deforms else 'strain'}."
            return
        own = [largest_key(instrument), *([_VOLTAGE] if instrument.has_jaws else [])]
        for keys, allowed in ((LARGEST, own), (NOISES, [noise_key(instrument)])):
            given = [key for key in keys if getattr(self, key) is not None]
            others = [key for key in given if key not in allowed]
            for key in others:
                text = f"is not of {instrument.controlled.name} that is held and "
                text += f"{instrument.read.name} that is read; allowed is "
                yield (key,), f"{text}{' or '.join(allowed)}."
            if not others and len(given) != 1:
                text = f"found {' and '.join(given) or 'none'}, allowed is "
                yield (), f"{text}{'one of ' * (len(allowed) > 1)}{' and '.join(allowed)}."
        if self.sequence and not instrument.has_jaws:
            yield ("sequence",), f"is of the gripper; leave it out with {instrument.kind}."

    def problems(self) -> Iterator[Problem]:
        """Find keys whose values conflict."""
        for key in ("sequence", "price"):
            if getattr(self, key) and not self.ranges:
                text = "found no design.ranges, which cells are drawn from; allowed is one at "
                yield (key,), f"{text}least."
        if self.unit_s * self.fastest_Hz < _FEWEST:
            text = f"found {self.shortest_step_s}, allowed is at least two samples long, "
            yield ("shortest_step_s",), f"{text}{_FEWEST / self.fastest_Hz:g} s."
        fewest, words = (4, "four ramps") if "ramps" in self.shapes else (2, "two steps")
        shortest_s = fewest * self.unit_s
        if shortest_s > self.longest_s:
            text = f"found {self.longest_s}, allowed is at least {words}, {shortest_s:g} s"
            yield ("longest_s",), f"{text}{self._instead(self.longest_s / fewest)}."
        if self.noise and (exposure_s := self.noise.exposure_s) > 1 / self.fastest_Hz:
            text = f"found {exposure_s:g}, allowed is at most the time between readings, "
            yield ("noise", "exposure_s"), f"{text}{1 / self.fastest_Hz:g} s."
        if self.sequence and self.noise and (self.noise.has_memory or self.noise.exposure_s):
            text = "takes noise for white and readings of instants; leave it out with noise that "
            yield ("sequence",), f"{text}has memory or an exposure."
        if self.noise and self.noise.has_memory and self.readings > MOST_SAMPLES:
            text = f"found {self.readings}, allowed are at most {MOST_SAMPLES} with noise that "
            yield ("readings",), f"{text}has memory."
        for name, (low, high) in (self.ranges or {}).items():
            if not low <= high:
                yield ("ranges", name), f"found {low} to {high}, allowed is the lower one first."

    def _instead(self, longest_s: float) -> str:
        """Name the key to change instead if the default length of steps is too long."""
        if self.shortest_step_s is not None:
            return ""
        fastest_Hz = _FEWEST / longest_s
        if fastest_Hz > self.fastest_Hz:
            return f", or a fastest_Hz of at least {fastest_Hz:g}"
        return f", or a shortest_step_s of at most {longest_s:g}"


def noise_key(instrument: Instrument) -> str:
    """Return the key of the noise of what an instrument reads."""
    return f"noise_{instrument.read.column.rpartition('_')[2]}"


def largest_key(instrument: Instrument) -> str:
    """Return the key of the largest value of what an instrument controls."""
    return f"largest_{instrument.controlled.column}"
