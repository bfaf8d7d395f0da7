"""Claims of the paper's sections 2 to 4: actuator, grip, equations of motion, genetic encoding."""

import numpy as np
import pandas as pd

from biogrip.physics.calibration import ARM_KEYS, FreeMotion, calibrate, free_motion
from biogrip.physics.noise import Noise, add_noise, stream
from biogrip.physics.protocol import sample_times
from biogrip.tables.claim_rules import (
    CLOSE,
    FEW,
    IN_PART,
    NOT,
    REPLICATED,
    UNDECIDED,
    Judged,
    Results,
    altogether,
    by_number,
    by_share,
    claim,
    is_encodable,
    percent,
    plain,
)
from biogrip.tables.mechanics import LIMIT_PERCENT

_FELT = 1.1
"""Ratio of bounds from which the gripper's stiffness is said to matter."""


@claim("section 2", "1.6e-3 µNm … corresponds to … about 17 V")
def judge_voltage(results: Results) -> Judged:
    row = results.table("evidence").set_index("quantity").loc["voltage for 1.6e-09 N m"]
    volts = f"{row['this_study']:.3g} V"
    return Judged(_as_printed(row), f"Eqs. (7) to (9) with Table 2 give {volts}.")


def _as_printed(row: "pd.Series") -> str:
    printed = float(str(row["paper"]).removeprefix("about "))
    return by_number(printed, float(row["this_study"]))


@claim("section 2", "in order to maintain the grip with the sample")
def judge_grip(results: Results) -> Judged:
    lowest = results.table("mechanics").groupby("case", sort=False)["lowest_force_uN"].min()
    tables = {case.title: case.published.table for case in results.study.cases.values()}
    lowest = lowest[lowest.index.isin(tables)]
    said = ", ".join(f"{force:.2g} µN (Table {tables[title]})" for title, force in lowest.items())
    return Judged(
        altogether(REPLICATED if force > 0 else NOT for force in lowest),
        f"Lowest jaw force: {said}. Where it is negative the jaws would have to pull.",
    )


@claim("section 2", "samples … belonging to the range [30, 120] µm")
def judge_sizes(results: Results) -> Judged:
    found = results.table("contact")
    stroke = results.study.actuator.stroke_deg
    needed = np.degrees(1e-3 * found["closing_mrad"].to_numpy(float))
    return Judged(
        by_share(needed <= stroke),
        f"Closing onto samples of {found['size_um'].min():g} to {found['size_um'].max():g} µm "
        f"takes {np.nanmin(needed):.2g} to {np.nanmax(needed):.2g} degrees of the stroke of "
        f"{stroke:g}, with the reconstructed arm, and {found['voltage_V'].min():.3g} to "
        f"{found['voltage_V'].max():.3g} V, which the paper does not count.",
    )


@claim("section 2", "[distance of the jaws] can be easily set-up … without affecting the results")
def judge_jaw_gap(results: Results) -> Judged:
    angles = np.radians(results.table("contact")["reference_angle_deg"].to_numpy(float))
    scale = np.sin(angles) ** 2
    change = 100 * float(scale.max() / scale.min() - 1)
    smallest = float(results.table("coverage")["bound_percent"].min())
    return Judged(
        REPLICATED if change <= smallest else IN_PART,
        "The gap sets the angle at which the jaws meet a sample. From the smallest sample to the "
        f"largest the values of a trace change by {change:.2g} % with it, where noise allows "
        f"{smallest:.2g} % at best: it does not matter if the angle is known.",
    )


@claim(
    "section 2",
    "capability … depends on the elastic properties of the device and on the implemented algorithm",
)
def judge_capability(results: Results) -> Judged:
    points = results.of_sweep("robustness_gripper")
    found = points.groupby(["case", "quantity"], sort=False)["bound_percent"]
    ratio = (found.max() / found.min()).groupby("case", sort=False).max()
    methods = results.table("methods").groupby("method", sort=False)
    by_method = methods["reached_share"].agg(["min", "max"])
    shares = "; ".join(
        f"{name} {_percents(row['min'], row['max'])}" for name, row in by_method.iterrows()
    )
    decides = float(by_method["min"].max() - by_method["min"].min()) > FEW
    return Judged(
        altogether([*(REPLICATED if r > _FELT else NOT for r in ratio), *([REPLICATED] * decides)]),
        "From half to twice the stiffness and from 1 to 2 mm, the least errors that noise allows "
        f"change by factors of {ratio.min():.2g} to {ratio.max():.2g} (sweep robustness_gripper). "
        f"Runs that reach the best point that the genes can encode: {shares}.",
    )


def _percents(low: float, high: float) -> str:
    first, last = percent(low), percent(high)
    return last if first == last else f"{first.removesuffix(' %')} to {last}"


@claim("section 2", "determined considering a standard impulse or a step response")
def judge_free_arm(results: Results) -> Judged:
    case = next(iter(results.study.cases.values()))
    test, arm = case.block.calibration, case.gripper.left
    time_s = sample_times(test.duration_s, test.rate_Hz)
    causes = test.step_torque_Nm, test.impulse_Nms
    motion = free_motion(arm, time_s, *causes)
    noise = Noise("gaussian", test.noise_level, "peak")
    rng = stream(results.study.study_seed, "claims", 0, "calibration")
    record = FreeMotion(
        time_s, add_noise(motion.step, noise, rng), add_noise(motion.impulse, noise, rng)
    )
    found = calibrate(record, *causes).arm
    errors = [100 * abs(getattr(found, key) / getattr(arm, key) - 1) for key in ARM_KEYS]
    inertia, damping, stiffness = errors
    return Judged(
        altogether(REPLICATED if error <= 100 * CLOSE else NOT for error in errors),
        f"Simulated with {100 * test.noise_level:g} % of noise: inertia, damping and stiffness are "
        f"found with errors of {inertia:.1g}, {damping:.1g} and {stiffness:.1g} %.",
    )


@claim("section 3, (1)-(6)", "can be described by means of the following equations")
def judge_equations(results: Results) -> Judged:
    case = results.study.cases[results.case_of(5)]
    values = case.parameters
    length_s = sum(phase.duration_s for phase in case.phases)
    decades = values["k"] / values["c"] * length_s / np.log(10)
    return Judged(
        NOT if decades > 0 else REPLICATED,
        "Signs and dimensions differ between eqs. (1) to (6). By eq. (6) as printed the node runs "
        f"away with the time constant c/k: by {decades:.0f} decades in the {length_s:g} s of "
        "Table 5's sample. Derived anew, the equations hold.",
    )


@claim("section 3, (4)-(6)", "an approximate linear set of equations can be obtained")
def judge_linear_model(results: Results) -> Judged:
    table = results.table("linearisation")
    angle = results.study.gripper.reference_angle_deg
    used = table.iloc[(table["reference_angle_deg"] - angle).abs().argsort(kind="stable")]
    nearest = used[used["reference_angle_deg"] == used["reference_angle_deg"].iloc[0]]
    worst = float(nearest["difference_percent"].max())
    return Judged(
        REPLICATED if worst <= LIMIT_PERCENT else NOT,
        f"Linear and nonlinear responses differ by at most {worst:.1g} % of the peak (allowed: "
        f"{LIMIT_PERCENT:g} %).",
    )


@claim("section 3", "1.6 µNm is about 17 V, whereas … 0.32 µNm is about 7 V")
def judge_voltages(results: Results) -> Judged:
    rows = results.table("evidence").set_index("quantity")
    misprinted = rows.loc["voltage for 1.6e-06 N m"]
    meant = [rows.loc[f"voltage for {torque} N m"] for torque in ("1.6e-09", "3.2e-10")]
    as_printed, corrected = _as_printed(misprinted), altogether(map(_as_printed, meant))
    ours = " and ".join(f"{row['this_study']:.3g}" for row in meant)
    return Judged(
        as_printed if as_printed == corrected else IN_PART,
        f"1.6 µN m would take {misprinted['this_study']:.3g} V; a thousandth of both torques, "
        f"as in section 2, takes {ours} V.",
    )


@claim("section 4", "three independent genes allows a faster convergence")
def judge_splitting(results: Results) -> Judged:
    table = results.table("methods").groupby("method", sort=False)["median_evaluations"].max()
    said = "; ".join(f"{name} {plain(count)}" for name, count in table.items())
    return Judged(
        UNDECIDED,
        f"The paper shows no other encoding. Simulated responses, medians, at most: {said}.",
    )


@claim("section 4", "each one … few possible values (either 9 or 12)")
def judge_genes(results: Results) -> Judged:
    counts = sorted(set(results.table("gene_ranges")["values"].astype(int)))
    return Judged(
        altogether(REPLICATED if count in (9, 12) else NOT for count in counts),
        f"Ranges that give Table 4 have {', '.join(map(str, counts))} values a gene.",
    )


@claim("section 4, Table 4", "range as reported in Table 4, with two significant digits")
def judge_digits(results: Results) -> Judged:
    table = results.table("printed_values")
    found = table[table["quantity"] == "identified"]
    pairs = zip(found["printed"], found["nearest_encodable"], strict=True)
    fits = np.array([is_encodable(*pair) for pair in pairs]) & (found["within_range"] == "yes")
    return Judged(
        by_share(fits),
        f"{fits.sum()} of the {len(fits)} values that Tables 5 to 7 call identified are two-digit "
        "numbers within the ranges of Table 4, rounded as printed.",
    )
