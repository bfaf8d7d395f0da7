"""How often limits hold the truth where the load or the deformation was recorded.

A set-up is a course, a sample whose response to it is known exactly, rows of both, and noise. Each
trace is identified by the command, with a column of its course, and nothing else that a user knows.

    python -m benchmarks.recorded_loads                      200 traces of each set-up
    python -m benchmarks.recorded_loads sine --traces 20     of some set-ups, by their first words
"""

import argparse
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pandas as pd

from benchmarks.one_thread import keep_to_one_thread
from biogrip.arrays import Array
from biogrip.records.identifications import share_in_words

Course = Callable[[Array], Array]
_SEED, _NOISE = 62, 0.01
_KELVIN_VOIGT = {"k_p": 180.0, "c_p": 25.0}
_ZENER = {"k_s": 500.0, "k_v": 300.0, "c_v": 150.0}
# Steps of the simulation between two rows.
_FINE = 200


@dataclass(frozen=True)
class SetUp:
    """A course that is recorded, and the sample under it."""

    name: str
    course: Callable[[np.random.Generator], tuple[Array, Course]]
    """Times of the rows, and what is controlled at any time; each trace draws its own."""
    creep: bool
    """True if a Zener solid creeps, false if the force on a Kelvin-Voigt solid is read."""
    sensor: float = 0.0
    """Standard deviation of the recorded course over its largest value."""


def _rows(rng: np.random.Generator, last_s: float, interval_s: float) -> Array:
    """Return times from 0 or later on, at an interval of its own."""
    interval_s = interval_s * float(rng.uniform(0.7, 1.4))
    first, count = int(rng.integers(0, 2)), int(last_s / interval_s)
    return np.linspace(first * interval_s, (count - 1) * interval_s, count - first)


def _sine(rng: np.random.Generator) -> tuple[Array, Course]:
    """Return 25 to 60 rows a period of 2 s."""
    time_s = np.arange(rng.integers(0, 2), 500) * 2 / rng.integers(25, 61)
    return time_s, lambda t: np.sin(np.pi * t)


def _smooth(rng: np.random.Generator) -> tuple[Array, Course]:
    """Return a load that comes without a step, and three sinusoids."""
    rates, sizes = rng.uniform(0.3, 3.0, 3), rng.uniform(0.2, 1.0, 3)
    return _rows(rng, 12.0, 0.04), lambda t: sum(
        size * (1 - np.cos(rate * t)) for rate, size in zip(rates, sizes, strict=True)
    )


def _steps(rng: np.random.Generator) -> tuple[Array, Course]:
    """Return steps up and down, each at any time between two rows."""
    at_s, sizes = 1.0 + 3.5 * np.arange(3) + rng.uniform(0, 1.5, 3), rng.uniform(0.5, 1.5, 3)
    heights = sizes * [1, -0.7, 1]
    return _rows(rng, 12.0, 0.1), lambda t: heights @ (np.asarray(t) >= at_s[:, None])


def _late(rng: np.random.Generator) -> tuple[Array, Course]:
    """Return a hold from 0 whose first row comes late."""
    first_s = float(rng.uniform(0.1, 1.0))
    return np.linspace(first_s, first_s + 10, 201), lambda t: np.ones_like(t)


def _lines(*corners: tuple[float, float]) -> Callable[[np.random.Generator], tuple[Array, Course]]:
    """Return lines from corner to corner, which rows meet by chance only."""
    at_s, values = map(list, zip(*corners, strict=True))
    return lambda rng: (_rows(rng, 12.0, 0.05), lambda t: np.interp(t, at_s, values))


_TRAPEZIUM = _lines((0.0, 0.0), (1.3, 1.0), (6.1, 1.0), (6.9, 0.2), (12.0, 0.2))
_TRIANGLE = _lines(*((1.7 * n, float(n % 2)) for n in range(9)))
SET_UPS = (
    SetUp("sine", _sine, creep=True),
    SetUp("sine, Kelvin-Voigt", _sine, creep=False),
    SetUp("sine, Kelvin-Voigt, noisy sensor", _sine, creep=False, sensor=0.002),
    SetUp("steps", _steps, creep=True),
    SetUp("steps, noisy sensor", _steps, creep=True, sensor=0.002),
    SetUp("late clock", _late, creep=True),
    SetUp("smooth", _smooth, creep=True),
    SetUp("smooth, Kelvin-Voigt", _smooth, creep=False),
    SetUp("smooth, noisy sensor", _smooth, creep=True, sensor=0.002),
    SetUp("trapezium", _TRAPEZIUM, creep=True),
    SetUp("trapezium, Kelvin-Voigt", _TRAPEZIUM, creep=False),
    SetUp("triangle", _TRIANGLE, creep=True),
    SetUp("triangle, Kelvin-Voigt", _TRIANGLE, creep=False),
)


def _read(set_up: SetUp, time_s: Array, course: Course) -> Array:
    """Return what is read without noise; at a corner a damper has the rate after it."""
    if not set_up.creep:
        rate = (course(time_s + 1e-6) - course(time_s)) / 1e-6
        return _KELVIN_VOIGT["k_p"] * course(time_s) + _KELVIN_VOIGT["c_p"] * rate
    k_s, k_v, c_v = _ZENER.values()
    fine_s = np.linspace(0.0, time_s[-1], _FINE * len(time_s))
    load, step_s, voigt = course(fine_s), fine_s[1], np.zeros(len(fine_s))
    left = np.exp(-step_s * k_v / c_v)
    # Exact for a load that is linear from one fine time to the next.
    share = (1 - left) / (step_s * k_v / c_v)
    for n in range(1, len(fine_s)):
        voigt[n] = (
            left * voigt[n - 1] + ((share - left) * load[n - 1] + (1 - share) * load[n]) / k_v
        )
    return course(time_s) / k_s + np.interp(time_s, fine_s, voigt)


def _write(set_up: SetUp, folder: Path, count: int) -> None:
    for number in range(count):
        rng = np.random.default_rng([_SEED, SET_UPS.index(set_up), number])
        time_s, course = set_up.course(rng)
        read, controlled = _read(set_up, time_s, course), course(time_s)
        read += _NOISE * np.max(np.abs(read)) * rng.standard_normal(len(read))
        scatter = set_up.sensor * np.max(np.abs(controlled))
        controlled = controlled + scatter * rng.standard_normal(len(read))
        header = "time_s,strain,stress_Pa" if set_up.creep else "time_s,force_N,displacement_m"
        rows = np.column_stack((time_s, read, controlled))
        path = folder / f"{number}.csv"
        np.savetxt(path, rows, "%.10g", ",", header=header, comments="")


def measured(set_up: SetUp, count: int) -> Iterator[tuple[str, str]]:
    """Yield the share of fits that are ok, and of limits that hold each true value, in words."""
    truth = _ZENER if set_up.creep else _KELVIN_VOIGT
    reading, load, model = (
        ("strain=strain", "stress_Pa", "zener_kelvin")
        if set_up.creep
        else ("force=force_N", "displacement_m", "kelvin_voigt")
    )
    with TemporaryDirectory() as folder:
        _write(set_up, Path(folder), count)
        table = Path(folder) / "found.csv"
        traces = sorted(map(str, Path(folder).glob("*.csv")))
        options = ["--reading", reading, "--load", load, "--model", model, "--csv", str(table)]
        command = [sys.executable, "-m", "biogrip", "identify", *traces, *options]
        subprocess.run(command, check=False, capture_output=True)
        found = pd.read_csv(table)
    yield "ok", share_in_words(int(np.sum(found["fit"] == "ok")), count)
    for name, value in truth.items():
        low, high = (
            found[next(column for column in found if column.startswith(f"{name} {end}"))]
            for end in ("low", "high")
        )
        holds = (
            (low.fillna(0.0) <= value) & (value <= high.fillna(np.inf)) & (found["fit"] != "failed")
        )
        yield f"{name} held", share_in_words(int(np.sum(holds)), count)


def main() -> None:
    """Print a row of each set-up."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*")
    parser.add_argument("--traces", type=int, default=200)
    given = parser.parse_args()
    for set_up in SET_UPS:
        if not given.names or set_up.name.startswith(tuple(given.names)):
            said = ", ".join(f"{what} {share}" for what, share in measured(set_up, given.traces))
            print(f"{set_up.name}: {said}", flush=True)


if __name__ == "__main__":
    keep_to_one_thread()
    main()
