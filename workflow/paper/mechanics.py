"""What the gripper does to a sample, and what its model leaves out.

Tables: the closed gripper at contact with samples of several sizes; strain, force, stiffness
and apparent modulus of every sample; effects that the model leaves out, estimated; and errors of
identifications that wrongly assume bilateral contact.
"""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from biogrip.arrays import Array
from biogrip.digits import significant
from biogrip.errors import BiogripError
from biogrip.fit.least_squares import identify_many
from biogrip.physics import gripper as actuator
from biogrip.physics.gripper import (
    LARGEST_M,
    SMALLEST_M,
    CombDrive,
    Gripper,
)
from biogrip.physics.noise import add_noise, rms, stream
from biogrip.physics.protocol import Course, largest_load
from biogrip.physics.response import (
    LEFT,
    RIGHT,
    compute_grip,
    simulated_response,
    step_response,
    superpose,
)
from biogrip.physics.sample_model import Network
from biogrip_study.config.study import Case, Study
from biogrip_study.gripper.nonlinear import jaw_force, nonlinear_rotation, target_grip
from biogrip_study.gripper.unilateral import unilateral_response
from biogrip_study.stages.job import job_study, logged
from biogrip_study.tables.layout import Column, Row, ShownTable, titled, write

if TYPE_CHECKING:
    snakemake: Any

WATER_PA_S, WATER_KG_PER_M3 = 1.0e-3, 1.0e3


def drag_of_sample(size_m: float) -> float:
    """Return Stokes' drag 6 pi mu R of a sphere in water in N s/m, a bound for its shortening."""
    return 3 * math.pi * WATER_PA_S * size_m


def drag_of_arm(gripper: Gripper, width_m: float) -> float:
    """Return the drag in N m s/rad of a fully immersed arm that turns in water.

    The drag of a slender rod per length, moved sideways, is 4 pi mu/(ln(l/d) + 0.84)
    (Tirado and Garcia de la Torre, J. Chem. Phys. 71, 2581, 1979). Its product with the
    squared distance from the pivot is integrated along the arm.
    """
    length = gripper.arm_length_m
    a_length = 4 * math.pi * WATER_PA_S / (math.log(length / width_m) + 0.84)
    return a_length * length**3 / 3


def rolling_of_contact(gripper: Gripper, size_m: float, rotation: float) -> float:
    """Return the shift of the contact point along the jaw, as a share of the arm's length.

    A round sample rolls on the turning jaw by its radius times the rotation. (The circle
    on which the tip moves is part of the nonlinear model.)
    """
    return 0.5 * size_m * rotation / gripper.arm_length_m


def fringing_of_comb(comb: CombDrive) -> float:
    """Return the increase of capacitance by fringing fields, relative to eq. (7).

    For two strips of width h at a distance g it is g/(pi h) [1 + ln(2 pi h/g)] (H. B.
    Palmer, Trans. AIEE 56, 363, 1937). It is less in a comb, where neighbouring fingers
    shield each other.
    """
    share = comb.finger_gap_m / (math.pi * comb.thickness_m)
    return share * (1 + math.log(2 / share))


def mass_of_sample(size_m: float) -> float:
    """Return the mass of a sphere of water in kg."""
    return WATER_KG_PER_M3 * math.pi * size_m**3 / 6


def apparent_modulus(force_N: float, shortening_m: float, size_m: float) -> float:
    """Return Young's modulus in Pa of a sphere from a force and the shortening it causes.

    Hertz's model of an elastic sphere, incompressible and of a diameter, between flat rigid jaws
    that do not stick, each of which indents it by half the shortening from first contact on:

        F = 4/3 E/(1 - nu^2) R^(1/2) (delta/2)^(3/2)

    (K. L. Johnson, Contact Mechanics, 1985, section 4.2). A cell in suspension is round, and the
    jaws are flat and far stiffer; a cylinder's E = F L/(A delta) would need an area that is rarely
    measured. The force grows faster than the shortening: the modulus, called apparent, is another
    at every shortening. The theory is one of small strains.
    """
    indentation, radius = 0.5 * shortening_m, 0.5 * size_m
    return 0.75 * (1 - 0.5**2) * force_N / math.sqrt(radius * indentation**3)


def displacement_of_tip(gripper: Gripper, rotation: Array) -> Array:
    """Return the displacement in m of a tip whose arm turns, u = l [cos(hat - phi) - cos hat]."""
    angle = np.radians(gripper.reference_angle_deg)
    half = 0.5 * rotation
    moved: Array = 2 * gripper.arm_length_m * np.sin(angle - half) * np.sin(half)
    return moved


def simulated_shortening(
    gripper: Gripper, network: Network, course: Course, time_s: Array, *, nonlinear: bool
) -> Array:
    """Simulate the shortening of samples in m, (n, n_times); see `simulated_response`."""
    if nonlinear:
        turns = (nonlinear_rotation(gripper, network, course, time_s, a) for a in (LEFT, RIGHT))
        left, right = (displacement_of_tip(gripper, turn) for turn in turns)
        return left + right
    response = step_response(gripper, network)
    both = superpose(response, course, time_s, LEFT) + superpose(response, course, time_s, RIGHT)
    return gripper.lever_m * both


_CONTACT_COLUMNS = (
    Column("size_um", "Sample (um)"),
    Column("closing_mrad", "Closing rotation (mrad)"),
    Column("reference_angle_deg", "Reference angle (deg)", 4),
    Column("off_percent", "Stiffness found is off by (%)", 2),
    Column("torque_nNm", "Torque (nN m)"),
    Column("voltage_V", "Voltage (V)"),
    Column("gripping_voltage_V", "while gripping (V)"),
    Column("remark", "Remark"),
)


def contacts(study: Study) -> ShownTable:
    """Return the state of the gripper closed onto samples from the smallest to the largest."""
    grip_Nm = largest_load(study.phases)
    neutral_deg = study.gripper.reference_angle_deg
    rows: list[Row] = []
    for size_um in np.arange(1e6 * SMALLEST_M, 1e6 * LARGEST_M + 1, 15.0):
        try:
            found = study.config.gripper.contact(study.actuator, 1e-6 * size_um)
        except BiogripError as error:
            rows.append({"size_um": size_um, "remark": str(error)})
            continue
        sines = np.sin(np.radians([found.reference_angle_deg, neutral_deg]))
        rows.append(
            {
                "size_um": size_um,
                "closing_mrad": 1e3 * found.closing,
                "reference_angle_deg": found.reference_angle_deg,
                "off_percent": 100 * ((sines[0] / sines[1]) ** 2 - 1),
                "torque_nNm": 1e9 * found.torque_Nm,
                "voltage_V": found.voltage_V,
                "gripping_voltage_V": float(
                    actuator.voltage(study.actuator, found.torque_Nm + grip_Nm)
                ),
            }
        )
    caption = (
        "Closing the jaws from the neutral configuration onto a sample: rotation of each arm, its "
        "angle at contact, by how much stiffnesses and dampings of the linear model are off if the "
        "neutral angle is taken for it (they go with one over the square of its sine), and the "
        "torque and voltage that hold it there. Grip torques come on top; the last voltage "
        f"is with the protocol's largest, {1e9 * grip_Nm:.3g} nN m."
    )
    return ShownTable(caption, _CONTACT_COLUMNS, rows)


_MECHANICS_COLUMNS = (
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
    Column("apparent_modulus_kPa", "Modulus by Hertz (kPa)"),
    Column("modulus_by_area_kPa", "by area (kPa)"),
)


def mechanics(study: Study) -> ShownTable:
    """Compute strain, force, stiffness and modulus of every sample."""
    caption = (
        "Each sample while jaws hold it: shortening and strain at the end of the first phase; the "
        "largest force, and the lowest, which is negative where the jaws would have to pull; "
        "stiffness of the sample at once (all springs) and in the end (the parallel one), of the "
        "gripper (both hinges, at the jaws), and the first of these over the last. The modulus is "
        "that of an incompressible sphere between two flat jaws (Hertz) with force and shortening "
        "of the end of the first phase; by area it is force over the sphere's cross-section and "
        "strain; cells have about 1 kPa, give or take a factor of 30 by the "
        "method of measurement. A case that gives no size has a row for the smallest and the "
        "largest sample that the gripper takes."
    )
    rows = [row for case in study.cases.values() for row in _mechanics_of(case)]
    return ShownTable(caption, _MECHANICS_COLUMNS, rows)


def _mechanics_of(case: Case) -> list[Row]:
    """Return a row for every size of a case's sample."""
    network = case.network
    given = case.gripper, network, case.torque
    # Immediately before the first change of torque.
    end = np.array([np.nextafter(case.phases[0].duration_s, 0)])
    shortening = float(simulated_shortening(*given, end, nonlinear=case.nonlinear_target)[0, 0])
    force = float(jaw_force(*given, end, nonlinear=case.nonlinear_target)[0, 0])
    grip = target_grip(*given, nonlinear=case.nonlinear_target)
    own = case.gripper.jaw_stiffness_N_per_m
    of_all_sizes: Row = {
        "case": case.title,
        "shortening_um": 1e6 * shortening,
        "largest_force_uN": 1e6 * grip.largest_N,
        "lowest_force_uN": 1e6 * grip.lowest_N,
        "lowest_at_s": grip.lowest_at_s,
        "gripper_stiffness_N_per_m": own,
    }
    # A springpot has neither instantaneous nor long-term stiffness.
    if not case.sample.model.power_law:
        at_once = float(network.k_p[0] + network.k[0].sum())
        of_all_sizes |= {
            "stiffness_at_once_N_per_m": at_once,
            "stiffness_in_the_end_N_per_m": float(network.k_p[0]),
            "stiffness_over_gripper": at_once / own,
        }
    rows: list[Row] = []
    size_m = case.block.sample.size_m
    for size in (SMALLEST_M, LARGEST_M) if size_m is None else (size_m,):
        modulus = 1e-3 * apparent_modulus(force, shortening, size) if shortening > 0 else None
        of_size = {"size_um": 1e6 * size, "strain_percent": 100 * shortening / size}
        by_area = force / (np.pi / 4 * size**2) / (shortening / size)
        moduli = {"apparent_modulus_kPa": modulus, "modulus_by_area_kPa": 1e-3 * by_area}
        rows.append(of_all_sizes | of_size | moduli)
    return rows


_LEFT_OUT_COLUMNS = (
    Column("effect", "Left out"),
    Column("size", "Size", 2),
    *titled("unit", "beside"),
    Column("beside_size", "which is", 2),
    Column("share_percent", "Share (%)", 2),
    Column("remark", "Remark"),
)


def left_out(study: Study) -> ShownTable:
    """Estimate effects that the model leaves out, for the largest sample."""
    gripper, arm = study.gripper, study.gripper.left
    b, length_mm = gripper.lever_m, 1e3 * gripper.arm_length_m
    turn = largest_load(study.phases) / arm.stiffness_Nm_per_rad
    arm_drag = drag_of_arm(gripper, study.actuator.thickness_m)
    rows: list[Row] = []

    def add(effect: str, size: float, unit: str, beside: str, whole: float, remark: str) -> None:
        of_whole = {"beside": beside, "beside_size": whole, "share_percent": 100 * size / whole}
        rows.append({"effect": effect, "size": size, "unit": unit, **of_whole, "remark": remark})

    dampings = [damping for name in study.gripped if (damping := _damping(study.cases[name])) > 0]
    if dampings:
        remark = "the sample in water, Stokes; of the case with the least damping"
        drag = drag_of_sample(LARGEST_M)
        add("drag on the sample", drag, "N s/m", "its dampers", min(dampings), remark)
    remark = "all of an arm in water; the paper keeps the device out of it"
    hinge = arm.damping_Nms_per_rad
    add("drag on an arm", arm_drag, "N m s/rad", "the hinge's damping", hinge, remark)
    if dampings:
        remark = "the same, beside what a rotation trace is made of"
        own = 2 * b * b * min(dampings)
        add("drag on an arm", arm_drag, "N m s/rad", "the sample's, 2 b^2 c", own, remark)
    remark = "a sphere that rolls on the jaw, at the free arm's rotation under the largest torque"
    moved = length_mm * rolling_of_contact(gripper, LARGEST_M, turn)
    add("contact point along the jaw", moved, "mm", "the arm length", length_mm, remark)
    remark = "at most: fingers shield each other; the voltage for a torque is less by half of it"
    fringing = fringing_of_comb(study.actuator)
    add("fringing of the comb", fringing, "", "its capacitance", 1.0, remark)
    remark = "felt for milliseconds after a step, as the arms' own"
    mass, of_arm = mass_of_sample(LARGEST_M), arm.inertia_kgm2 / b**2
    add("inertia of the sample", mass, "kg", "an arm's at the jaw, I/b^2", of_arm, remark)
    caption = (
        f"What the model leaves out, estimated for a sample of {1e6 * LARGEST_M:g} um: its size, "
        "and its share of what it would add to."
    )
    return ShownTable(caption, _LEFT_OUT_COLUMNS, rows)


def _damping(case: Case) -> float:
    """Return the damping of all dampers of a case's sample in N s/m."""
    if case.sample.model.power_law:
        return 0.0
    return float(case.network.c_p[0] + case.network.c[0].sum())


_MOST_SEEDS = 20
# Error in percent beyond which a number means little.
_LARGEST_PERCENT = 1000.0
_COLUMNS = (
    Column("case", "Case"),
    Column("lost_at_s", "Contact lost at (s)"),
    *titled("quantity", "unit", "target"),
    Column("held", "Held throughout"),
    Column("let_go", "Let go"),
    Column("error_percent", "Error (%)"),
    Column("until_lost", "Let go, until then"),
    Column("until_lost_error_percent", "Error (%)"),
)


def contact_loss(study: Study) -> ShownTable:
    """Identify traces with bilateral and with unilateral contact, both linear; compare errors."""
    linear = [case for name in study.gripped if not (case := study.cases[name]).nonlinear_target]
    rows = [row for case in linear for row in _loss_of(study.config.study_seed, case)]
    caption = (
        "Cases in which the jaws would have to pull: what least squares identifies, assuming "
        "bilateral contact, in traces with bilateral contact, in traces with loss of contact where "
        "the force reaches zero, and in the readings of the latter before the loss. "
        f"Medians over the same noise of at most {_MOST_SEEDS} seeds; the misfit is over the RMS "
        "of the noise. Errors are (target - identified)/target; empty beyond "
        f"{_LARGEST_PERCENT:g} %."
    )
    return ShownTable(caption, _COLUMNS, rows)


def _loss_of(study_seed: int, case: Case) -> list[Row]:
    """Return a row for every quantity and the misfit; none if the jaws keep contact."""
    device = case.gripper, case.network, case.torque
    if compute_grip(*device).pulls_from_s is None:
        return []
    time_s = case.times_s
    free = unilateral_response(*device, time_s)
    if not free.changes_s:
        return []
    # As the targets of a case are written.
    read = simulated_response(*device, time_s)[0], free.rotation[0]
    held, let_go = (significant(each, 9) for each in read)
    rngs = [
        stream(study_seed, case.name, seed, "noise") for seed in range(min(case.seeds, _MOST_SEEDS))
    ]
    noise = np.array([add_noise(held, case.noise, rng, time_s) - held for rng in rngs])
    lost_s, every = free.changes_s[0], len(time_s)
    until = int(np.searchsorted(time_s, lost_s))
    medians = {
        column: _medians(study_seed, case, time_s[:readings], rotation, noise[:, :readings])
        for column, rotation, readings in (
            ("held", held, every),
            ("let_go", let_go, every),
            ("until_lost", let_go, until),
        )
    }
    rows: list[Row] = []
    for quantity in (*case.sample.model.quantities, []):
        names = [parameter.name for parameter in quantity]
        label = " + ".join(names) or "misfit"
        target = sum(case.parameters[name] for name in names) if names else 1.0
        unit = quantity[0].unit if quantity else "noise"
        row: Row = {"case": case.name, "lost_at_s": lost_s, "quantity": label}
        row |= {"unit": unit, "target": target}
        row |= {column: found.get(label) for column, found in medians.items()}
        if quantity:
            row["error_percent"] = _error_percent(target, row["let_go"])
            row["until_lost_error_percent"] = _error_percent(target, row["until_lost"])
        rows.append(row)
    return rows


def _medians(
    study_seed: int, case: Case, time_s: Array, rotation: Array, noise: Array
) -> dict[str, float]:
    """Return medians of all quantities and of the misfit over the noise; none of few readings.

    Noise has the shape (n_seeds, n_samples).
    """
    problem = case.experiment.to_identify()
    searched = problem.searched
    if len(time_s) <= len(searched.names) + problem.offset + problem.drift + 1:
        return {}
    problems = problem.of_each(time_s, [*(rotation[: len(time_s)] + noise)])
    rngs = [stream(study_seed, case.name, seed, "contact_loss") for seed in range(len(noise))]
    found = identify_many(problems, case.block.least_squares, rngs)
    values = pd.DataFrame([each.parameters for each in found], columns=searched.names)
    values = values.assign(**problem.fixed)
    medians = {
        " + ".join(p.name for p in quantity): values[[p.name for p in quantity]]
        .sum(axis=1)
        .median()
        for quantity in problem.model.quantities
    }
    if level := rms(noise):
        medians["misfit"] = np.median([each.misfit for each in found]) / level
    return medians


def _error_percent(target: float, value: float | None) -> float | None:
    error = 100 * (target - value) / target if target and value is not None else None
    return None if error is None or abs(error) > _LARGEST_PERCENT else error


if __name__ == "__main__":
    with logged(snakemake):
        study_held = job_study(snakemake)
        write(contacts(study_held), Path(snakemake.output.contact))
        write(left_out(study_held), Path(snakemake.output.left_out))
        if study_held.gripped:
            of_gripped, of_loss = map(Path, snakemake.output.gripped)
            write(mechanics(study_held.of(study_held.gripped)), of_gripped)
            write(contact_loss(study_held), of_loss)
