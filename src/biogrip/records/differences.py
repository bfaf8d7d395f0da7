"""Difference of the linear from the nonlinear model: a row per case, angle and torque."""

from biogrip.records.rows import RowFile

DIFFERENCES = RowFile(
    "a comparison",
    ("case", "reference_angle_deg", "torque_factor", "difference_over_peak"),
    "results/linearisation.csv",
)
