"""Command-line options for reading the file of a recorded trace."""

import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from biogrip.errors import BiogripError, nearest
from biogrip.fit.case_problem import CaseProblem
from biogrip.identify.search_ranges import with_own_ranges
from biogrip.physics.gripper import Gripper
from biogrip.physics.instruments import ROTATION, Quantity
from biogrip.records.traces import Measurements
from biogrip.stages import recording
from biogrip.study.measurement_block import COLOURED, KNOWN_NOISE, READINGS, MeasurementBlock
from biogrip.study.messages import checked
from biogrip.study.study import Case
from biogrip.traces.columns import Columns
from biogrip.traces.reader import Recognised

_USUAL_TIME = "time_s"
# Options that are no keys of ``measurement``.
_ELSEWHERE = ("hold", "reading")
_OPTIONS = {"noise_rad": "noise", "start_s": "start", "from_s": "from", "until_s": "until"}


@dataclass(frozen=True)
class ReadAs:
    """Command-line counterparts of those keys of ``measurement`` that concern a recorded trace.

    Parameters
    ----------
    time, rotation
        Names of the columns, by default ``time_s`` and ``rotation_rad``.
    reading
        Quantity that another instrument reads, and the name of its column; by default that of the
        quantity with its unit, as in ``modulus_Pa``.
    time_unit, rotation_unit, reading_unit
        Units of the columns, where their names have none; the last is of other readings than
        rotations.
    hold
        What is held from 0 to the end of the trace, SI units, where no config says so.
    skip, scale
        Lines before the header, and rotation over the number in the column.
    block
        Number of the block of a file that has several.
    from_s, until_s
        First and last time of the clock to use.
    average_repeated
        If true, average the readings of equal times.
    start_s, fit_start
        Time of the clock at which the protocol starts, or true to fit it along.
    noise_rad
        Standard deviation of the noise, if it is known.
    offset, drift
        If true, fit a constant or a linear drift of the instrument along; if None, as by default.
    noise_model
        Noise model, ``white`` or ``coloured``.
    sd
        Name of a column of standard deviations.
    noise_share
        Standard deviation of the noise as a share of the rotation.
    """

    time: str | None = None
    rotation: str | None = None
    reading: tuple[str, str] | None = None
    hold: float | None = None
    time_unit: str | None = None
    rotation_unit: str | None = None
    reading_unit: str | None = None
    skip: int | None = None
    scale: float | None = None
    block: int | None = None
    average_repeated: bool | None = None
    from_s: float | None = None
    until_s: float | None = None
    start_s: float | None = None
    fit_start: bool | None = None
    noise_rad: float | None = None
    offset: bool | None = None
    drift: bool | None = None
    noise_model: str | None = None
    sd: str | None = None
    noise_share: float | None = None

    @property
    def given(self) -> dict[str, str | float | bool]:
        """Keys of the ``measurement`` block that are given."""
        given = {key: value for key, value in asdict(self).items() if value is not None}
        named = dict([self.reading]) if self.reading else {}
        return {key: value for key, value in given.items() if key not in _ELSEWHERE} | named

    def over(self, measurement: Mapping[str, Any]) -> dict[str, Any]:
        """Return the ``measurement`` block of a config with the options laid over it.

        An onset that is given replaces one that is fitted, and the reverse; so does a reading.
        """
        return laid_over({"time": _USUAL_TIME, **measurement}, self.given)

    def with_config(self, measurement: Mapping[str, Any]) -> "ReadAs":
        """Return the options with those keys of a ``measurement`` block that are valid."""
        valid = {key: value for key, value in measurement.items() if not _problem(key, value)}
        named = [(name, valid[name]) for name in READINGS if name in valid]
        own = {key: valid[key] for key in valid if key in asdict(self)}
        return replace(self, **own, reading=named[0] if named else self.reading)

    def columns(self, read: Quantity) -> Columns:
        """Return names and units of the columns of a file with readings of a quantity."""
        is_rotation = read == ROTATION
        named = dict([self.reading]) if self.reading else {ROTATION.name: self.rotation}
        return Columns(
            self.time or _USUAL_TIME,
            named.get(read.name) or read.column,
            self.time_unit,
            self.rotation_unit if is_rotation else self.reading_unit,
            1.0 if self.scale is None else self.scale,
            self.start_s,
            by_options=True,
            sd=self.sd,
            quantity=read,
            block=self.block,
            average_repeated=bool(self.average_repeated),
            from_s=self.from_s,
            until_s=self.until_s,
        )

    def read(self, file: Path, gripper: Gripper, problem: CaseProblem) -> Measurements:
        """Read a trace, and refuse one that is impossible with its gripper and protocol.

        Parameters
        ----------
        file
            CSV file.
        gripper, problem
            Gripper and protocol it was recorded with.

        Raises
        ------
        BiogripError
            With file, line and column, if the trace cannot be used.
        """
        trace = recording.read_checked(
            file, gripper, problem, self.columns(problem.instrument.read)
        )
        return recording.with_fitted_onset(trace, problem)

    def check(self) -> None:
        """Refuse option values that the config would refuse.

        Raises
        ------
        BiogripError
            With the option's name.
        """
        if self.reading and self.reading[0] not in READINGS:
            allowed = [name for name in READINGS if name != ROTATION.name]
            raise BiogripError(
                f"--reading: found '{self.reading[0]}', allowed are {', '.join(allowed)}."
                + nearest(self.reading[0], allowed)
            )
        if self.reading and self.rotation is not None:
            raise BiogripError("--rotation: does not go with --reading; leave out one of them.")
        if self.hold is not None and (self.hold == 0 or not math.isfinite(self.hold)):
            raise BiogripError(f"--hold: found {self.hold:g}, allowed is another number.")
        for key, value in self.given.items():
            option = _OPTIONS.get(key, key).replace("_", "-")
            if self.noise_model == COLOURED and key in KNOWN_NOISE:
                raise BiogripError(
                    f"--{option}: is that of white noise; leave it out with {COLOURED} noise."
                )
            if self.sd is not None and key in set(KNOWN_NOISE) - {"sd"}:
                raise BiogripError(
                    f"--{option}: does not go with --sd, which says all of the noise."
                )
            if problem := _problem(key, value):
                raise BiogripError(f"--{option}: {problem}")
        if self.scale == 0:
            raise BiogripError("--scale: found 0, allowed is another number.")


def laid_over(measurement: Mapping[str, Any], given: Mapping[str, Any]) -> dict[str, Any]:
    """Return a ``measurement`` block with keys of another laid over it.

    An onset that is given replaces one that is fitted, and the reverse; so does a reading.
    """
    replaced: set[str] = set()
    for one_of in ({"start_s", "fit_start"}, {*READINGS}):
        replaced |= one_of if one_of & given.keys() else set()
    return {key: value for key, value in measurement.items() if key not in replaced} | {**given}


def read_trace(
    file: Path,
    case: Case,
    given: Mapping[str, Any],
    show: Callable[[str], None] = lambda _: None,
) -> tuple[Measurements, Case]:
    """Read a trace by the options and the config that a case holds, and find its search ranges.

    Parameters
    ----------
    file
        CSV file.
    case
        The case of the trace.
    given
        Blocks of the user's, see `IdentifyOptions.given`.
    show
        Function that is given a table of what was recognised in an unusual file.

    Returns
    -------
    Measurements
        The trace, from its onset on; that is fitted, if at all, in the search ranges of the case.
    Case
        The case with search ranges that follow from the trace, where the config gives none.

    Raises
    ------
    BiogripError
        With file, line and column, if the trace cannot be used.
    """
    columns = replace(case.columns, by_options=True)

    def show_unusual(form: Recognised) -> None:
        if not form.is_usual(columns):
            show(form.in_words(file))

    trace = recording.read_checked(file, case.gripper, case.problem, columns, show_unusual)
    case = with_own_ranges(case, trace, given)
    return recording.with_fitted_onset(trace, case.problem), case


def _problem(key: str, value: Any) -> str | None:
    """Return what is wrong with the value of a key of a measurement, whatever others lack."""
    found = checked(MeasurementBlock, {key: value})[1]
    return next((text for path, text in found if path == (key,)), None)
