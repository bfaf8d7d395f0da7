"""The map of what designed experiments tell, against the table's bounds."""

from typing import Any

import numpy as np

from biogrip.products.designed_cases import bounds
from biogrip.products.figures.designed_map import draw, samples_of
from biogrip.products.figures.style import styled
from tests.helpers.default import study_of
from tests.products.tables.test_designed import OVERLAY


def test_the_map_is_of_bounds_over_two_parameters() -> None:
    study = study_of(OVERLAY.replace("SEEDS", "0"))
    case = study.cases["endothelial_cell"]
    samples = samples_of(case)
    names = case.searched.names
    for name in ("k", "c_p"):
        assert np.all(samples[:, names.index(name)] == case.parameters[name])
    with styled():
        drawn = draw(case)
    panels: list[Any] = [
        axes for axes in drawn.axes if axes.get_title(loc="left") or axes.get_title()
    ]
    assert len(panels) == 8
    # One sample of the map by itself: what is drawn of a sample does not depend on the others.
    shown = panels[4 + names.index("k_p")].collections[0].get_array()
    assert shown is not None
    alone = 100 * bounds(case, case.experiment, samples[37:38])[0, names.index("k_p")]
    assert np.asarray(shown).ravel()[37] == alone
    for axes in panels:
        (star,) = axes.get_lines()
        assert list(star.get_xydata()[0]) == [case.parameters["k_p"], case.parameters["c"]]
