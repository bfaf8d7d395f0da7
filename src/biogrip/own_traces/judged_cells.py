"""Cells of a sheet, each identified from all its traces."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from biogrip.arrays import Array
from biogrip.errors import BiogripError
from biogrip.experiment.random_streams import stream
from biogrip.groups.group_findings import JudgedCell, judged_cell
from biogrip.groups.joint_fit import JointFit, fitted_jointly
from biogrip.identifiability.fit_status import HARMLESS, REJECTED, Note
from biogrip.identify.answer import Identification
from biogrip.identify.case_problem import CaseProblem
from biogrip.identify.identifier import best_fit
from biogrip.identify.problem import Problem
from biogrip.own_traces.one_trace import IdentifyOptions, fixed_data, study_of
from biogrip.own_traces.read_as import read_trace
from biogrip.own_traces.rows_of_sheets import with_row
from biogrip.products.files.traces import Measurements
from biogrip.products.files.verdicts import exact_data
from biogrip.products.stages.judgement import ONSET_AS_FITTED, fit_judged, notes_on_fit
from biogrip.response.noise_estimate import estimate_noise
from biogrip.study.sheet import Cell, Row
from biogrip.study.study import Case
from biogrip.terminal import visible
from biogrip.traces.late_onset import note_late_onset


@dataclass(frozen=True)
class CellResults:
    """Results of a cell.

    Parameters
    ----------
    judged
        Its profiles, of which there are none if no trace can be used.
    data
        What is said of it, as plain data; None if no trace can be used.
    skipped
        Trace, cell and reason of each trace that cannot be used.
    readings
        File of each trace that is used, by a digest of its readings.
    """

    judged: JudgedCell
    data: dict[str, Any] | None
    skipped: list[dict[str, str]]
    readings: Mapping[str, str]

    def left_out(self, trace: str, reason: str) -> "CellResults":
        """Return the cell as one whose traces cannot be used."""
        skipped = [*self.skipped, {"trace": trace, "cell": self.judged.name, "reason": reason}]
        return replace(self, data=None, skipped=skipped)


def same_readings(trace: object, before: object) -> str:
    """Return the reason for which a copy of a trace is left out."""
    return (
        f"{visible(str(trace))}: found the same readings as in {visible(str(before))}, "
        "allowed is each trace once."
    )


@dataclass(frozen=True)
class _TraceProblem:
    """A usable recorded trace: its fit problem, its case, notes, and a digest of its readings."""

    trace: Path
    problem: Problem
    case: Case
    case_problem: CaseProblem
    recorded: Measurements
    notes: list[Note]
    readings: str

    def notes_at(self, best: Array) -> list[Note]:
        """Return the notes on its noise, and on an onset that a joint best fit shows to be late."""
        time_s, rotation_rad = self.recorded.time_s, self.recorded.rotation_rad[0]
        if not self.case.may_start_late:
            return self.notes
        late = note_late_onset(self.case_problem, time_s, rotation_rad, best)
        return [*self.notes, *(replace(n, text=f"{self.trace.name}: {n.text}") for n in late)]


class CellJudge:
    """Identification of cells, which reads no trace twice.

    Parameters
    ----------
    options
        Options for all traces; its own trace is the sheet.
    confidence
        Confidence level of the limits, e.g. 0.95.
    progress
        Callback for progress.
    """

    def __init__(
        self, options: IdentifyOptions, confidence: float, progress: Callable[[int, float], None]
    ) -> None:
        self._options = options
        self._confidence = confidence
        self._progress = progress
        self._read: dict[str, Path] = {}

    def judged(self, cell: Cell) -> CellResults:
        """Identify a cell from all its traces that can be used."""
        skipped: list[dict[str, str]] = []
        usable = self._usable(cell, skipped)
        if not usable:
            return CellResults(JudgedCell(cell.name, cell.group, ()), None, skipped, {})
        fit = fitted_jointly(
            [each.problem for each in usable],
            usable[0].case_problem.searched,
            _identify(usable[0], self._progress),
            confidence=self._confidence,
            noise_rad=_known_noise(usable),
        )
        best = fit.diagnosis.likelihood.best
        fit.diagnosis.notes.extend(note for each in usable for note in each.notes_at(best))
        data = {
            "cell": cell.name,
            "group": cell.group,
            "traces": [
                {"file": str(each.trace), "noise_rad": noise}
                for each, noise in zip(usable, _noise_of(fit, usable), strict=True)
            ],
            "agreement_p": fit.agreement,
            **fixed_data(usable[0].case_problem),
            **exact_data(fit.diagnosis),
        }
        judged = judged_cell(cell.name, cell.group, fit.diagnosis)
        readings = {each.readings: str(each.trace) for each in usable}
        return CellResults(judged, data, skipped, readings)

    def _usable(self, cell: Cell, skipped: list[dict[str, str]]) -> list[_TraceProblem]:
        """Return the fit problems of the usable traces of a cell, and add others to `skipped`."""
        usable = []
        for row in cell.rows:
            try:
                usable.append(self._trace_problem(row))
            except BiogripError as error:
                name = visible(row.file)
                reason = str(error) if name in str(error) else f"{name}: {error}"
                skipped.append({"trace": str(row.file), "cell": cell.name, "reason": reason})
        return _in_common_ranges(usable)

    def _trace_problem(self, row: Row) -> _TraceProblem:
        options, trace = with_row(self._options, row), row.file
        (case,) = study_of(options).cases.values()
        recorded, case = read_trace(trace, case, options.given)
        rotation_rad = recorded.rotation_rad[0]
        # Noise never repeats: equal rotations are a copied file, and would feign agreement.
        same = sha256(rotation_rad.tobytes()).hexdigest()
        if (before := self._read.setdefault(same, trace)) != trace:
            raise BiogripError(same_readings(trace, before))
        case_problem = case.problem.weighted(recorded.sd_rad)
        problem = case_problem.of(recorded.time_s, rotation_rad)
        notes = [Note(HARMLESS, ONSET_AS_FITTED)] if case.problem.fit_start else []
        if case.problem.coloured:
            # All cells share one gripper: its calibration error is common to them, not noise.
            assumed = replace(case_problem, uncertainty={})
            fit = fit_judged(case, assumed, recorded.time_s, rotation_rad, 0)
            problem, notes = fit.problem, [*notes, *notes_on_fit(fit)]
        return _TraceProblem(trace, problem, case, case_problem, recorded, notes, same)


def _in_common_ranges(traces: list[_TraceProblem]) -> list[_TraceProblem]:
    """Return the traces of a cell with search ranges that contain those of each."""
    if len(traces) < 2:
        return traces
    low = np.min([each.problem.low for each in traces], axis=0)
    high = np.max([each.problem.high for each in traces], axis=0)
    return [replace(each, problem=replace(each.problem, low=low, high=high)) for each in traces]


def _noise_of(fit: JointFit, traces: Sequence[_TraceProblem]) -> Sequence[float]:
    """Return the noise of each trace in rad; of a rejected fit, as given or that of neighbours."""
    if fit.diagnosis.status != REJECTED:
        return fit.noise_rad
    return [
        each.case_problem.noise_rad or estimate_noise(each.recorded.rotation_rad[0])
        for each in traces
    ]


def _known_noise(traces: Sequence[_TraceProblem]) -> list[float] | None:
    levels = [each.case_problem.noise_rad for each in traces]
    known = [level for level in levels if level is not None]
    return known if len(known) == len(traces) else None


def _identify(
    case_problem: _TraceProblem, progress: Callable[[int, float], None]
) -> Callable[[Problem], Identification]:
    """Return a function that finds global optima with the seeds and budget of `identify_trace`."""
    case = case_problem.case

    def found(problem: Problem) -> Identification:
        rng = stream(case.study.study_seed, case.name, 0, "identifiability")
        return best_fit(problem, case.least_squares, rng, progress)

    return found
