"""Domain in which the paper's linearisation is accurate."""

from pathlib import Path

import numpy as np

from biogrip.records.differences import DIFFERENCES
from biogrip.study.study import Study
from biogrip.tables.layout import Cell, Column, Table

LIMIT_PERCENT = 1.0
"""Difference up to which it counts as accurate, as a share of the peak."""

_COLUMNS = (
    Column("case", "Case"),
    Column("reference_angle_deg", "Reference angle (deg)"),
    Column("difference_percent", "Difference at the protocol's torque (%)", 2),
    Column(f"factor_for_{LIMIT_PERCENT:g}_percent", f"Torque factor for {LIMIT_PERCENT:g} %", 3),
)


def linearisation(_: Study, differences: Path) -> Table:
    """Return, for every case and angle, the torque factor that reaches `LIMIT_PERCENT`."""
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
        "torque of the case's protocol, and the multiple of that torque at which it reaches "
        f"{LIMIT_PERCENT:g} % (empty: not up to {factor[-1]:g})."
    )
    return Table(caption, _COLUMNS, rows)


def _crossing(factor: np.ndarray, share: np.ndarray) -> float | None:
    limit = LIMIT_PERCENT / 100
    above = np.flatnonzero(share >= limit)
    if not len(above) or above[0] == 0:
        return None if not len(above) else float(factor[0])
    last = above[0]
    pair = slice(last - 1, last + 1)
    return float(np.exp(np.interp(np.log(limit), np.log(share[pair]), np.log(factor[pair]))))
