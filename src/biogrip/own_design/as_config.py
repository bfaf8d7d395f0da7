"""A design as a config that is laid over the study's."""

from collections.abc import Iterable, Iterator

from biogrip import __version__
from biogrip.own_design.designed import Designed
from biogrip.own_traces.outputs import WRITTEN_BY


def as_config(designs: Iterable[Designed]) -> str:
    """Return the YAML that gives each case its designed protocol and sampling."""
    lines = [
        f"# {WRITTEN_BY} {__version__}: experiments by `biogrip design`.",
        "cases:",
    ]
    for found in designs:
        lines += _case(found)
    return "\n".join(lines) + "\n"


def _case(found: Designed) -> Iterator[str]:
    yield f"  {found.case.name}:"
    yield "    models: { inertia: true }"
    yield "    protocol:"
    yield "      phases:"
    for phase in found.plan.phases:
        duration, torque = _number(phase.duration_s), _number(phase.left.value_Nm)
        yield f"        - {{ duration_s: {duration}, torque_Nm: {torque} }}"
    yield "    measurement:"
    yield f"      noise: {{ kind: gaussian, level_rad: {_number(found.wanted.noise_rad)} }}"
    yield "      bursts:"
    for burst in found.plan.bursts:
        start, rate = _number(burst.from_s), _number(burst.rate_Hz)
        yield f"        - {{ from_s: {start}, rate_Hz: {rate}, samples: {burst.samples} }}"


def _number(value: float) -> str:
    """Print a number to its last digit, with the point that YAML asks for before an exponent."""
    mantissa, e, exponent = repr(float(value)).partition("e")
    return mantissa + ("" if "." in mantissa or not e else ".0") + e + exponent
