"""Hash of a product's settings, by which Snakemake notices changes."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

_LETTERS = 12
# Values derived from the config may differ in the last bits between processors.
_DIGITS = 12


def digest(settings: object) -> str:
    """Return a hash of settings that is the same on all processors.

    Parameters
    ----------
    settings
        Frozen dataclasses, mappings, sequences, arrays, text, numbers, None. Functions are ignored:
        a model is identified by its name.
    """
    text = json.dumps(_plain(settings))
    return hashlib.sha256(text.encode()).hexdigest()[:_LETTERS]


def _plain(value: object) -> Any:
    # The most frequent types come first.
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
