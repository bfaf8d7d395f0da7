"""A diagnosis as plain data in SI units: what JSON files, tables and pages have of it."""

from dataclasses import asdict
from typing import Any

import numpy as np

from biogrip.digits import counted, plain, round_increase
from biogrip.fit.experiment import Experiment
from biogrip.judging.diagnosis import Diagnosis
from biogrip.judging.doubts import REJECTED, REJECTION, find_reasons, order_notes
from biogrip.judging.linearity import NOT_LINEAR
from biogrip.judging.profiles import FIT_REJECTED, Finding
from biogrip.physics.noise import within
from biogrip.physics.response import simulated_response
from biogrip.traces.reader import Recording


def judged_data(diagnosis: Diagnosis) -> dict[str, Any]:
    """Return status, quantities and notes; only increases of chi^2 are rounded.

    A rejected fit determines nothing: its quantities have the best fit as value, no limits, and
    the verdict `FIT_REJECTED`; its misfit tells no noise. Notes that neither reject it nor are on
    reading the file speak of results that it does not have, and are left out.
    """
    likelihood, notes = diagnosis.likelihood, diagnosis.notes
    rejected = diagnosis.status == REJECTED
    if rejected:
        remarks = diagnosis.recording.remarks() if diagnosis.recording else []
        notes = [note for note in notes if note.weight == REJECTION or note.text in remarks]
    ordered = order_notes(notes)
    trades = [
        {"members": list(trade.members), "words": trade.words(), **_finding(trade.finding)}
        for trade in ([] if rejected else diagnosis.trades)
    ]
    return {
        "fit": diagnosis.status,
        "reasons": find_reasons(ordered),
        "samples": likelihood.problem.residuals.samples,
        "misfit_rad": likelihood.misfit,
        "noise_rad": None if rejected else likelihood.noise_sd,
        "scatter_rad": likelihood.problem.residuals.noise_scale,
        "threshold": likelihood.threshold,
        "certainty": likelihood.certainty,
        "quantities": [_finding(finding, rejected=rejected) for finding in diagnosis.findings],
        "moves": [asdict(move) for move in diagnosis.moves],
        "trades": trades,
        **({"jaw_force": dict(vars(diagnosis.grip))} if diagnosis.grip else {}),
        "notes": [{"weight": note.weight, "text": note.text} for note in ordered],
    }


def _finding(finding: Finding, *, rejected: bool = False) -> dict[str, Any]:
    quantity = finding.quantity
    best = f"{plain(finding.value)} {quantity.unit}".rstrip()
    no_use = f"fit rejected: the best fit, {best}, is not to be used"
    return {
        "quantity": quantity.label,
        "symbol": quantity.symbol,
        "unit": quantity.unit,
        "verdict": FIT_REJECTED if rejected else finding.verdict,
        "value": finding.value,
        "low": None if rejected else finding.low,
        "high": None if rejected else finding.high,
        "excluded": [] if rejected else [[*ends] for ends in finding.gaps],
        "deviation": finding.deviation,
        "provided": quantity.provided,
        "in_words": no_use if rejected else finding.words(),
        "profile": {
            "values": np.exp(finding.log_values).tolist(),
            "increases": [round_increase(increase) for increase in finding.increases.tolist()],
        },
    }


def trace_data(diagnosis: Diagnosis) -> dict[str, Any]:
    """Return all that `identify` says of a trace: `judged_data`, and what it stands on."""
    recording, experiment = diagnosis.identified
    fit, models = diagnosis.fit, diagnosis.models
    assert fit is not None
    assert models is not None
    instrument, said = experiment.instrument, judged_data(diagnosis)
    rejected = said["fit"] == REJECTED
    spread_s = _spread_s(recording, experiment)
    # No linear model is advised for a sample that is not linear.
    linear = all(note.about != NOT_LINEAR for note in diagnosis.notes)
    return {
        "model": experiment.model.name,
        "model_title": experiment.model.title,
        "confidence": experiment.confidence,
        "instrument": instrument.kind,
        "reads": {"quantity": instrument.read.name, "unit": instrument.read.unit},
        **_fixed(experiment),
        "limits": _what_limits_include(experiment),
        **_fitted_along(diagnosis, recording, experiment),
        **said,
        "noise_model": fit.noise_data(),
        **models.data(rejected=rejected),
        **({} if linear else {"advice": None, "preferred_model": None}),
        "moduli": None if rejected else moduli_between(*spread_s, diagnosis),
    }


def _spread_s(recording: Recording, experiment: Experiment) -> tuple[float, float]:
    """Return the first interval and the duration, or inverse frequencies of a sweep."""
    time_s, (first_s, last_s) = recording.time_s, experiment.torque.spread_s(recording.time_s)
    if not experiment.instrument.sweeps:
        first_s = float(np.diff(time_s)[np.searchsorted(time_s[:-2], 0.0)])
    return first_s, last_s


def moduli_between(first_s: float, last_s: float, diagnosis: Diagnosis) -> dict[str, list[float]]:
    """Return moduli of the fit at angular frequencies between the inverses of two times."""
    experiment, ends = diagnosis.experiment, (1 / last_s, 1 / first_s)
    assert experiment is not None
    best = np.exp(diagnosis.likelihood.best).tolist()
    values = dict(zip(experiment.searched.names, best, strict=True))
    table = experiment.model.moduli({**experiment.fixed, **values}, np.geomspace(*ends, 31))
    return {name: column.tolist() for name, column in table.items()}


def _fixed(experiment: Experiment) -> dict[str, list[str]]:
    """Return values and units of fixed parameters in words, or nothing if there are none."""
    units = {p.name: p.unit for p in experiment.model.parameters}
    fixed = experiment.fixed.items()
    words = [f"{name} = {value:g} {units[name]}".rstrip() for name, value in fixed]
    return {"fixed": words} if words else {}


def _what_limits_include(experiment: Experiment) -> str:
    """Return a sentence on the part that uncertainties of gripper and protocol have in limits."""
    jaws, controlled = experiment.instrument.has_jaws, experiment.instrument.controlled.name
    exact = f"otherwise the {'gripper' if jaws else controlled} is taken as exact."
    known = [(part, key) for part, key, _ in experiment.uncertain if not part.endswith("steps")]
    keys = [f"{part}.{key}".removesuffix(".share") for part, key in known]
    said, allowed = [], []
    if jaws and keys:
        said.append(f"Limits include uncertainties of the gripper: {', '.join(keys)}.")
    if steps := len(experiment.uncertainty.get("steps", {})):
        between = f"of the {controlled} anywhere between the two rows of its record"
        allowed.append(f"{counted(steps, 'step')} {between}")
    if experiment.load_errors is not None:
        allowed.append(f"what is left of noise in the record of the {controlled}")
    if allowed:
        said.append(f"Limits allow for {' and for '.join(allowed)}; {exact}")
    return " ".join(said) or f"Limits are statistical only: {exact.removeprefix('otherwise ')}"


def _fitted_along(
    diagnosis: Diagnosis, recording: Recording, experiment: Experiment
) -> dict[str, Any]:
    """Return onset, offset and drift of the instrument in the best fit, as far as fitted."""
    found: dict[str, Any] = {}
    if experiment.fit_start:
        found["onset_s"] = float(recording.onset_s or 0.0)
    if diagnosis.onset_limits_s:
        found["onset_limits_s"] = [found["onset_s"] + end_s for end_s in diagnosis.onset_limits_s]
    if experiment.fit_contact:
        from biogrip.identify.contact import depth_limits

        value, *limits = depth_limits(diagnosis)
        found |= {"contact_m": value, "contact_limits_m": limits}
    if not experiment.offset_and_drift:
        return found
    time_s, measured = recording.time_s, recording.readings
    network = experiment.searched.network(np.exp(diagnosis.likelihood.best))
    simulated = simulated_response(experiment.gripper, network, experiment.torque, time_s)[0]
    added = within(experiment.nuisance(time_s), measured - simulated, experiment.sd)
    slope = float((added[-1] - added[0]) / (time_s[-1] - time_s[0]))
    if experiment.offset:
        found["offset_rad"] = float(added[0] - slope * time_s[0])
    if experiment.drift:
        found["drift_rad_per_s"] = slope
    return found
