"""Results of identification as plain text for a terminal."""

import os
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from biogrip.digits import with_unit
from biogrip.judging.doubts import OK, REJECTED
from biogrip.judging.verdicts import (
    BOUNDED_ABOVE,
    BOUNDED_BELOW,
    DETERMINED,
    NOT_DETERMINED,
)
from biogrip.records.verdicts import FIT_REJECTED
from biogrip.study.measurement_block import KNOWN_NOISE
from biogrip.terminal import aligned, visible, visible_lines

_COLOURS = {
    DETERMINED: 32,
    BOUNDED_ABOVE: 33,
    BOUNDED_BELOW: 33,
    NOT_DETERMINED: 31,
    FIT_REJECTED: 90,
}


def in_words(found: Mapping[str, Any]) -> str:
    """Return the result of `identify_trace` for one trace as plain text."""
    width = max(len(item["quantity"]) for item in found["quantities"])
    lines = [
        f"{visible(found['trace'])}: fit {found['fit']}",
        *(f"  {visible(reason)}" for reason in found["reasons"]),
        f"{found['samples']} samples, {noise_in_words(found)}, "
        f"misfit {in_unit(found['misfit_rad'], found)}",
        f"{found['model_title']}, {100 * found['confidence']:g} % limits:",
        *(
            f"  {item['quantity']:<{width}}  {_coloured(item['in_words'], item['verdict'])}"
            for item in found["quantities"]
        ),
    ]
    lines += one_sided_in_words([found])
    lines += [found["limits"]] if found["fit"] != REJECTED else []
    lines += [trade["words"] for trade in found["trades"]]
    lines += fitted_in_words(found)
    lines += [f"Note: {visible(text)}" for text in further_notes(found)]
    lines += [found["advice"]] if found["advice"] else []
    lines += [taken_for_granted(found)] if found["by_default"] else []
    return "\n".join(lines)


def noise_in_words(found: Mapping[str, Any]) -> str:
    """Return the noise that a misfit is held against: given, modelled, or seen in the trace."""
    if found["fit"] == REJECTED and found["noise_model"]:
        return "noise that cannot be told from misfit"
    given = found["assumed"]["measurement"]
    what = "noise as modelled" if found["noise_model"] else "scatter of neighbours"
    if any(given.get(key) is not None for key in KNOWN_NOISE):
        what = "noise as given"
    return f"{what} {in_unit(found['scatter_rad'], found)}"


def in_unit(value: float, found: Mapping[str, Any]) -> str:
    """Return a number with the unit of what the instrument reads."""
    return f"{value:.3g} {found['reads']['unit']}".rstrip()


def fitted_in_words(found: Mapping[str, Any]) -> list[str]:
    """Return lines on fixed parameters, and on onset, offset and drift as far as fitted."""
    lines = fixed_in_words(found)
    if "onset_s" in found:
        lines.append(f"The protocol starts at {found['onset_s']:.4g} s of the clock, as fitted.")
    if "offset_rad" in found:
        lines.append(f"Offset of the instrument: {in_unit(found['offset_rad'], found)}")
    if "drift_rad_per_s" in found:
        lines.append(f"Drift of the instrument: {in_unit(found['drift_rad_per_s'], found)}/s")
    return lines


def fixed_in_words(found: Mapping[str, Any]) -> list[str]:
    """Return a line on fixed parameters, or none."""
    return [f"Fixed: {', '.join(found['fixed'])}."] if "fixed" in found else []


def one_sided_in_words(found: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return a sentence on the confidence of one-sided limits of traces; nothing without any."""
    quantities = [item for each in found for item in each["quantities"]]
    if all((item["low"] is None) == (item["high"] is None) for item in quantities):
        return []
    return [f"One-sided limits hold with {50 * (1 + found[0]['confidence']):g} % confidence."]


def for_a_paper(found: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return sentences for a paper, as text and as LaTeX: one per quantity with two limits.

    Nothing if the fit is doubtful or rejected.
    """
    if found["fit"] != OK:
        return []
    return [
        (_for_a_paper(each, found["confidence"]), _in_latex(each, found["confidence"]))
        for each in found["quantities"]
        if each["low"] is not None and each["high"] is not None
    ]


def _for_a_paper(found: Mapping[str, Any], confidence: float) -> str:
    unit = f" {found['unit']}" if found["unit"] else ""
    return (
        f"{found['quantity']} = {found['value']:.3g}{unit} ({100 * confidence:g} % "
        f"profile-likelihood interval {found['low']:.3g} to {found['high']:.3g}, n = 1 trace)"
    )


def _in_latex(found: Mapping[str, Any], confidence: float) -> str:
    value, low, high = (_number_in_latex(found[name]) for name in ("value", "low", "high"))
    unit = rf"\,\mathrm{{{found['unit'].replace(' ', chr(92) + ',')}}}" if found["unit"] else ""
    symbol = found["symbol"].replace("$", "")
    return (
        rf"${symbol} = {value}{unit}$ ({100 * confidence:g}\,\% profile-likelihood interval "
        rf"${low}$ to ${high}$, $n = 1$ trace)"
    )


def _number_in_latex(value: float) -> str:
    digits, _, exponent = f"{value:.3g}".partition("e")
    return rf"{digits} \times 10^{{{int(exponent)}}}" if exponent else digits


def further_notes(found: Mapping[str, Any]) -> list[str]:
    """Return the texts of the notes that are no reasons for the fit's status."""
    return [note["text"] for note in found["notes"] if note["text"] not in found["reasons"]]


def side_by_side(found: Sequence[Mapping[str, Any]], refused: Mapping[str, str]) -> str:
    """Return several traces as a table with one row per trace, followed by refused traces."""
    lines = []
    if found:
        labels = labels_of(found)
        rows = [[visible(each["trace"]), each["fit"], *_cells(each, labels)] for each in found]
        units = {q["quantity"]: q["unit"] for each in found for q in each["quantities"]}
        header = ["trace", "fit", *(with_unit(label, units[label]) for label in labels)]
        lines.append(aligned(rows, header))
        lines.append(f"{100 * found[0]['confidence']:g} % limits; ? where the trace tells nothing.")
        lines += [*one_sided_in_words(found), *_once(found, lambda each: [each["limits"]])]
        lines += _once(found, _provided)
        lines += _once(found, fixed_in_words)
        lines += [
            f"{visible(each['trace'])}: {note['weight']}: {visible(note['text'])}"
            for each in found
            for note in each["notes"]
        ]
        lines += _once(found, lambda it: [taken_for_granted(it)] if it["by_default"] else [])
    if refused:
        lines.append(f"Not identified, {len(refused)} of {len(refused) + len(found)}:")
        lines += [f"  {visible_lines(reason)}" for reason in refused.values()]
    return "\n".join(lines)


def _once(
    found: Sequence[Mapping[str, Any]], words_of: Callable[[Mapping[str, Any]], list[str]]
) -> list[str]:
    """Return what is said of every trace, or, where that differs, of each with its name."""
    said = [words_of(each) for each in found]
    if all(words == said[0] for words in said):
        return said[0]
    return [
        f"{visible(each['trace'])}: {line}"
        for each, words in zip(found, said, strict=True)
        for line in words
    ]


def _provided(found: Mapping[str, Any]) -> list[str]:
    return [f"Sums hold provided {q['provided']}." for q in found["quantities"] if q["provided"]]


def labels_of(found: Iterable[Mapping[str, Any]]) -> list[str]:
    """Return the labels of all quantities of several traces, each once."""
    return list(dict.fromkeys(q["quantity"] for each in found for q in each["quantities"]))


def taken_for_granted(found: Mapping[str, Any]) -> str:
    """Return a sentence naming defaults (gripper, protocol) that the user did not replace."""
    phases = ", ".join(_phase(phase) for phase in found["assumed"]["protocol"]["phases"])
    said = {
        "gripper": "the default study's gripper",
        "protocol": f"the default study's protocol ({phases})",
    }
    words = " and ".join(said[name] for name in found["by_default"])
    return f"Assumed: {words}; yours are given with --config."


def _phase(phase: Mapping[str, Any]) -> str:
    torque = phase.get("torque_Nm")
    what = f"{torque:g} N m" if isinstance(torque, float) else "as there"
    return f"{phase['duration_s']:g} s at {what}"


def _cells(found: Mapping[str, Any], labels: Sequence[str]) -> list[str]:
    by_label = {q["quantity"]: q for q in found["quantities"]}
    return [
        _coloured(limits_in_short(by_label[label]), by_label[label]["verdict"])
        if label in by_label
        else ""
        for label in labels
    ]


def limits_in_short(quantity: Mapping[str, Any]) -> str:
    """Return value and limits of a quantity in a few characters."""
    low, high = quantity["low"], quantity["high"]
    if quantity["verdict"] == FIT_REJECTED:
        return "rejected"
    if low is not None and high is not None:
        return f"{quantity['value']:.3g} ({low:.3g} to {high:.3g})"
    if low is not None:
        return f"≥ {low:.2g}"
    return "?" if high is None else f"≤ {high:.2g}"


def _coloured(text: str, verdict: str) -> str:
    """Colour a verdict if standard output is a terminal (https://no-color.org)."""
    if not sys.stdout.isatty() or os.environ.get("NO_COLOR"):
        return text
    return f"\x1b[{_COLOURS[verdict]}m{text}\x1b[0m"
