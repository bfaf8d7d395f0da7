"""Stage 2 for recorded traces: conversion of the user's file to a measurement."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np

from biogrip.arrays import BoolArray
from biogrip.digits import counted, plain
from biogrip.errors import BiogripError
from biogrip.fit.any_sample import proportional_deviations
from biogrip.fit.experiment import Experiment
from biogrip.fit.fitted_onset import OnsetFits, estimate_onset
from biogrip.physics.protocol import Course
from biogrip.physics.whitening import MOST_SAMPLES
from biogrip.records.traces import Measurements, write_measurements
from biogrip.study.study import Case
from biogrip.terminal import warn
from biogrip.traces.columns import Columns, place
from biogrip.traces.plausibility import check_recording
from biogrip.traces.reader import Recording, read_recording


def record(case: Case, recorded: Path, measurements: Path) -> None:
    """Read, check and convert the user's file; errors name file, line and column."""
    if case.columns.load is not None:
        raise BiogripError(f"{place(recorded)}: measurement.load is only for biogrip identify.")
    trace = read_checked(recorded, case.problem, case.columns)
    trace = with_fitted_onset(trace, case.problem)
    for note in notes_on_recording(trace):
        warn(f"{place(recorded)}: {note}")
    write_measurements(measurements, trace)


def read_checked(
    recorded: Path,
    problem: Experiment,
    columns: Columns,
) -> Measurements:
    """Read a recorded trace, and refuse one that is impossible with its gripper and protocol."""
    trace = read_recording(recorded, columns)
    weighted = columns.sd is not None or problem.noise_share is not None
    if (problem.coloured or weighted) and len(trace.time_s) > MOST_SAMPLES:
        raise BiogripError(
            f"{place(recorded)}: found {len(trace.time_s)} samples, allowed are at most "
            f"{MOST_SAMPLES} with {'weights' if weighted else 'a coloured noise model'}: average "
            "neighbouring ones."
        )
    onset_s = columns.start_s
    if problem.fit_start:
        onset_s = estimate_onset(problem, trace.time_s, trace.readings)
    if onset_s is not None:
        trace = without_padding(replace(trace, time_s=trace.time_s - onset_s))
    at_steps: tuple[float, ...] = ()
    # What a gripper reads does not jump: dampers hold its arms.
    if not problem.instrument.has_jaws:
        trace, at_steps = without_steps(trace, problem.torque, onset_s or 0.0)
    if len(trace.time_s) <= problem.unknowns:
        raise BiogripError(
            f"{place(recorded)}: found {len(trace.time_s)} readings for {problem.unknowns} unknown "
            "parameters; allowed are more readings than parameters, or a simpler model."
        )
    noise_sd = _typical_noise(trace, problem)
    suspicion = check_recording(trace, problem, noise_sd, onset_s)
    sd = trace.sd
    if problem.noise_share is not None:
        sd = proportional_deviations(problem, trace.time_s, trace.readings)
    return Measurements(
        trace.time_s,
        None,
        {0: trace.readings},
        gaps=trace.without_number,
        sd=sd,
        suspicion=suspicion,
        onset_s=onset_s,
        at_steps=at_steps,
        form=trace.form,
    )


def without_steps(
    trace: Recording, protocol: Course, onset_s: float
) -> tuple[Recording, tuple[float, ...]]:
    """Leave out readings at the very instant of a step, and return their times by the file's clock.

    Without inertia a sample may jump there, and nothing tells on which side a reading was taken. A
    damper's force jumps with the rate of a deformation, too.
    """
    at = np.isin(protocol.snapped(trace.time_s), protocol.jumps_s)
    return _part(trace, ~at), tuple((trace.time_s[at] + onset_s).tolist())


def _part(trace: Recording, kept: BoolArray) -> Recording:
    return replace(
        trace,
        time_s=trace.time_s[kept],
        readings=trace.readings[kept],
        lines=trace.lines[kept],
        sd=None if trace.sd is None else trace.sd[kept],
    )


def without_padding(trace: Recording) -> Recording:
    """Leave out the same number again and again before the protocol, which is no measurement.

    The last of them stays: it tells that the protocol had not yet started.
    """
    differs = np.flatnonzero(trace.readings != trace.readings[0])
    first = max(min([*differs[:1], np.count_nonzero(trace.time_s < 0)]) - 1, 0)
    kept = np.arange(len(trace.time_s)) >= first
    return replace(_part(trace, kept), without_number=trace.without_number + first)


def with_fitted_onset(trace: Measurements, problem: Experiment) -> Measurements:
    """Return a recording with its estimated onset replaced by that of a fit, if that is wanted."""
    if not problem.fit_start or trace.onset_s is None:
        return trace
    problem = problem.weighted(trace.sd)
    later_s = OnsetFits(problem, trace.time_s, trace.readings[0]).best(0.0).onset_s
    return replace(trace, time_s=trace.time_s - later_s, onset_s=trace.onset_s + later_s)


def _typical_noise(trace: Recording, problem: Experiment) -> float | None:
    """Return the standard deviation of the noise, if it is given; typical where it differs."""
    if trace.sd is not None:
        return float(np.median(trace.sd))
    if problem.noise_share is not None:
        largest = float(np.max(np.abs(trace.readings)))
        return math.hypot(problem.noise_share * largest, problem.noise_sd or 0.0)
    return problem.noise_sd


def notes_on_recording(trace: Measurements) -> list[str]:
    """Return notes on rows of a recording that were left out, and on a hardly plausible one."""
    notes = [trace.suspicion] if trace.suspicion else []
    if trace.gaps:
        rows = f"{counted(trace.gaps, 'row')} of {len(trace.time_s) + trace.gaps}"
        notes.append(f"Left out for want of a number: {rows}.")
    form = trace.form
    if "averaged" in form:
        notes.append(f"Averaged at repeated times: {counted(form['averaged'], 'reading')}.")
    if "outside" in form:
        notes.append(f"Left out by from_s and until_s: {counted(form['outside'], 'reading')}.")
    if "others" in form:
        notes.append(f"Left out, for rows asks for others: {counted(form['others'], 'row')}.")
    if trace.load_noise:
        column = form["columns"]["load"]["column"]
        notes.append(
            f"Smoothed out of {column}, since the readings do not follow it: what scatters from "
            f"row to row by {plain(100 * trace.load_noise, 2)} % of the largest. What is left "
            "counts as exact."
        )
    if trace.at_steps:
        times = ", ".join(f"{time_s:.6g} s" for time_s in trace.at_steps)
        notes.append(
            "Left out where a sample may jump, at a step or where the rate of a deformation jumps, "
            "since nothing tells on which side they were taken: "
            f"{counted(len(trace.at_steps), 'reading')}, at {times}."
        )
    return notes
