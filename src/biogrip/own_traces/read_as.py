"""Command-line options for reading the file of a recorded trace."""

from dataclasses import asdict, dataclass
from pathlib import Path

from biogrip.errors import BiogripError
from biogrip.identify.case_problem import CaseProblem
from biogrip.instrument.gripper import Gripper
from biogrip.products.files.traces import Measurements
from biogrip.products.stages import recording
from biogrip.study.measurement_block import COLOURED, KNOWN_NOISE
from biogrip.study.validation import measurement_problem
from biogrip.traces.recordings import Columns

_OPTIONS = {"noise_rad": "noise", "start_s": "start"}


@dataclass(frozen=True)
class ReadAs:
    """Command-line counterparts of those keys of ``measurement`` that concern a recorded trace.

    Parameters
    ----------
    time, rotation
        Names of the columns.
    time_unit, rotation_unit
        Units of the columns, where their names have none.
    skip, scale
        Lines before the header, and rotation over the number in the column.
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

    time: str = "time_s"
    rotation: str = "rotation_rad"
    time_unit: str | None = None
    rotation_unit: str | None = None
    skip: int | None = None
    scale: float | None = None
    start_s: float | None = None
    fit_start: bool | None = None
    noise_rad: float | None = None
    offset: bool | None = None
    drift: bool | None = None
    noise_model: str | None = None
    sd: str | None = None
    noise_share: float | None = None

    @property
    def block(self) -> dict[str, str | float | bool]:
        """Keys of the ``measurement`` block that are given."""
        return {key: value for key, value in asdict(self).items() if value is not None}

    @property
    def columns(self) -> Columns:
        """Names and units of the file's columns."""
        return Columns(
            self.time,
            self.rotation,
            self.time_unit,
            self.rotation_unit,
            self.skip or 0,
            1.0 if self.scale is None else self.scale,
            self.start_s,
            by_options=True,
            sd=self.sd,
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
        trace = recording.read_checked(file, gripper, problem, self.columns)
        return recording.with_fitted_onset(trace, problem)

    def check(self) -> None:
        """Refuse option values that the config would refuse.

        Raises
        ------
        BiogripError
            With the option's name.
        """
        for key, value in self.block.items():
            option = _OPTIONS.get(key, key).replace("_", "-")
            if self.noise_model == COLOURED and key in KNOWN_NOISE:
                raise BiogripError(
                    f"--{option}: is that of white noise; leave it out with {COLOURED} noise."
                )
            if self.sd is not None and key in set(KNOWN_NOISE) - {"sd"}:
                raise BiogripError(
                    f"--{option}: does not go with --sd, which says all of the noise."
                )
            if problem := measurement_problem(key, value):
                raise BiogripError(f"--{option}: {problem}")
