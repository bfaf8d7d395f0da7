"""The simulated dishes in ``data/dishes``: ``python -m tests.helpers.example_dishes`` writes them.

Six cells are controls and six are treated, which makes both springs stiffer by `TREATED`. One cell
was gripped twice. The arms slipped in one trace, whose readings jump.
"""

from pathlib import Path

import numpy as np

from biogrip import library
from tests.helpers.places import ROOT

FOLDER = ROOT / "data" / "dishes"
TREATED, SPREAD, NOISE = 1.5, 0.15, 0.02
CELL = {"k": 20.0, "k_p": 5.0, "c": 80.0}
TWICE, SLIPPED = "a2", "b5"
_CELLS, _SEED = 6, 31
_TIMES = np.linspace(0.0, 400.0, 201)


def experiment() -> library.CaseProblem:
    """Return the default study's gripper and protocol, and drops with a membrane."""
    arm = library.Arm(inertia_kgm2=1e-14, damping_Nms_per_rad=3.3e-12, stiffness_Nm_per_rad=4.4e-7)
    gripper = library.Gripper(arm_length_m=1.5e-3, reference_angle_deg=75.0, left=arm, right=arm)
    protocol = (library.hold(200.0, 1.6e-9), library.hold(200.0, 0.32e-9))
    return library.set_up(gripper, protocol, library.Sample("liquid_drop"))


def files() -> dict[str, str]:
    """Return the text of the sheet and of every trace, by name."""
    rng, case_problem = np.random.default_rng(_SEED), experiment()
    noise = library.Noise("gaussian", NOISE, "peak")
    found = {}
    rows = ["file\tcell\ttreatment"]
    for dish, treatment, factor in (("a", "control", 1.0), ("b", "treated", TREATED)):
        for number in range(1, _CELLS + 1):
            cell = f"{dish}{number}"
            own = np.exp(SPREAD * rng.standard_normal(3)) * [*CELL.values()]
            sample = dict(zip(CELL, own * [factor, factor, 1.0], strict=True))
            clean = library.simulate(case_problem, sample, _TIMES)
            for name in [cell, f"{cell}_again"][: 2 if cell == TWICE else 1]:
                trace = library.add_noise(clean, noise, rng)
                trace += (0.1 * clean.max()) * (_TIMES > 120.0) * (cell == SLIPPED)
                readings = zip(_TIMES, trace, strict=True)
                lines = [f"{time_s:g},{rotation_rad:.5e}" for time_s, rotation_rad in readings]
                found[f"{name}.csv"] = "\n".join(["time_s,rotation_rad", *lines]) + "\n"
                rows.append(f"{name}.csv\t{cell}\t{treatment}")
    return {"cells.tsv": "\n".join(rows) + "\n", **found}


def main(folder: Path = FOLDER) -> None:
    """Write all files."""
    folder.mkdir(exist_ok=True)
    for name, text in files().items():
        (folder / name).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
