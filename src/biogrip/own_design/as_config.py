"""Designs as a YAML config to merge over the study's."""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import zip_longest

from biogrip import __version__
from biogrip.design.noise import WHITE, DesignNoise
from biogrip.experiment.protocol import Phase
from biogrip.own_design.designed import Designed
from biogrip.own_traces.outputs import WRITTEN_BY
from biogrip.study.protocol_block import further_keys


def as_config(designs: Iterable[Designed]) -> str:
    """Return YAML that gives each case its designed protocol and sampling."""
    lines = [
        f"# {WRITTEN_BY} {__version__}: experiments by `biogrip design`.",
        "cases:",
    ]
    for found in designs:
        lines += _case(found)
    return "\n".join(lines) + "\n"


def of_sets(designs: Iterable[Designed]) -> list[list[Designed]]:
    """Return the first experiment of each chosen set, the second, and so on."""
    return [[one for one in row if one] for row in zip_longest(*map(of_set, designs))]


def of_set(found: Designed) -> list[Designed]:
    """Return each experiment of the chosen set, if there is one."""
    several = found.several
    if not several or not several.chosen:
        return []
    plans, counts = several.plans_of(several.chosen), several.chosen.counts
    pairs = zip(plans, counts[counts > 0].tolist(), strict=True)
    return [
        replace(found, plan=plan, number=number, times=times)
        for number, (plan, times) in enumerate(pairs, 1)
    ]


def _case(found: Designed) -> Iterator[str]:
    note = f" # {found.times} × with each cell" if found.number else ""
    yield f"  {found.case.name}:{note}"
    yield "    protocol:"
    yield "      phases:"
    base = found.case.instrument.controlled.column
    for phase in found.plan.phases:
        keys = ", ".join(f"{key}: {_number(value)}" for key, value in _keys(phase, base))
        yield f"        - {{ {keys} }}"
    yield "    measurement:"
    instrument = found.case.instrument
    note = "" if instrument.has_jaws else f" # of the {instrument.read.column}"
    parts = "".join(f", {part}" for part in _parts(found.inputs.noise))
    level = _number(found.inputs.noise_rad)
    yield f"      noise: {{ kind: gaussian, level_rad: {level}{parts} }}{note}"
    if found.inputs.noise.exposure_s:
        yield f"      exposure_s: {_number(found.inputs.noise.exposure_s)}"
    yield from _assumed(found.inputs.noise)
    yield "      bursts:"
    for burst in found.plan.bursts:
        start, rate = _number(burst.from_s), _number(burst.rate_Hz)
        yield f"        - {{ from_s: {start}, rate_Hz: {rate}, samples: {burst.samples} }}"


def _parts(noise: DesignNoise) -> Iterator[str]:
    """Yield keys of noise with memory."""
    if noise.ar1:
        share, time = _number(noise.ar1.share), _number(noise.ar1.time_s)
        yield f"ar1: {{ share: {share}, time_s: {time} }}"
    if noise.flicker:
        yield f"flicker: {{ share: {_number(noise.flicker.share)} }}"


def _assumed(noise: DesignNoise) -> Iterator[str]:
    """Yield what an identification has to allow for, to come as close as the bounds say."""
    if noise.has_memory:
        yield "      noise_model: coloured"
    if replace(noise, exposure_s=0.0) != WHITE:
        yield f"      offset: {str(noise.fits_offset).lower()}"
        yield f"      drift: {str(noise.fits_drift).lower()}"


def _keys(phase: Phase, base: str) -> Iterator[tuple[str, float]]:
    """Yield keys and values of a phase; computed values are rounded to 12 digits."""
    ramp, swing = further_keys(base)
    yield "duration_s", phase.duration_s
    yield base, phase.left.value_Nm
    if phase.left.slope_Nm_per_s:
        end = float(phase.left.at(phase.duration_s))
        # A ramp to zero ends there but for rounding, which may have the other sign.
        yield ramp, float(f"{end:.12g}") if abs(end) > 1e-12 * phase.left.value_Nm else 0.0
    for harmonic in phase.left.harmonics:
        yield swing, harmonic.amplitude_Nm
        yield "frequency_Hz", float(f"{harmonic.frequency_Hz:.12g}")


def _number(value: float) -> str:
    """Return a number's shortest exact text, with the dot that YAML needs before an exponent."""
    mantissa, e, exponent = repr(float(value)).partition("e")
    return mantissa + ("" if "." in mantissa or not e else ".0") + e + exponent
