"""Columns of a recording's file, and words for them in messages."""

from dataclasses import dataclass
from pathlib import Path

from biogrip.physics.instruments import INSTRUMENTS, ROTATION, Quantity
from biogrip.terminal import visible

_MOST_LISTED = 50
_LONGEST_SHOWN = 40


@dataclass(frozen=True)
class Columns:
    """Names and units of the columns of a trace."""

    time: str
    """Name of the column of times."""
    reading: str
    """Name of that of what the instrument reads."""
    time_unit: str | None = None
    """Key of `TIME_UNITS`; None if the file has the unit."""
    reading_unit: str | None = None
    """Key of the quantity's units, likewise."""
    skip: int = 0
    """Number of lines before the header, or before its preamble."""
    scale: float = 1.0
    """Reading in its unit over the number in the column."""
    start_s: float | None = None
    """Time of the clock at which the protocol starts, if it is known."""
    by_options: bool = False
    """True if command-line options set them, false for config keys; used in messages."""
    sd: str | None = None
    """Name of the column of the readings' standard deviations, in their unit, if there is one."""
    quantity: Quantity = ROTATION
    """What is read."""
    block: int | None = None
    """Number of the block to read, from 1, where a file has several; None for the only one."""
    average_repeated: bool = False
    """True to average the readings of equal times."""
    from_s: float | None = None
    """First time of the clock to use; None for all."""
    until_s: float | None = None
    """Last time of the clock to use."""

    @property
    def unit_key(self) -> str:
        """The key that says the unit of the readings."""
        return "rotation_unit" if self.quantity == ROTATION else "reading_unit"

    @property
    def named(self) -> dict[str, str]:
        """Names of the columns by the key that says them, in the order of reading."""
        names = {"time": self.time, self.quantity.name: self.reading}
        return names if self.sd is None else {**names, "sd": self.sd}

    def said_by(self, *names: str) -> str:
        """Return the options or config keys that set something."""
        return said_by(self.by_options, *names)


def said_by(by_options: bool, *names: str) -> str:
    """Return the options or config keys that set something, for messages."""
    if by_options:
        others = set(INSTRUMENTS) - {ROTATION.name}
        options = ("reading" if name in others else name for name in names)
        return " and ".join(f"--{option.replace('_', '-')}" for option in options)
    return f"{' and '.join(names)} under measurement"


def place(path: Path, line: int | None = None, column: str | None = None) -> str:
    """Return the file, line and column at the beginning of a message."""
    where = visible(path)
    if line is not None:
        where += f", line {line}"
    if column is not None:
        where += f", column '{visible(column)}'"
    return where


def shortened(cell: str) -> str:
    """Return the beginning of a long cell, for messages."""
    return cell if len(cell) <= _LONGEST_SHOWN else cell[:_LONGEST_SHOWN] + "..."


def listed(names: list[str], most: int = _MOST_LISTED) -> str:
    """Return the names of columns, of many the first."""
    found = ", ".join(map(shortened, names[:most]))
    return found if len(names) <= most else f"{found} and {len(names)} in all"
