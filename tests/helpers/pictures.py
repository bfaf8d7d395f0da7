"""Pictures of which no more is asked than that they are drawn."""

from pathlib import Path

import numpy as np
from matplotlib.image import imread


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
