"""A Prony series of a frequency sweep by pyvisco, as its documentation shows, and by biogrip."""

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
from pyvisco import prony

from benchmarks.field.measured import OURS
from benchmarks.report import Report, Row, Section, number
from benchmarks.timing import alternate
from biogrip.arrays import Array
from biogrip.identify.prepare import ranges_of
from biogrip.library import INSTRUMENTS, Sample, hold, identify_sample, set_up

_OMEGA, _ROUNDS = 2 * np.pi * np.geomspace(1e-3, 1e2, 60), 5


def _moduli(rest: float, moduli: Array, times_s: Array) -> Array:
    """Return storage and loss modulus, (2, n_omega)."""
    turned = 1j * np.multiply.outer(_OMEGA, times_s)
    whole = rest + turned / (1 + turned) @ moduli
    return np.stack((whole.real, whole.imag))


def by_pyvisco(read: Array, branches: int) -> float:
    """Return what is left, squared; the instantaneous modulus is that of the last reading."""
    columns = {"f": _OMEGA / (2 * np.pi), "omega": _OMEGA, "G_stor": read[0], "G_loss": read[1]}
    curve = pd.DataFrame({**columns, "G_stor_filt": read[0], "G_loss_filt": read[1]})
    vars(curve).update(modul="G", domain="freq", RefT=20)
    found = prony.fit_freq(prony.discretize(curve, "min", branches), curve, opt=True)
    shares, times_s = (found["df_terms"][name].to_numpy() for name in ("alpha_i", "tau_i"))
    drawn = found["E_0"] * _moduli(1 - shares.sum(), shares, times_s)
    return float(np.sum((drawn - read) ** 2))


def by_biogrip(read: Array, branches: int) -> float:
    """Return what is left, squared."""
    places, values = np.append(-_OMEGA[::-1], _OMEGA), np.append(read[1, ::-1], read[0])
    sample = Sample("generalized_maxwell", branches, stiffness="Pa")
    problem = set_up(INSTRUMENTS["storage"], (hold(1.0, 1.0),), sample, fixed={"c_p": 0.0})
    ranges = {**problem.ranges, **ranges_of(problem, places, values)}
    found = identify_sample(replace(problem, ranges=ranges), places, values)
    return float(found.misfit**2 * values.size)


def _measure() -> list[Row]:
    clean = _moduli(500.0, np.array([2e3, 1500, 1e3, 800]), np.array([0.05, 0.5, 5, 50]))
    noise = np.array([[0.02], [0.03]]) * np.random.default_rng(70).standard_normal(clean.shape)
    read, rows = clean * (1 + noise), []
    for branches in (3, 4, 5):
        programs = {OURS: by_biogrip, "pyvisco": by_pyvisco}
        calls = {name: partial(fit, read, branches) for name, fit in programs.items()}
        left, timed = {name: call() for name, call in calls.items()}, alternate(calls, _ROUNDS)
        for name, of in left.items():
            row: Row = {"branches": branches, "program": name, "over": of / min(left.values())}
            rows.append(row | timed.against(name, OURS))
    return rows


_TEXT = f"""\
Of a simulated sweep of {len(_OMEGA)} frequencies over five decades, of four branches and a spring
beside, with noise of 2 and 3 %. Both programs fit the relaxation times, too, with equal weights.
*Leaves*: the sum of squares, over the lower one. Times are medians of {_ROUNDS} rounds."""
_COLUMNS = {
    "branches": lambda row: str(row["branches"]) if row["program"] == OURS else "",
    "program": lambda row: row["program"],
    "leaves, of the best": lambda row: number(row["over"], 5),
    "times ours": lambda row: number(row["times_ours"], 2),
}
REPORT = Report(
    Path(__file__).parent / "results" / "sweep",
    "# A sweep beside what the field uses\n\nWritten by `make bench-field`.",
    (Section("prony", "A Prony series", _TEXT, _COLUMNS, _measure),),
    ("pyvisco",),
)
