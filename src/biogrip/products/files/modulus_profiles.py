"""Moduli of a case over frequency with their limits, as JSON."""

from pathlib import Path
from typing import Any

from biogrip.products.files.json_object import read_object

PATH = "results/identifiability/moduli/{case}.json"


def read_modulus_profiles(path: Path) -> dict[str, Any]:
    """Read a file of moduli."""
    return read_object(path, "moduli", {"fit", "unit", "moduli"}, "holds no moduli")
