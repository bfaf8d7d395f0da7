"""A table of traces of a gripper with two actuators, and of samples that three instruments read.

They are simulated from equations written here; nothing of the library is used.
"""

from itertools import pairwise
from pathlib import Path

import numpy as np

HINGE_NM, LEVER_M, HOLDS_S = 4.4e-7, 1.5e-3 * np.sin(np.radians(75)), ((0, 60.0), (60, 25.0))
LAB = """measurement: {noise_share: 0.01}
least_squares: {candidates: 50, starts: 2}
model_selection: {models: []}
"""
PHASES = "[{duration_s: 60, voltage_V: 60}, {duration_s: 60, voltage_V: 25}]"
HEADER = ["file", "sample", "dish", "actuator.thickness_m", "gripper.arm_length_m", "hold"]
HEADER += ["protocol.phases", "reading", "measurement.loss", "sample.model"]
HEADER += ["measurement.frequency"]


def torque_Nm(thickness_m: float, volts: float) -> float:
    """Of 66 fingers of 4 um, 3 um apart, from 321 um on: half the slope of capacitance, by V²."""
    fixed = 321e-6 + 14e-6 * np.arange(66)
    slope = np.sum(1 / np.log((fixed + 7e-6) / (fixed + 4e-6)))
    slope += np.sum(1 / np.log(fixed[1:] / (fixed[1:] - 3e-6)))
    return float(8.8541878128e-12 * thickness_m * slope * volts**2 / 2)


def closing(time_s: np.ndarray, thickness_m: float, arm_m: float, k: float, c: float) -> np.ndarray:
    """Rotation of arms without inertia that squeeze a spring of 5 N/m beside a Maxwell element."""
    lever2 = 2 * (LEVER_M * arm_m / 1.5e-3) ** 2
    others = HINGE_NM / lever2 + 5.0
    stretched, found = 0.0, np.zeros(len(time_s))
    for (start_s, volts), (end_s, _) in pairwise((*HOLDS_S, (np.inf, 0))):
        load = torque_Nm(thickness_m, volts) / lever2
        at = (time_s >= start_s) & (time_s <= end_s)
        left = np.exp(-k * others / (c * (others + k)) * (time_s - start_s))
        dashpot = load / others + (stretched - load / others) * left
        found[at] = ((load + k * dashpot) / (others + k))[at]
        stretched = float(np.interp(end_s, time_s, dashpot))
    return found


def write_mixed(folder: Path, gripped: int, samples: int) -> int:
    """Write `cells.tsv` and `lab.yaml`, and traces, of every sample three; returns how many."""
    # Not at a step, where the arms have not moved yet.
    rng, time_s, rows = np.random.default_rng(88), np.arange(1.0, 121, 3), [HEADER]

    def write(name: str, header: str, first: np.ndarray, *clean: np.ndarray) -> None:
        noisy = [it * (1 + 0.01 * rng.standard_normal(len(it))) for it in clean]
        columns = np.column_stack((first, *noisy))
        np.savetxt(folder / name, columns, "%.6g", ",", header=header, comments="")

    for number in range(gripped):
        thickness_m, arm_m = (20e-6, 40e-6)[number % 2], (1.5e-3, 1.6e-3)[number // 2 % 2]
        rotations = closing(time_s, thickness_m, arm_m, 20 + number % 7, 300.0)
        write(name := f"grip_{number}.csv", "time_s,rotation_rad", time_s, rotations)
        # The usual gripper's are left to its config.
        own = [
            "" if it == usual else f"{it:g}"
            for it, usual in ((thickness_m, 40e-6), (arm_m, 1.5e-3))
        ]
        rows.append([name, "", f"d{number % 4}", *own, "", PHASES, "", "", "liquid_drop", ""])
    omega = np.geomspace(0.02, 20, 25)
    for number in range(samples):
        # Spring k_s behind a spring k_v beside a damper of 20 s.
        k_s, k_v = 400.0 + 10 * number, 300.0
        slow, once = k_v * k_s / (k_v + k_s), k_s**2 / (k_v + k_s)
        stress = slow + once * np.exp(-time_s * (k_s + k_v) / k_v / 20)
        complex_Pa = 1 / (1 / k_s + 1 / (k_v * (1 + 20j * omega)))
        creep = 5 * (1 / k_s - np.expm1(-time_s / 20) / k_v)
        of = [f"{kind}_{number}.csv" for kind in ("creep", "relaxation", "sweep")]
        write(of[0], "time_s,strain", time_s, creep)
        write(of[1], "time_s,stress_Pa", time_s, stress * 0.02)
        write(of[2], "omega (rad/s),G' (Pa),G'' (Pa)", omega, complex_Pa.real, complex_Pa.imag)
        for name, *own in (
            (of[0], "5 Pa", "", "strain=strain", "", "zener_kelvin", ""),
            (of[1], "0.02", "", "stress=stress_Pa", "", "zener_kelvin", ""),
            (of[2], "", "", "storage=G' (Pa)", "G'' (Pa)", "zener_kelvin", "omega (rad/s)"),
        ):
            rows.append([name, f"gel {number}", f"d{number % 4}", "", "", *own])
    (folder / "cells.tsv").write_text("".join("\t".join(row) + "\n" for row in rows))
    (folder / "lab.yaml").write_text(LAB)
    return len(rows) - 1
