"""Results of identification in words: for a terminal, and what a paper says of the methods."""

import re
from collections.abc import Iterable, Mapping, Sequence
from math import log
from textwrap import indent
from typing import Any

import numpy as np

import biogrip.levels as levels
from biogrip import __version__
from biogrip.config.case import SampleCase
from biogrip.config.source import HOLD, RAMP
from biogrip.digits import counted, instant, legible, plain, with_limits, with_unit
from biogrip.identify.prepare import Trace
from biogrip.judging.doubts import DOUBT, DOUBTFUL, HARMLESS, OK, REJECTED, REJECTION
from biogrip.judging.profiles import FIT_REJECTED, NOT_DETERMINED
from biogrip.judging.what_moves import LEAST_MOVE, error_in_words
from biogrip.judging.without_model import BEYOND, EXPONENT, FLOW, LEVEL, LOSS
from biogrip.physics.instruments import INSTRUMENTS
from biogrip.physics.models import CANDIDATES
from biogrip.terminal import aligned, visible, visible_lines
from biogrip.traces.columns import held_unit, shape_and_sizes
from biogrip.traces.measurement_block import KNOWN_NOISE
from biogrip.traces.reader import Recording

# Instrument whose readings span decades: their misfit is told over their noise.
_SWEEPS = "oscillation"
# Most lines on what any linear sample would show.
_LINES = 5
# Most names of traces that are refused for what another one is.
_MOST_NAMED = 5
_LIKELIHOOD_RATIO = "That they are of one sample was tested by two likelihood ratios (Bonferroni)."
# Share of the largest load so far below which a contact shrinks, not only scatters.
_STAYS = 0.9
_NUMBER = re.compile(r"\d[\d.e+-]*")
MEANS = {
    OK: "the residuals look like noise",
    DOUBTFUL: "trust the limits only if you can rule out the reasons given",
    REJECTED: "the model cannot give this trace, so that it has no limits",
}
"""What a status of a fit means."""
_SAID = {HARMLESS: "note", DOUBT: DOUBTFUL, REJECTION: REJECTED}


def in_words(found: Mapping[str, Any]) -> str:
    """Return the result of one trace as plain text."""
    width = max(len(item["quantity"]) for item in found["quantities"])
    rejected = found["fit"] == REJECTED
    lines = [
        f"{visible(found['trace'])}: fit {found['fit']}: {MEANS[found['fit']]}.",
        *(f"  {visible(reason)}" for reason in found["reasons"]),
        *agreement_in_words(found),
        misfit_in_words(found),
        *(without_model_in_words(found) if rejected else []),
        f"{found['model_title']}, {100 * found['confidence']:g} % limits:",
        *(f"  {item['quantity']:<{width}}  {item['in_words']}" for item in found["quantities"]),
    ]
    lines += [] if rejected else without_model_in_words(found)
    lines += one_sided_in_words([found], foremost(found))
    lines += [found["limits"]] if not rejected else []
    lines += moves_in_words(found)
    lines += [trade["words"] for trade in found["trades"]]
    lines += [*given_in_words(found), *fitted_in_words(found)]
    lines += [f"Note: {visible(text)}" for text in further_notes(found)]
    lines += [found["advice"]] if found["advice"] else []
    lines += [taken_for_granted(found)] if found["by_default"] else []
    if traces := found.get("traces"):
        lines += ["Each trace by itself:", in_columns(traces, {})]
        lines += [f"{visible(each['trace'])}: {it}" for each in traces for it in terms_of(each)]
    return "\n".join(lines)


def agreement_in_words(found: Mapping[str, Any]) -> list[str]:
    """Return a sentence that several traces agree with one sample; else it is among reasons."""
    agreed = "traces" in found and found["fit"] != REJECTED
    return [visible(found["agreement"]["in_words"])] if agreed else []


def terms_of(found: Mapping[str, Any]) -> list[str]:
    """Return lines on the noise of a trace, and on what of its instrument was fitted along."""
    return [misfit_in_words(found), *fitted_in_words(found)]


def without_model_in_words(found: Mapping[str, Any]) -> list[str]:
    """Return lines on what any linear sample would show."""
    own, told = found["without_model"], foremost(found)
    left = _times_noise(own["times_noise"])
    if not _by_noise(found):
        left = f"{in_unit(own['misfit_rad'], found)}, {left}"
    if not told:
        why = f"no linear viscoelastic sample fits; the least RMS residual is {left}"
        too_large = "with so large a noise the trace tells nothing"
        return [f"Model-free: {too_large if own['times_noise'] < 1 else why}."]
    width = max(len(each["quantity"]) for each in told)
    lines = (f"  {each['quantity']:<{width}}  {each['in_words']}" for each in told)
    any_sample = f"any linear viscoelastic sample that fits (least RMS residual {left}), has"
    if not own["is_linear"] or own["times_noise"] > levels.CLEARLY:
        any_sample = f"no linear sample fits to the noise; the closest ones, {left}, have"
    return [f"Model-free, {any_sample}:", *lines]


def rows_of_moves(found: Mapping[str, Any]) -> list[tuple[str, dict[str, float]]]:
    """Return clauses on errors of the instrument, and by which share each moves what is shown."""
    shown, of_any = {each["quantity"] for each in foremost(found)}, found["without_model"]["moves"]
    rows: dict[str, dict[str, float]] = {}
    for move in [*found["moves"], *of_any]:
        kept = move in found["moves"]
        changes = {name: by for name, by in move["changes"].items() if kept or name in shown}
        rows.setdefault(move["words"], {}).update(changes)
    return [*rows.items()]


def moves_in_words(found: Mapping[str, Any]) -> list[str]:
    """Return a line on what a zero makes most wrong, and what is most wrong, by model and any."""
    rows, of_model = rows_of_moves(found), {each["quantity"] for each in found["quantities"]}
    said: dict[str, None] = {}
    for some, by_model in ((rows[:1], True), (rows, True), (rows, False)):
        every = [(by, name, words) for words, row in some for name, by in row.items()]
        chosen = [each for each in every if (each[1] in of_model) == by_model]
        by, name, words = max(chosen, key=lambda it: abs(it[0]), default=(0.0, "", ""))
        if abs(by) > LEAST_MOVE:
            said[f"{name} is printed {error_in_words(by)} if {words}"] = None
    return [f"{'; '.join(said)}."] if said else []


def foremost(found: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """Return what is foremost of what any linear sample would show.

    It is all that is told at times that were asked for, or else the level at three times, and what
    is told between them.
    """
    every = found["without_model"]["quantities"]
    told = [each for each in every if each["verdict"] != NOT_DETERMINED]
    levels = [each for each in told if each["kind"] == LEVEL]
    if found["assumed"]["identifiability"]["at_s"] or not levels:
        return told
    middle = levels[len(levels) // 2]
    chosen = [middle, levels[0], levels[-1]]
    for kind in (EXPONENT, FLOW, LOSS):
        own = [each for each in told if each["kind"] == kind]
        chosen += sorted(own, key=lambda it: abs(log((it["at_s"] or 1.0) / middle["at_s"])))[:1]
    chosen += [each for each in told if each["kind"] == BEYOND]
    chosen = [each for number, each in enumerate(chosen) if each not in chosen[:number]][:_LINES]
    return [each for each in told if each in chosen]


def misfit_in_words(found: Mapping[str, Any]) -> str:
    """Return the number of readings, their noise, and the misfit of the best fit."""
    said, noise = f"{found['samples']} readings", noise_in_words(found)
    if not _by_noise(found):
        noise = f"{noise} {in_unit(found['scatter_rad'], found)}"
        few = found["misfit_rad"] < levels.TOO_LITTLE * found["scatter_rad"]
        why = " (too large, as few readings follow the course)" if few else ""
        return f"{said}, {noise}{why}, RMS residual {in_unit(found['misfit_rad'], found)}"
    return f"{said}, RMS residual {_times_noise(found['misfit_rad'] / found['scatter_rad'], noise)}"


def _times_noise(ratio: float, noise: str = "noise") -> str:
    times = plain(ratio, 2)
    return f"as large as the {noise}" if times == "1" else f"{times} times the {noise}"


def _by_noise(found: Mapping[str, Any]) -> bool:
    """Return True if misfits are told over the noise: those of several traces are, too."""
    return found["instrument"] == _SWEEPS or "traces" in found


def noise_in_words(found: Mapping[str, Any]) -> str:
    """Return the noise that a misfit is held against: given, modelled, or seen in the trace."""
    if "traces" in found:
        return f"noise of each of {len(found['traces'])} traces"
    if found["fit"] == REJECTED and found["noise_model"]:
        return "noise that cannot be told from misfit"
    given = found["assumed"]["measurement"]
    what = "noise as modelled" if found["noise_model"] else "noise by the scatter of neighbours"
    if any(given.get(key) is not None for key in KNOWN_NOISE):
        what = "noise as given"
    return what


def in_unit(value: float, found: Mapping[str, Any]) -> str:
    """Return a number with the unit of what the instrument reads."""
    return f"{plain(value)} {found['reads']['unit']}".rstrip()


def fitted_in_words(found: Mapping[str, Any]) -> list[str]:
    """Return lines on onset, contact, offset and drift as far as fitted."""
    lines = []
    if "onset_s" in found:
        when = instant(found["onset_s"], *found["onset_limits_s"])
        lines.append(f"The protocol starts at {when} of the clock, as fitted.")
    if "contact_m" in found:
        depths = (1e9 * it for it in (found["contact_m"], *found["contact_limits_m"]))
        value, low, high = (f"{depth:.3g}" for depth in depths)
        text = f"The tip is deeper than recorded by {value} nm ({low} to {high}), as fitted."
        lines.append(text)
    if "offset_rad" in found:
        lines.append(f"Offset of the instrument: {in_unit(found['offset_rad'], found)}")
    if "drift_rad_per_s" in found:
        lines.append(f"Drift of the instrument: {in_unit(found['drift_rad_per_s'], found)}/s")
    return lines


def given_in_words(found: Mapping[str, Any]) -> list[str]:
    """Return lines on what was held or loaded, a shape, and fixed parameters, as far as given."""
    lines = [visible(found["load"])] if "load" in found else []
    if shape := found["assumed"]["measurement"].get("shape"):
        source = shape_and_sizes(shape)[0].source
        text = f"Moduli, and G, K and J, are Young's, by the shape: {visible(shape)} ({source})."
        lines.append(text)
    return [*lines, f"Fixed: {', '.join(found['fixed'])}."] if "fixed" in found else lines


def elements_in_words(found: Mapping[str, Any]) -> str:
    """Return what the parameters of a trace's model are, and how times follow from them."""
    title = found["model_title"]
    model = next(it.model for it in CANDIDATES.values() if it.model.title == title)
    every = (each["quantity"] for each in found["quantities"])
    ends = (it.removeprefix("tau") for it in every if it.startswith("tau"))
    said = [f"{it.name}: {it.meaning}" for it in model.parameters]
    return "; ".join([*said, *(f"tau{end} = c{end}/k{end}" for end in ends)])


def one_sided_in_words(
    found: Sequence[Mapping[str, Any]], also: Sequence[Mapping[str, Any]] = ()
) -> list[str]:
    """Return a sentence on the confidence of one-sided limits of traces; nothing without any."""
    quantities = [*also, *(item for each in found for item in each["quantities"])]
    if all((item["low"] is None) == (item["high"] is None) for item in quantities):
        return []
    return [f"One-sided limits hold with {50 * (1 + found[0]['confidence']):g} % confidence."]


def further_notes(found: Mapping[str, Any]) -> list[str]:
    """Return the texts of the notes that are no reasons for the fit's status."""
    return [note["text"] for note in found["notes"] if note["text"] not in found["reasons"]]


def in_columns(found: Sequence[Mapping[str, Any]], refused: Mapping[str, str]) -> str:
    """Return several traces as a table with one row per trace, followed by refused traces."""
    lines = []
    if found:
        columns = columns_of(found)
        rows = []
        for each in found:
            cells = {q["quantity"]: limits_in_short(q) for q in each["quantities"]}
            told = (cells.get(label, "") for label in columns)
            rows.append([visible(each["trace"]), each["fit"], *told])
        lines.append(aligned(rows, ["trace", "fit", *columns.values()]))
        lines.append(f"{100 * found[0]['confidence']:g} % limits; ? where the trace tells nothing.")
        fits = {each["fit"] for each in found}
        lines += [f"Fit {fit}: {means}." for fit, means in MEANS.items() if fit in fits]
        lines += one_sided_in_words(found)
        said = [(each["trace"], text) for each in found for text in _said_of(each)]
        for text, traces in alike(said):
            of_all = {(each["trace"], text) for each in found} <= {*said}
            of = "" if of_all else f"{visible(few(traces, 1))}: "
            lines.append(f"{of}{visible(text)}")
    if refused:
        lines.append(f"Not identified, {len(refused)} of {len(refused) + len(found)}:")
        for text, traces in alike([*refused.items()]):
            like = f" The like holds for {len(traces) - 1} more: {visible(few(traces[1:]))}."
            lines.append(indent(visible_lines(text) + like * (len(traces) > 1), "  "))
    return "\n".join(lines)


def _said_of(found: Mapping[str, Any]) -> list[str]:
    """Return what is said of one trace of several, below their table."""
    provided = {q["provided"]: None for q in found["quantities"] if q["provided"]}
    lines = [*agreement_in_words(found), found["limits"]]
    lines += [f"Sums hold provided {condition}." for condition in provided]
    lines += [*given_in_words(found), *notes_of(found)]
    return [*lines, taken_for_granted(found)] if found["by_default"] else lines


def notes_of(found: Mapping[str, Any]) -> list[str]:
    """Return notes of a trace with their weight, and advice where its model is rejected."""
    notes = [f"{_SAID[note['weight']]}: {note['text']}" for note in found["notes"]]
    return [*notes, found["advice"]] if found["fit"] == REJECTED and found["advice"] else notes


def alike(said: Iterable[tuple[str, str]]) -> list[tuple[str, list[str]]]:
    """Return texts on traces with their names, the first of those that are alike.

    They are alike if, names and numbers apart, they are the same up to their third colon.
    """
    found: dict[str, tuple[str, list[str]]] = {}
    for trace, text in said:
        bare = _NUMBER.sub("", text.replace(trace, ""))
        _, traces = found.setdefault(":".join(bare.split(":")[:3]), (text, []))
        traces.append(trace)
    return [*found.values()]


def few(names: Sequence[str], most: int = _MOST_NAMED) -> str:
    """Return the first names, and how many more there are."""
    more = f" and {len(names) - most} more" if names[most:] else ""
    return f"{', '.join(names[:most])}{more}"


def columns_of(found: Iterable[Mapping[str, Any]]) -> dict[str, str]:
    """Return the labels of all quantities of several traces, and these with their units."""
    every = [item for each in found for item in each["quantities"]]
    return {item["quantity"]: with_unit(item["quantity"], item["unit"]) for item in every}


def taken_for_granted(found: Mapping[str, Any]) -> str:
    """Return a sentence naming defaults (gripper, protocol) that the user did not replace."""
    said = [f"the {name}" for name in found["by_default"]]
    if "protocol" in found["by_default"]:
        phases = found["assumed"]["protocol"]["phases"]
        held = (f"{phase['duration_s']:g} s at {phase['torque_Nm']:g} N m" for phase in phases)
        said[-1] += f" ({', '.join(held)})"
    whose = "of the published gripper study"
    return f"Assumed: {' and '.join(said)} {whose}; give yours with --config."


def limits_in_short(quantity: Mapping[str, Any]) -> str:
    """Return value and limits of a quantity in a few characters."""
    low, high = quantity["low"], quantity["high"]
    if quantity["verdict"] == FIT_REJECTED:
        return "rejected"
    if low is not None and high is not None:
        return with_limits(quantity["value"], low, high)
    if low is not None:
        return f"≥ {plain(low, 2)}"
    return "?" if high is None else f"≤ {plain(high, 2)}"


def load_in_words(trace: Trace, case: SampleCase, given: Mapping[str, Any]) -> str:
    """Return what was held or loaded; nothing where a config has the protocol.

    Given are the blocks of the config that the user has set.
    """
    (recording, experiment), measured = trace, case.block.measurement
    controlled, start_s = measured.instrument.controlled, measured.start_s or 0.0
    if recording.load is not None and experiment.record is not None:
        column, loads = recording.form["columns"]["load"], experiment.record[:, 1]
        if case.instrument.relative:
            loads = loads * getattr(case.block.protocol.phases[0], controlled.column)
        ends = loads.min(), loads.max()
        low, high = (plain(controlled.in_unit(end, column["unit"])) for end in ends)
        what = high if low == high else f"{low} to {high}"
        what += f" {column['unit']}" * (column["unit"] != "1")
        count = np.count_nonzero(recording.load[:, 0] >= start_s)
        rows = f"column {column['column']}, {count:,} rows"
        return f"Load: {what} from {start_s:g} s ({rows})."
    if HOLD[0] not in given:
        return ""
    number, unit = held_unit(given[HOLD[0]], controlled)
    start = "its start, as fitted," if experiment.fit_start else f"{start_s:g} s"
    held = f"{number:g} {unit}".removesuffix(" 1")
    what = f"{held} from {start} to {recording.form['last_s']:g} s"
    rise = f", reached within {given[RAMP[0]]:g} s" if RAMP[0] in given else ""
    return f"Held: {what}{rise}."


def _shrinks(recording: Recording, case: SampleCase) -> tuple[str, ...]:
    """Return a sentence if a tip was drawn back, where its contact has no such sum."""
    instrument = case.block.measurement.instrument
    if recording.load is None or instrument.read.power == instrument.controlled.power == 1:
        return ()
    time_s, loads = recording.load[recording.load[:, 0] <= recording.form["last_s"]].T
    most = np.maximum.accumulate(loads)
    falls = np.flatnonzero((most > 0.1 * most[-1]) & (loads < _STAYS * most))
    if not len(falls):
        return ()
    return (
        f"The contact shrinks from {time_s[falls[0]]:g} s on: what is said holds while it grows or "
        f"stays. Leave these readings out: --until {time_s[falls[0] - 1]:g}.",
    )


def remarks_on_hold(
    recording: Recording, case: SampleCase, given: Mapping[str, Any]
) -> tuple[str, ...]:
    """Return a sentence if a tip was drawn back, or what was held may be in another unit.

    That is if readings have a unit with a prefix, and what was held is a number.
    """
    if shrinks := _shrinks(recording, case):
        return shrinks
    read, controlled = case.instrument.read, case.instrument.controlled
    unit, held = recording.units[1], given.get(HOLD[0])
    prefix = unit.removesuffix(read.unit)
    if held is None or not (prefix and read.unit and controlled.unit) or prefix == unit:
        return ()
    number, taken = held_unit(held, controlled)
    if taken != controlled.unit or str(held).rstrip().endswith(taken):
        return ()
    likely = prefix + controlled.unit
    likely = likely if likely in controlled.units else controlled.unit
    return (
        f"The {read.name} is in {unit}, but what was held, {number:g}, is taken to be in {taken}: "
        f'say its unit, as in --hold "{number:g} {likely}".',
    )


REFERENCE = (
    "The biogrip authors, biogrip: how well a MEMS microgripper identifies the viscoelastic "
    f"parameters of a cell, version {__version__}, 2026"
)
"""How biogrip is cited, as in CITATION.cff."""

_MOST_PHASES, _MOST_REFUSED = 4, 3


def set_up_in_words(found: Mapping[str, Any]) -> list[str]:
    """Return sentences on instrument, protocol, model, noise, limits and conditions of a trace."""
    if traces := found.get("traces"):
        text = f"{len(traces)} traces of a sample were fitted together, each over its own noise."
        return [*together(map(set_up_in_words, traces)), text, _LIKELIHOOD_RATIO]
    instrument, assumed = INSTRUMENTS[found["reads"]["quantity"]], found["assumed"]
    under = "" if instrument.sweeps else f" under {_protocol(found)}"
    said = [f"{instrument.in_words}{under}."]
    if text := assumed["measurement"].get("shape"):
        shape, poisson = shape_and_sizes(text)[0], assumed["measurement"].get("poisson", 0.5)
        of_tip = f", with Poisson's ratio {poisson:g}" * shape.is_tip
        said.append(
            f"Moduli are Young's by the shape, {text}: {shape.law} ({shape.source}), where "
            f"{shape.condition}{of_tip}."
        )
    if "gripper" in assumed:
        own = assumed["gripper"]
        arms = dict.fromkeys(f"{own[it]['stiffness_Nm_per_rad']:g}" for it in ("left", "right"))
        text = f"Its arms of {own['arm_length_m']:g} m have a stiffness of {' and '.join(arms)}"
        said.append(f"{text} N m/rad, and stand at {own['reference_angle_deg']:g} degrees.")
    fixed = f" with {', '.join(found['fixed'])}" if "fixed" in found else ""
    terms = {"offset_rad": "offset", "drift_rad_per_s": "drift", "onset_s": "start"}
    along = [name for key, name in terms.items() if key in found]
    also = f", along with the instrument's {' and '.join(along)}" if along else ""
    title = found["model_title"].removesuffix(" model")
    said.append(f"The model ({title}{fixed}) was fitted by least squares{also}; {_noise(found)}.")
    level = f"{100 * found['confidence']:g} %"
    said.append(f"Intervals are {level} profile-likelihood limits. {found['limits']}")
    said += one_sided_in_words([found])
    conditions = ((q["quantity"], q["provided"]) for q in found["quantities"] if q["provided"])
    return [*said, *(f"The value of {name} holds provided {it}." for name, it in conditions)]


def _protocol(found: Mapping[str, Any]) -> str:
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


def outcome_in_words(traces: Iterable[tuple[str, str]]) -> list[str]:
    """Return sentences on what was used and what was refused, from name and fit of traces."""
    every = [*traces]
    names = {fit: [name for name, status in every if status == fit] for fit in MEANS}
    failed = [name for name, status in every if status not in MEANS]
    doubtful = len(names[DOUBTFUL])
    kept = f"{len(names[OK]) + doubtful} of {counted(len(every), 'trace')} were used"
    said = [f"{kept}{f', {doubtful} of them with a doubtful fit' * bool(doubtful)}."]
    for what, left in (("Rejected", names[REJECTED]), ("Not identified", failed)):
        if left:
            said.append(f"{what}: {len(left)} ({visible(few(left, _MOST_REFUSED))}).")
    return said


def together(several: Iterable[Sequence[str]]) -> list[str]:
    """Return what several traces say once: of sentences that begin alike, the first.

    Few say all of their numbers: "a stress of 2, 5, 10 Pa".
    """
    by_start: dict[tuple[str, ...], dict[str, None]] = {}
    for sentences in several:
        for each in sentences:
            by_start.setdefault(tuple(each.split()[:4]), {})[each] = None
    said = []
    for first, *others in by_start.values():
        words = [sentence.split() for sentence in (first, *others)]
        if len(words) > _MOST_NAMED:
            said.append(f"{first.removesuffix('.')} ({len(others)} likewise with other numbers).")
        elif len({*map(len, words)}) > 1:
            said += [first, *others]
        else:
            alike = zip(*words, strict=True)
            said.append(" ".join(", ".join(dict.fromkeys(word)) for word in alike))
    return said


def in_sentences(text: str) -> list[str]:
    """Return the sentences of a paragraph."""
    return re.split(r"(?<=\.) (?=[A-Z])", text)


def paragraph(sentences: Iterable[str], version: str = __version__) -> str:
    """Return a paragraph; at its end the software."""
    reference = REFERENCE.replace(__version__, version)
    text = " ".join([*sentences, f"Computed with biogrip {version} ({reference})."])
    return legible(text)
