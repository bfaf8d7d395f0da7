"""Springs, dampers and springpots of a sample model, drawn as text.

What is parallel and what is in series is found from the model's network alone:

1. An element that makes the sample rigid when it is, is parallel to all else.
2. An element whose loss takes others out of the response is in series with these.
3. What takes none out is parallel to what goes with it in a branch.
"""

from functools import cache

import numpy as np

from biogrip.arrays import Array
from biogrip.physics.sample_model import SampleModel, complex_modulus

_SIGNS = {"stiffness": "/\\/\\", "damping": "[==]", "springpot": "<>"}
# What an element is multiplied by to be gone, or rigid; a change that is none; where it is seen.
_GONE, _RIGID, _UNSEEN, _OMEGA = 1e-9, 1e9, 1e-4, np.array([0.03, 0.3, 3.0])


@cache
def sketched(model: SampleModel) -> str:
    r"""Return a model's elements in a line, as ``─k/\/\─c[==]─ ∥ ─k_p/\/\─`` of Zener's solid.

    Parallel parts are between bars. No parameter of the model is fixed.
    """
    signs = {p.name: f"{p.name}{_SIGNS[p.kind]}" for p in model.parameters if p.kind in _SIGNS}
    parts = []
    while signs:
        first = next(iter(signs))
        branch = [first, *_in_series_with(first, model)]
        chain = [name for name in branch if _in_series_with(name, model)] or branch
        beside = " ∥ ".join(signs[name] for name in branch if name not in chain)
        row = [signs[name] for name in chain] + [f"({beside})"] * bool(beside)
        parts.append(f"─{'─'.join(row)}─")
        signs = {name: sign for name, sign in signs.items() if name not in branch}
    return " ∥ ".join(parts)


def _in_series_with(element: str, model: SampleModel) -> list[str]:
    """Return the elements of which the response does not depend when one is gone."""
    if np.all(_modulus(model, {element: _RIGID}) > _RIGID**0.5):
        return []
    gone, size = _modulus(model, {element: _GONE}), _modulus(model, {})
    others = [p.name for p in model.parameters if p.kind in _SIGNS and p.name != element]
    changes = {name: _modulus(model, {element: _GONE, name: 2.0}) - gone for name in others}
    return [name for name, change in changes.items() if np.all(abs(change) < _UNSEEN * size)]


def _modulus(model: SampleModel, times: dict[str, float]) -> Array:
    """Return the dynamic modulus of the model's example with some elements multiplied, (n,)."""
    values = [times.get(n, 1.0) * x for n, x in zip(model.names, model.example, strict=True)]
    return np.hypot(*complex_modulus(model.network([values]), _OMEGA))[0]
