"""Moduli over frequency with the limits that one trace sets them, case by case."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from biogrip.experiment.network import complex_modulus
from biogrip.identifiability.moduli import LOSS, STORAGE
from biogrip.products.files.modulus_profiles import PATH, read_modulus_profiles
from biogrip.products.product import of_cases
from biogrip.products.tables.declared import table
from biogrip.products.tables.layout import Cell, Column, Table
from biogrip.products.uses import each, from_study, with_moduli
from biogrip.study.study import Case, Study

_COLUMNS = (
    Column("case", "Case"),
    Column("modulus", "Modulus"),
    Column("frequency_rad_per_s", "Angular frequency (rad/s)"),
    Column("unit", "Unit"),
    Column("target", "Target"),
    Column("fit", "Fit"),
    Column("value", "Best fit"),
    Column("low", "Limits from"),
    Column("high", "to"),
    Column("half_width_percent", "Half their distance, % of the best fit", 2),
)


def modulus_bands(study: Study, limits: list[Path]) -> Table:
    """List the moduli of all cases with their limits."""
    rows = [
        row
        for path, (name, case) in zip(limits, study.cases.items(), strict=True)
        for row in _rows(name, case, path)
    ]
    caption = (
        "Storage modulus G' and loss modulus G'' of the best fit to one trace of each case, over "
        "frequency, with confidence limits by the profile likelihood of each. Frequencies reach a "
        "decade beyond the experiment's. Without a limit, the trace sets none on that side, or the "
        "fit is rejected."
    )
    return Table(caption, _COLUMNS, rows)


def _rows(name: str, case: Case, limits: Path) -> Iterator[tuple[Cell, ...]]:
    found = read_modulus_profiles(limits)
    network = case.sample.model.sample(case.parameters) if case.parameters else None
    for part, symbol in ((STORAGE, "G'"), (LOSS, "G''")):
        for row in found["moduli"]:
            if row["part"] != part:
                continue
            target, low, high, best = None, row["low"], row["high"], row["value"]
            if network is not None:
                parts = complex_modulus(network, np.array([row["rad_per_s"]]))
                target = float(parts[part == LOSS][0, 0])
            both = low is not None and high is not None
            yield (
                name,
                symbol,
                row["rad_per_s"],
                found["unit"],
                target,
                found["fit"],
                best,
                low,
                high,
                50 * (high - low) / best if both else None,
            )


MODULUS_BANDS_TABLE = table(
    modulus_bands,
    caption="Storage and loss moduli over frequency with the confidence limits that one trace of "
    "each case sets them: what rheologists compare.",
    uses=from_study(cases=each(with_moduli, "parameters sample")),
    reads={"limits": of_cases(PATH, with_moduli)},
    when=with_moduli,
)
