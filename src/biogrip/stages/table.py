"""Stage 5: a table, by name."""

from importlib import import_module
from pathlib import Path
from typing import Any

from biogrip.errors import BiogripError, nearest

MODULES = {
    "gripper": "inputs",
    "actuator": "inputs",
    "gene_ranges": "inputs",
    "parameter_ranges": "inputs",
    "errors": "errors",
    "all_errors": "all_errors",
    "evidence": "evidence",
    "printed_values": "printed_values",
    "linearisation": "linearisation",
    "contact": "contact",
    "methods": "methods",
    "timings": "timings",
    "verdicts": "verdicts",
    "coverage": "coverage",
    "models": "models",
    "sampling_evidence": "sampling_evidence",
    "robustness": "robustness",
}
"""The module that makes each table, in a function of the table's name."""


def run(name: str, settings: dict[str, Any], inputs: list[Path], output: Path) -> None:
    """Make a table and write it as `output` (CSV), with .md, .tex and .html beside it.

    Raises
    ------
    BiogripError
        If there is no such table, or an input cannot be read.
    """
    if name not in MODULES:
        allowed = ", ".join(MODULES)
        raise BiogripError(f"no table '{name}'.{nearest(name, MODULES)} Allowed: {allowed}.")
    from biogrip.tables.layout import write

    module = import_module(f"biogrip.tables.{MODULES[name]}")
    write(getattr(module, name)(settings, inputs), output)
