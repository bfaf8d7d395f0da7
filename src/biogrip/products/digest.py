"""A short fingerprint of settings, by which the workflow knows that they have changed."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

_LETTERS = 12
# What follows from the config by arithmetic may differ in its last bits between processors.
_DIGITS = 12


def digest(settings: object) -> str:
    """Return letters that change with anything that settings hold.

    Parameters
    ----------
    settings
        Frozen dataclasses, mappings, sequences, arrays, text, numbers, None. What
        can be called is passed over: a model's function is known by the model's name.
    """
    text = json.dumps(_plain(settings))
    return hashlib.sha256(text.encode()).hexdigest()[:_LETTERS]


def _plain(value: object) -> Any:
    # What there is most of comes first.
    if isinstance(value, str | int) or value is None:
        return value
    if isinstance(value, float | complex):
        return f"{value:.{_DIGITS}g}"
    if is_dataclass(value) and not isinstance(value, type):
        return [
            [field.name, _plain(getattr(value, field.name))]
            for field in fields(value)
            if field.init
        ]
    if isinstance(value, Mapping):
        return [[str(key), _plain(inner)] for key, inner in value.items()]
    if isinstance(value, list | tuple):
        return [_plain(inner) for inner in value]
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if callable(value):
        return None
    raise TypeError(f"settings cannot hold {value!r}")
