"""Status of a fit: ok, doubtful or rejected, by the notes on it."""

from collections.abc import Sequence
from dataclasses import dataclass

HARMLESS, DOUBT, REJECTION = "harmless", "doubt", "rejection"
"""Weights of a note, in ascending order."""

OK, DOUBTFUL, REJECTED = "ok", "doubtful", "rejected"
"""Status of a fit by the heaviest of its notes."""

_STATUS = {HARMLESS: OK, DOUBT: DOUBTFUL, REJECTION: REJECTED}
_WEIGHTS = tuple(_STATUS)


@dataclass(frozen=True)
class Note:
    """A sentence about a fit, with its weight."""

    weight: str
    """`HARMLESS`: the results hold. `DOUBT`: they may not. `REJECTION`: they do not."""
    text: str
    """The sentence."""


def compute_status(notes: Sequence[Note]) -> str:
    """Return the status of a fit by the heaviest of its notes."""
    weights = {note.weight for note in notes}
    return _STATUS[max(weights, key=_WEIGHTS.index, default=HARMLESS)]


def order_notes(notes: Sequence[Note]) -> list[Note]:
    """Order notes by descending weight, and else as given."""
    return sorted(notes, key=lambda note: -_WEIGHTS.index(note.weight))


def find_reasons(notes: Sequence[Note]) -> list[str]:
    """Return the texts of the notes that decide a status which is not ok."""
    status = compute_status(notes)
    return [note.text for note in notes if _STATUS[note.weight] == status != OK]
