"""A short fingerprint of settings, by which the workflow knows that they have changed.

What can be called in them, as the network of a sample model or a method of a value's class, is
told by the source files of the module that it stands in.
"""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from functools import cache
from typing import Any

import numpy as np

from biogrip.experiment.sample import CANDIDATES, Sample
from biogrip.products.source_files import fingerprint, followed
from biogrip.products.uses import Used

_LETTERS = 12
# Values derived from the config may differ in the last bits between processors.
_DIGITS = 12


def digest(settings: object) -> str:
    """Return a hash of settings that is the same on all processors.

    Settings are views, frozen dataclasses, mappings, sequences, arrays, text, numbers, None, and
    functions of the package.
    """
    code: set[str] = set()
    text = json.dumps(_plain(settings, code))
    if code:
        text += fingerprint(*sorted(code))
    return hashlib.sha256(text.encode()).hexdigest()[:_LETTERS]


def modules_in(settings: object) -> set[str]:
    """Modules of what can be called in settings: code that a job with them is made by."""
    code: set[str] = set()
    _plain(settings, code)
    return code


def _plain(value: object, code: set[str]) -> Any:
    # What there is most of comes first.
    if isinstance(value, str | int) or value is None:
        return value
    if isinstance(value, float | complex):
        return f"{value:.{_DIGITS}g}"
    if is_dataclass(value) and not isinstance(value, type):
        if followed(module := type(value).__module__):
            code.add(module)
        own = [
            [field.name, _plain(getattr(value, field.name), code)]
            for field in fields(value)
            if field.init
        ]
        if isinstance(value, Sample) and value.candidate in CANDIDATES:
            model, modules = _of_model(value)
            code |= modules
            own.append(["model", model])
        return own
    if isinstance(value, Used):
        value = vars(value)
    if isinstance(value, Mapping):
        return [[str(key), _plain(inner, code)] for key, inner in value.items()]
    if isinstance(value, list | tuple):
        return [_plain(inner, code) for inner in value]
    if isinstance(value, np.ndarray):
        return _plain(value.tolist(), code)
    if callable(value):
        module = str(getattr(value, "__module__", ""))
        if module.startswith("biogrip."):
            code.add(module)
        return None
    raise TypeError(f"settings cannot hold {value!r}")


@cache
def _of_model(sample: Sample) -> tuple[Any, set[str]]:
    code: set[str] = set()
    return _plain(sample.model, code), code
