"""Drawings of springs and dampers, read as circuits, against impedances drawn by hand."""

import re

import pytest

from biogrip.physics.models import MODELS, Sample
from biogrip.physics.sample_model import sketched
from tests.helpers.laplace import IMPEDANCES, series

_OMEGA = (0.02, 0.7, 11.0)


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("omega", _OMEGA)
def test_a_drawing_is_the_circuit_of_its_model(name: str, omega: float) -> None:
    model, s = MODELS[name], 1j * omega
    values = dict(zip(model.names, model.example, strict=True))

    def element(text: str) -> complex:
        symbol, sign = re.fullmatch(r"(\w+?)(/\\/\\|\[==\]|<>)", text).groups()  # type: ignore[union-attr]
        power = {"/\\/\\": 0.0, "[==]": 1.0, "<>": values.get(symbol.partition("_")[2], 0.0)}
        return complex(values[symbol] * s ** power[sign])

    def part(text: str) -> complex:
        if text.startswith("("):
            return sum(map(element, text.strip("()").split(" ∥ ")))
        return element(text)

    # Bars within brackets are of an element of a branch.
    branches = re.split(r" ∥ (?![^(]*\))", sketched(model))
    drawn = sum(complex(series(*map(part, branch.strip("─").split("─")))) for branch in branches)
    assert drawn == pytest.approx(complex(IMPEDANCES[name](s, *model.example)), rel=1e-12)


def test_every_branch_is_drawn() -> None:
    said = sketched(Sample("generalized_maxwell", 3).model)
    assert (
        said == r"─k_1/\/\─c_1[==]─ ∥ ─k_2/\/\─c_2[==]─ ∥ ─k_3/\/\─c_3[==]─ ∥ ─k_p/\/\─ ∥ ─c_p[==]─"
    )
