"""The instruments that there are, by what they read."""

from biogrip.instrument.creep import CREEP
from biogrip.instrument.gripper import GRIPPER
from biogrip.instrument.instrument import Instrument
from biogrip.instrument.relaxation import RELAXATION

INSTRUMENTS: dict[str, Instrument] = {
    instrument.read.name: instrument for instrument in (GRIPPER, *CREEP, *RELAXATION)
}
"""Instruments by the name of the quantity that they read."""

KINDS = tuple(dict.fromkeys(instrument.kind for instrument in INSTRUMENTS.values()))
"""Values of the config key `instrument`."""

CONTROLLED = tuple(dict.fromkeys(instrument.controlled for instrument in INSTRUMENTS.values()))
"""Quantities that protocols hold."""


def of_kind(kind: str) -> list[Instrument]:
    """Return the instruments of a kind."""
    return [each for each in INSTRUMENTS.values() if each.kind == kind]
