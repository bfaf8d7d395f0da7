"""Strain, force, stiffness and apparent modulus of every sample."""

import numpy as np

from biogrip.experiment.apparent_modulus import apparent_modulus
from biogrip.experiment.protocol import torque_history
from biogrip.instrument.contact import LARGEST_M, SMALLEST_M
from biogrip.response.grip import compute_grip
from biogrip.response.jaw_force import jaw_force
from biogrip.response.simulation import simulated_shortening
from biogrip.study.study import Case, Study
from biogrip.tables.layout import Cell, Column, Table

_COLUMNS = (
    Column("case", "Case"),
    Column("size_um", "Size (um)"),
    Column("shortening_um", "Shortening (um)"),
    Column("strain_percent", "Strain (%)"),
    Column("largest_force_uN", "Largest force (uN)"),
    Column("lowest_force_uN", "Lowest force (uN)"),
    Column("lowest_at_s", "at (s)"),
    Column("stiffness_at_once_N_per_m", "Stiffness at once (N/m)"),
    Column("stiffness_in_the_end_N_per_m", "in the end (N/m)"),
    Column("gripper_stiffness_N_per_m", "of the gripper (N/m)"),
    Column("stiffness_over_gripper", "Sample over gripper"),
    Column("apparent_modulus_kPa", "Apparent modulus (kPa)"),
)


def mechanics(study: Study) -> Table:
    """Compute strain, force, stiffness and modulus of every sample."""
    caption = (
        "Each sample while jaws hold it: shortening and strain at the end of the first phase; the "
        "largest force, and the lowest, which is negative where the jaws would have to pull; "
        "stiffness of the sample at once (all springs) and in the end (the parallel one), of the "
        "gripper (both hinges, at the jaws), and the first of these over the last. The modulus is "
        "that of an incompressible sphere between two flat jaws (Hertz) with force and shortening "
        "of the end of the first phase; cells have about 1 kPa, give or take a factor of 30 by the "
        "method of measurement. A case that gives no size has a row for the smallest and the "
        "largest sample that the gripper takes."
    )
    return Table(caption, _COLUMNS, [row for case in study.cases.values() for row in _rows(case)])


def _rows(case: Case) -> list[tuple[Cell, ...]]:
    torque = torque_history(case.phases)
    network = case.sample.model.sample(case.parameters)
    # Immediately before the first change of torque.
    end = np.array([np.nextafter(case.phases[0].duration_s, 0)])
    given = case.gripper, network, torque
    shortening = float(simulated_shortening(*given, end, nonlinear=case.nonlinear_target)[0, 0])
    force = float(jaw_force(*given, end, nonlinear=case.nonlinear_target)[0, 0])
    grip = compute_grip(*given, nonlinear=case.nonlinear_target)
    # A springpot has neither instantaneous nor long-term stiffness.
    power_law = case.sample.model.power_law
    in_the_end = None if power_law else float(network.k_p[0])
    at_once = None if power_law else float(network.k_p[0] + network.k[0].sum())
    own = case.gripper.jaw_stiffness_N_per_m
    rows: list[tuple[Cell, ...]] = []
    for size in (SMALLEST_M, LARGEST_M) if case.size_m is None else (case.size_m,):
        modulus = apparent_modulus(force, shortening, size) if shortening > 0 else None
        rows.append(
            (
                case.title,
                1e6 * size,
                1e6 * shortening,
                100 * shortening / size,
                1e6 * grip.largest_N,
                1e6 * grip.lowest_N,
                grip.lowest_at_s,
                at_once,
                in_the_end,
                own,
                None if at_once is None else at_once / own,
                None if modulus is None else 1e-3 * modulus,
            )
        )
    return rows
