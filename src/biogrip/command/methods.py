"""What a paper says of the methods: one paragraph, of one trace or of many."""

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from biogrip import __version__
from biogrip.digits import counted, legible
from biogrip.judging.doubts import DOUBTFUL, OK, REJECTED
from biogrip.physics.instruments import INSTRUMENTS
from biogrip.study.measurement_block import KNOWN_NOISE
from biogrip.terminal import visible

REFERENCE = (
    "The biogrip authors, biogrip: how well a MEMS microgripper identifies the viscoelastic "
)
REFERENCE += f"parameters of a cell, version {__version__}, 2026"
"""How biogrip is cited, as in CITATION.cff."""

_INSTRUMENTS = {
    "gripper": "The {} of an arm of a microgripper was recorded",
    "creep": "In creep the {} was recorded",
    "relaxation": "In relaxation the {} was recorded",
    "oscillation": "In oscillation storage and loss moduli were recorded over frequency",
}
_MOST_PHASES, _MOST_NAMED = 4, 3
_IN_LATEX = str.maketrans(
    {
        **{sign: rf"\{sign}" for sign in "%_&#${}"},
        **{"\\": r"\textbackslash{}", "^": r"\^{}", "~": r"\~{}"},
        **{"²": "$^2$", "χ": r"$\chi$", "τ": r"$\tau$", "Δ": r"$\Delta$", "→": r"$\to$"},
    }
)
_POWER = re.compile(r"(\d[\d.]*)e([+-]\d+)\b")


def set_up_in_words(found: Mapping[str, Any]) -> list[str]:
    """Return sentences on instrument, protocol, model, noise, limits and conditions of a trace."""
    reads, assumed = found["reads"]["quantity"], found["assumed"]
    under = "" if INSTRUMENTS[reads].sweeps else f" under {_protocol(found)}"
    what = _INSTRUMENTS[found["instrument"]].format(reads.replace("_", " "))
    said = [f"{what}{under}."]
    if sphere := assumed["measurement"].get("sphere"):
        said.append(
            f"By Hertz's contact with a sphere of radius R = {sphere}, a force F is the stress "
            "9F/(16R²) and an indentation d the strain (d/R)^1.5; moduli are Young's."
        )
    if "gripper" in assumed:
        own = assumed["gripper"]
        arms = (f"{own[arm]['stiffness_Nm_per_rad']:g}" for arm in ("left", "right"))
        text = f"Its arms of {own['arm_length_m']:g} m have stiffnesses of {' and '.join(arms)}"
        said.append(f"{text} N m/rad, at {own['reference_angle_deg']:g} degrees.")
    fixed = f" with {', '.join(found['fixed'])}" if "fixed" in found else ""
    along = [name for name in ("offset", "drift") if f"{name}_rad" in found]
    along += ["drift"] if "drift_rad_per_s" in found else []
    along += ["start"] if "onset_s" in found else []
    also = f", along with the instrument's {' and '.join(along)}" if along else ""
    title = found["model_title"].removesuffix(" model")
    said.append(f"The model ({title}{fixed}) was fitted by least squares{also}; {_noise(found)}.")
    level = f"{100 * found['confidence']:g} %"
    said.append(f"Intervals are {level} profile-likelihood limits. {found['limits']}")
    if any((each["low"] is None) != (each["high"] is None) for each in found["quantities"]):
        sided = f"{50 * (1 + found['confidence']):g} %"
        said.append(f"Where one limit alone is given, it holds with {sided} confidence, one-sided.")
    conditions = ((q["quantity"], q["provided"]) for q in found["quantities"] if q["provided"])
    return [*said, *(f"The value of {name} holds provided {it}." for name, it in conditions)]


def preferred_in_words(found: Mapping[str, Any]) -> list[str]:
    """Return a sentence on the model that is preferred to that of the fit, if one is."""
    lowest = min(found["models"] or [], key=lambda row: row["delta_bic"], default=None)
    if not found["preferred_model"] or lowest is None:
        return []
    return [
        f"Of {len(found['models'])} models that were compared, that of the lowest BIC is "
        f"another: {lowest['title']}."
    ]


def _protocol(found: Mapping[str, Any]) -> str:
    """Return what was held, as in: a stress of 5 Pa for 60 s."""
    if "load" in found:
        controlled = INSTRUMENTS[found["reads"]["quantity"]].controlled.name
        return f"a {controlled} of {found['load'].partition(': ')[2].rstrip('.')}"
    phases = found["assumed"]["protocol"]["phases"]
    if len(phases) > _MOST_PHASES:
        lasts_s = sum(phase["duration_s"] for phase in phases)
        return f"a protocol of {len(phases)} phases in {lasts_s:g} s"
    parts = []
    for number, phase in enumerate(phases):
        keys = [key for key in phase if key != "duration_s" and phase[key] is not None]
        base = next(key for key in keys if not key.startswith("to_"))
        name, _, unit = base.partition("_")
        unit = "N m" if unit == "Nm" else unit
        ends = [f"{phase[key]:g} {unit}".rstrip() for key in (base, f"to_{base}") if key in keys]
        of = f"from {' to '.join(ends)} within" if ends[1:] else f"of {ends[0]} for"
        parts.append(f"{'' if number else f'a {name} '}{of} {phase['duration_s']:g} s")
    return ", then ".join(parts)


def _noise(found: Mapping[str, Any]) -> str:
    given = found["assumed"]["measurement"]
    if known := [key for key in KNOWN_NOISE if given.get(key) is not None]:
        return f"the noise was given ({known[0]})"
    if found["noise_model"]:
        return "the noise was modelled as autocorrelated"
    return "the noise was taken from the scatter of neighbouring readings"


def outcome_in_words(traces: Iterable[tuple[str, str, str]]) -> list[str]:
    """Return sentences on what was refused and why, from name, status and reason of traces."""
    every = [*traces]
    counts = {fit: sum(own == fit for _, own, _ in every) for fit in (OK, DOUBTFUL)}
    kept = f"{counts[OK] + counts[DOUBTFUL]} of {counted(len(every), 'trace')} were used"
    doubtful = f", {counts[DOUBTFUL]} of them with a doubtful fit" if counts[DOUBTFUL] else ""
    said = [f"{kept}{doubtful}."]
    for rejected, what in ((True, "Rejected"), (False, "Not identified")):
        left = [own for own in every if own[1] not in counts and (own[1] == REJECTED) == rejected]
        named = [f"{visible(own[0])}: {_first_of(*own)}" for own in left[:_MOST_NAMED]]
        more = f"; {len(left) - len(named)} more" if left[len(named) :] else ""
        said += [f"{what}: {len(left)} ({'; '.join(named)}{more})."] if left else []
    return said


def _first_of(name: str, _: str, reason: str) -> str:
    """Return the first clause of a reason, without the place in the file at its beginning."""
    if reason.startswith(name):
        reason = reason.partition(": ")[2]
    return re.split(r"[;.](?=\s|$)|: |, as ", reason)[0].strip() or "no reason given"


def together(several: Iterable[Sequence[str]]) -> list[str]:
    """Return what several traces say once: of sentences that begin alike, the first."""
    by_start: dict[tuple[str, ...], dict[str, None]] = {}
    for sentences in several:
        for each in sentences:
            by_start.setdefault(tuple(each.split()[:4]), {})[each] = None
    said = []
    for first, *others in by_start.values():
        alike = f" ({len(others)} likewise with other numbers)." if others else "."
        said.append(first.removesuffix(".") + alike)
    return said


def in_sentences(text: str) -> list[str]:
    """Return the sentences of a paragraph."""
    return re.split(r"(?<=\.) (?=[A-Z])", text)


def paragraph(sentences: Iterable[str], version: str = __version__) -> tuple[str, str]:
    """Return a paragraph as text and as LaTeX; at its end the software."""
    reference = REFERENCE.replace(__version__, version)
    text = " ".join([*sentences, f"Computed with biogrip {version} ({reference})."])
    latex = _POWER.sub(
        lambda it: rf"${it[1]} \times 10^{{{int(it[2])}}}$", text.translate(_IN_LATEX)
    )
    return legible(text), latex
