"""Strain, force, stiffness and apparent modulus of every sample."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from biogrip.experiment.apparent_modulus import apparent_modulus
from biogrip.experiment.protocol import Phase, torque_history
from biogrip.experiment.sample import Sample
from biogrip.instrument.contact import LARGEST_M, SMALLEST_M
from biogrip.instrument.gripper import Gripper
from biogrip.products.tables.declared import table
from biogrip.products.tables.layout import Cell, Column, Table
from biogrip.response.grip import compute_grip
from biogrip.response.jaw_force import jaw_force
from biogrip.response.simulation import simulated_shortening
from biogrip.study.study import Case, Study

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


@dataclass(frozen=True)
class CaseSettings:
    """Inputs of a simulated case, from which its mechanics are computed.

    Parameters
    ----------
    title
        Title of the case.
    gripper, phases, sample, parameters, nonlinear
        Inputs of the target.
    size_m
        Diameter of the sample, if it is given.
    """

    title: str
    gripper: Gripper
    phases: tuple[Phase, ...]
    sample: Sample
    parameters: Mapping[str, float]
    nonlinear: bool
    size_m: float | None


def settings_of(case: Case) -> CaseSettings:
    """Return the settings that a case's mechanics depend on."""
    return CaseSettings(
        case.title,
        case.gripper,
        case.phases,
        case.sample,
        case.parameters,
        case.nonlinear_target,
        case.size_m,
    )


def settings(study: Study) -> list[CaseSettings]:
    """Return the settings of all simulated cases."""
    return [settings_of(study.cases[name]) for name in study.simulated]


def mechanics(settings: list[CaseSettings]) -> Table:
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
    return Table(caption, _COLUMNS, [row for case in settings for row in _rows(case)])


def _rows(case: CaseSettings) -> list[tuple[Cell, ...]]:
    torque = torque_history(case.phases)
    network = case.sample.model.sample(case.parameters)
    # Immediately before the first change of torque.
    end = np.array([np.nextafter(case.phases[0].duration_s, 0)])
    given = case.gripper, network, torque
    shortening = float(simulated_shortening(*given, end, nonlinear=case.nonlinear)[0, 0])
    force = float(jaw_force(*given, end, nonlinear=case.nonlinear)[0, 0])
    grip = compute_grip(*given, nonlinear=case.nonlinear)
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


MECHANICS = table(
    mechanics,
    name="mechanics",
    item="mechanics",
    caption="Strain, force, stiffness and apparent modulus of every simulated sample, beside the "
    "gripper's own stiffness.",
    settings=settings,
    rule="tables",
    when=lambda study: bool(study.simulated),
)
