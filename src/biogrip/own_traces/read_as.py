"""How the file of a recorded trace is to be read."""

from dataclasses import asdict, dataclass
from pathlib import Path

from biogrip.errors import BiogripError
from biogrip.identify.case_problem import CaseProblem
from biogrip.instrument.gripper import Gripper
from biogrip.products.files.traces import Measurements
from biogrip.products.stages import recording
from biogrip.study.measurement_block import COLOURED
from biogrip.study.validation import value_problem
from biogrip.traces.recordings import Columns

_OPTIONS = {"noise_rad": "noise"}


@dataclass(frozen=True)
class ReadAs:
    """Keys of the config's ``measurement`` block that concern a trace, as options give them.

    Parameters
    ----------
    time, rotation
        Names of the columns.
    time_unit, rotation_unit
        Where the columns' names have none.
    noise_rad
        Standard deviation of the noise, if it is known.
    offset, drift
        Whether the instrument may have added a constant, and a drift linear in time.
    noise_model
        What noise is taken for; ``white`` or ``coloured``.
    """

    time: str = "time_s"
    rotation: str = "rotation_rad"
    time_unit: str | None = None
    rotation_unit: str | None = None
    noise_rad: float | None = None
    offset: bool = False
    drift: bool = False
    noise_model: str | None = None

    @property
    def block(self) -> dict[str, str | float | bool]:
        """The keys that are given."""
        return {key: value for key, value in asdict(self).items() if value is not None}

    @property
    def columns(self) -> Columns:
        """Where in its file a trace stands."""
        units = self.time_unit, self.rotation_unit
        return Columns(self.time, self.rotation, *units, by_options=True)

    def read(self, file: Path, gripper: Gripper, problem: CaseProblem) -> Measurements:
        """Read a trace, and refuse what its gripper and protocol cannot have given.

        Parameters
        ----------
        file
            CSV file.
        gripper, problem
            With what and under what it was recorded.

        Raises
        ------
        BiogripError
            With file, line and column, if the trace cannot be used.
        """
        return recording.read_checked(recording.Settings(gripper, problem, self.columns), file)

    def check(self) -> None:
        """Refuse what the config would refuse.

        Raises
        ------
        BiogripError
            With the option.
        """
        if self.noise_model == COLOURED and self.noise_rad is not None:
            raise BiogripError(
                f"--noise: is that of white noise; leave it out with {COLOURED} noise."
            )
        for key, value in self.block.items():
            if problem := value_problem(("measurement", key), value):
                option = _OPTIONS.get(key, key).replace("_", "-")
                raise BiogripError(f"--{option}: {problem}")
