"""Pictures of which no more is asked than that they are drawn."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.image import imread

from biogrip.figures import declared
from biogrip.files import atomic_write

_DOTS_PER_INCH = 60


@contextmanager
def in_coarse_dots() -> Iterator[None]:
    """Save figures quickly: as PNG in coarse dots, and as PDF without anything."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(declared, "save", _save_coarsely)
        yield


def _save_coarsely(figure: Figure, png: Path) -> None:
    with atomic_write(png) as scratch:
        figure.savefig(scratch, format="png", dpi=_DOTS_PER_INCH)
    with atomic_write(png.with_suffix(".pdf")) as scratch:
        scratch.touch()


def assert_drawn(path: Path) -> None:
    """See that a figure is not blank, and that something in colour goes across it.

    What figures show is pinned (`tests/figures/test_pinned.py`); here it is that
    other data, too, come to a picture, and are not drawn outside of it.
    """
    picture = np.asarray(imread(path))[..., :3]
    ink = np.ptp(picture, axis=2) > 0.1
    rows, columns = np.flatnonzero(ink.any(axis=1)), np.flatnonzero(ink.any(axis=0))
    assert len(rows), f"{path.name}: nothing is drawn in colour"
    height, width = ink.shape
    assert np.ptp(rows) > 0.02 * height, f"{path.name}: what is drawn is too low"
    assert np.ptp(columns) > 0.4 * width, f"{path.name}: what is drawn is too narrow"
