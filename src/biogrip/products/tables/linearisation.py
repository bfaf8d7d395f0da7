"""The domain in which the paper's linearisation is good to 1 %."""

from pathlib import Path

import numpy as np

from biogrip.products.files.differences import DIFFERENCES
from biogrip.products.product import the
from biogrip.products.tables.declared import table
from biogrip.products.tables.layout import Cell, Column, Table

_COLUMNS = (
    Column("case", "Case"),
    Column("reference_angle_deg", "Reference angle (deg)"),
    Column("difference_percent", "Difference at the protocol's torque (%)", 2),
    Column("factor_for_1_percent", "Torque factor for 1 %", 3),
)
_LIMIT = 0.01


def linearisation(settings: None, differences: Path) -> Table:
    """Find, for every case and angle, the multiple of the torque at which 1 % is reached.

    Parameters
    ----------
    settings
        None.
    differences
        The comparison of the models, CSV.
    """
    rows: list[tuple[Cell, ...]] = []
    for (case, angle), group in DIFFERENCES.read(differences).groupby(
        ["case", "reference_angle_deg"], sort=False
    ):
        factor = group["torque_factor"].to_numpy(float)
        share = group["difference_over_peak"].to_numpy(float)
        known = np.isfinite(share)
        at_one = np.exp(np.interp(0.0, np.log(factor[known]), np.log(share[known])))
        rows.append((case, float(angle), 100 * float(at_one), _crossing(factor, share)))
    caption = (
        "Largest difference of the linear from the nonlinear model, as a share of the peak, at the "
        "torque of the case's protocol, and the multiple of that torque at which it reaches 1 % "
        f"(empty: not up to {factor[-1]:g})."
    )
    return Table(caption, _COLUMNS, rows)


def _crossing(factor: np.ndarray, share: np.ndarray) -> float | None:
    above = np.flatnonzero(share >= _LIMIT)
    if not len(above) or above[0] == 0:
        return None if not len(above) else float(factor[0])
    last = above[0]
    pair = slice(last - 1, last + 1)
    return float(np.exp(np.interp(np.log(_LIMIT), np.log(share[pair]), np.log(factor[pair]))))


CAPTION = (
    "The largest difference of the linear from the nonlinear model over the protocol, as a share "
    "of the peak, over the reference angle and multiples of the torque of the case's protocol. "
    "Left of and above the 1 % line the paper's linearisation is worse than that."
)

LINEARISATION = table(
    linearisation,
    name="linearisation",
    item="linearisation",
    caption=CAPTION,
    sheet="tables",
    settings=lambda study: None,
    reads={"differences": the(DIFFERENCES.path)},
    when=lambda study: bool(study.simulated),
)
