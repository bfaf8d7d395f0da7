"""How often verdicts and limits are right: simulated traces, identified by the command.

Responses are closed forms written here, courses that are recorded are followed in small steps, and
sweeps are complex moduli; each trace draws its own parameters and noise. A set-up is right, or what
is read is of another than the command is told.

The best possible test of a wrong set-up knows the shape that the right model's best fit leaves of
the trace without noise, and whether it is there; its level is that of each of our tests.

    python -m benchmarks.levels                        every set-up, and docs/levels.md
    python -m benchmarks.levels recorded --traces 20   of a group, or by their first words

Traces are added to those that docs/levels.csv has counted; remove rows to count anew.
"""

import argparse
import json
from collections import Counter
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from functools import partial
from io import StringIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pandas as pd

from benchmarks.one_thread import keep_to_one_thread
from biogrip.arrays import Array
from biogrip.files import write_text
from biogrip_study.records.identifications import share_in_words

Rng = np.random.Generator
Course = Callable[[Array], Array]
Values = dict[str, float]
_SEED, _NOISE, _LASTS_S, _LEVEL = 20261128, 0.02, 100.0, 0.003
# A set-up of which nobody knows the start.
_UNKNOWN = "late clock"
# Steps of a recorded course between two rows.
_FINE = 200
RIGHT, WRONG, LOAD, SWEEP, _TAKEN = "right", "wrong", "recorded load", "sweep", " taken for "
ADDS = "instrument"

ALARMS = {
    "neighbours are correlated": "Neighbouring residuals",
    "means of stretches": "residual wanders",
    "step at any time": "readings change at",
    "outliers": "further from the fit than noise",
    "growing noise": "The noise grows",
    "misfit": "the noise of ",
    "offset or drift": "fitted along",
    "another start, or a ramp": "readings begin|protocol starts there|no step but a ramp",
}
"""Tests, by what their sentences have."""


@dataclass(frozen=True)
class Trace:
    """A simulated trace."""

    columns: dict[str, Array]
    truth: Values
    best: float = np.nan
    """Power of the best possible test of what is wrong."""


@dataclass(frozen=True)
class SetUp:
    """What is simulated, and what the command is told."""

    group: str
    name: str
    make: Callable[[Rng], Trace]
    options: tuple[str, ...]


def zener(t: Array, k: float, k_p: float, c: float) -> Array:
    """Relaxation modulus of a Zener solid."""
    found: Array = k_p + k * np.exp(-t * k / c)
    return found


def compliance(t: Array, k_s: float, k_v: float, c_v: float) -> Array:
    """Creep compliance of a Zener solid."""
    found: Array = 1 / k_s - np.expm1(-t * k_v / c_v) / k_v
    return found


def _zener(rng: Rng, last_s: float) -> Values:
    """Draw a relaxation time between 2 and 20 % of a trace, and springs."""
    k, k_p = 80 * 2 ** rng.uniform(-1, 1, 2)
    return {"k": k, "k_p": k_p, "c": k * last_s * 10 ** rng.uniform(-1.7, -0.7)}


def _kelvin(rng: Rng, last_s: float) -> Values:
    k_s, k_v, c_v = _zener(rng, last_s).values()
    return {"k_s": k_s, "k_v": k_v, "c_v": c_v * k_v / k_s}


_RESPONSES = {
    "relaxation": (zener, _zener, ("modulus_Pa", "--reading=modulus", "--model=zener_maxwell")),
    "creep": (
        compliance,
        _kelvin,
        ("J (1/Pa)", "--reading=compliance=J (1/Pa)", "--model=zener_kelvin"),
    ),
}
Change = Callable[[Array, Course, Rng, float], Array]
"""What is read at times of a response, and with noise of which size, if something is wrong."""


def held(
    rng: Rng,
    kind: str,
    time_s: Array,
    lasts: float = 1.0,
    change: Change | None = None,
    rounded: float = 0.0,
    share: float = 0.0,
) -> Trace:
    """Return a trace of what is held from 0; `lasts` are its times over those of its sample."""
    response, draw, (column, *_) = _RESPONSES[kind]
    truth = draw(rng, time_s[-1] / lasts)
    clean = response(time_s, *truth.values())
    sd, best = _NOISE * float(np.max(clean)), np.nan
    if change:
        of = partial(_of, response, truth)
        clean = change(time_s, of, rng, sd)
        best = _best(response, truth, time_s, clean / sd, sd)
    read = clean + (share * clean if share else sd) * rng.standard_normal(len(clean))
    if rounded:
        read = np.round(read / (rounded * sd)) * rounded * sd
    return Trace({"time_s": time_s, column: read}, truth, best)


def _of(response: Any, truth: Values, time_s: Array) -> Array:
    return np.where(time_s > 0, response(np.maximum(time_s, 0.0), *truth.values()), 0.0)


def _best(response: Any, truth: Values, time_s: Array, in_noise: Array, sd: float) -> float:
    """Return the power of an F test of the shape that the best fit leaves of a trace."""
    from scipy.optimize import least_squares
    from scipy.stats import f, ncf

    def left(logs: Array) -> Array:
        found: Array = response(time_s, *np.exp(logs)) / sd - in_noise
        return found

    start = np.log([*truth.values()])
    rest = least_squares(left, start, bounds=(start - 9, start + 9)).fun
    free = len(time_s) - len(start) - 1
    return float(ncf.sf(f.isf(_LEVEL, 1, free), 1, free, max(float(rest @ rest), 1e-9)))


def _zero(time_s: Array, of: Course, _rng: Rng, _sd: float) -> Array:
    clean: Array = of(time_s)
    return clean + 0.05 * np.max(clean)


def _late(time_s: Array, of: Course, _rng: Rng, _sd: float) -> Array:
    return of(time_s - 0.02 * time_s[-1])


def _ramp(time_s: Array, of: Course, _rng: Rng, _sd: float) -> Array:
    shares = (np.arange(100) + 0.5) / 100
    return np.mean([of(time_s - share * 0.1 * time_s[-1]) for share in shares], axis=0)


def _two_branches(time_s: Array, of: Course, _rng: Rng, _sd: float) -> Array:
    return 0.5 * (of(time_s) + of(time_s / 10))


CHANGES: dict[str, Change] = {
    "jump of 2 noises halfway": lambda t, of, _, sd: of(t) + 2 * sd * (t > t[-1] / 2),
    "gain 10 % lower after half": lambda t, of, *_: of(t) * np.where(t > t[-1] / 2, 0.9, 1.0),
    "start 2 % of the trace late": _late,
    "ramp of 10 % taken for a step": _ramp,
    "first two readings 5 noises high": lambda t, of, _, sd: of(t) + 5 * sd * (t <= t[1]),
    "zero 5 % of the peak off": _zero,
    "drift of 3 noises": lambda t, of, _, sd: of(t) + 3 * sd * t / t[-1],
    "two branches, ten times apart": _two_branches,
}
"""What may be wrong with what is read."""


def _rows(rng: Rng, last_s: float, interval_s: float) -> Array:
    """Return times from 0 or later on, at an interval of its own."""
    interval_s = interval_s * float(rng.uniform(0.7, 1.4))
    first, rows = int(rng.integers(0, 2)), int(last_s / interval_s)
    return np.linspace(first * interval_s, (rows - 1) * interval_s, rows - first)


def _sine(rng: Rng) -> tuple[Array, Course]:
    """Return 25 to 60 rows a period of 2 s."""
    return np.arange(rng.integers(0, 2), 500) * 2 / rng.integers(25, 61), lambda t: np.sin(
        np.pi * t
    )


def _smooth(rng: Rng) -> tuple[Array, Course]:
    """Return a load that comes without a step, and three sinusoids."""
    rates, sizes = rng.uniform(0.3, 3.0, (3, 1)), rng.uniform(0.2, 1.0, 3)
    return _rows(rng, 12.0, 0.04), lambda t: sizes @ (1 - np.cos(rates * t))


def _steps(rng: Rng) -> tuple[Array, Course]:
    """Return steps up and down, each at any time between two rows."""
    at_s, sizes = 1.0 + 3.5 * np.arange(3) + rng.uniform(0, 1.5, 3), rng.uniform(0.5, 1.5, 3)
    heights = sizes * [1, -0.7, 1]
    return _rows(rng, 12.0, 0.1), lambda t: heights @ (np.asarray(t) >= at_s[:, None])


def _late_clock(rng: Rng) -> tuple[Array, Course]:
    """Return a hold from 0 whose first row comes late."""
    first_s = float(rng.uniform(0.1, 1.0))
    return np.linspace(first_s, first_s + 10, 201), lambda t: np.ones_like(t)


def _held_later(rng: Rng) -> tuple[Array, Course]:
    """Return a hold that comes between two rows, after 2 s, and lasts for 20 to 60 s."""
    at_s = 2.0 + float(rng.uniform(0.0, 0.2))
    return _rows(rng, float(rng.uniform(20.0, 60.0)), 0.2), lambda t: np.where(t >= at_s, 1.0, 0.0)


def _mid_phase(rng: Rng) -> tuple[Array, Course]:
    """Return a sine of 2 s that is recorded from any phase on."""
    phase, rows = rng.uniform(0, 2 * np.pi), int(rng.integers(25, 101))
    return np.arange(300) * 2 / rows, lambda t: np.sin(np.pi * t + phase)


def creeps(rng: Rng, course: Callable[[Rng], tuple[Array, Course]], sensor: float = 0.0) -> Trace:
    """Return the strain of a Zener solid under a course that is recorded with it."""
    from scipy.signal import lfilter

    (time_s, load), truth = course(rng), {"k_s": 500.0, "k_v": 300.0, "c_v": 150.0}
    k_s, k_v, c_v = truth.values()
    fine_s = np.linspace(0.0, time_s[-1], _FINE * len(time_s))
    # Exact for a load that is linear from one fine time to the next.
    stride = fine_s[1] * k_v / c_v
    left, share = np.exp(-stride), -np.expm1(-stride) / stride
    taken = np.array([1 - share, share - left]) / k_v
    yielded = lfilter(taken, [1.0, -left], load(fine_s), zi=[-taken[0] * load(fine_s)[0]])[0]
    strain = load(time_s) / k_s + np.interp(time_s, fine_s, yielded)
    return _recorded(rng, time_s, load(time_s), strain, truth, "strain", sensor)


def _followed(time_s: Array, course: Course, k: float, c: float) -> tuple[Array, Array]:
    """Return fine times, and the stretch of a spring in series with a damper under a strain."""
    from scipy.signal import lfilter

    fine_s = np.linspace(0.0, time_s[-1], _FINE * len(time_s))
    left = np.exp(-fine_s[1] * k / c)
    # Exact for a strain that is linear from one fine time to the next.
    factor = (1 - left) * c / (k * fine_s[1])
    changes = np.diff(course(fine_s), prepend=0.0)
    return fine_s, lfilter([factor], [1.0, -left], changes)


def relaxing(rng: Rng, course: Callable[[Rng], tuple[Array, Course]], sensor: float = 0.0) -> Trace:
    """Return the stress of a Zener solid under a strain that is recorded with it."""
    (time_s, strain), truth = course(rng), {"k": 80.0, "k_p": 100.0, "c": 240.0}
    fine_s, stretch = _followed(time_s, strain, truth["k"], truth["c"])
    stress = truth["k_p"] * strain(time_s) + truth["k"] * np.interp(time_s, fine_s, stretch)
    return _recorded(rng, time_s, strain(time_s), stress, truth, "stress", sensor)


def presses(rng: Rng) -> Trace:
    """Return the force of a sphere of 2.5 um, with a baseline, whose contact is 0 to 60 nm off."""
    truth = {"k": 1200.0, "k_p": 800.0, "c": 3600.0}
    at_s, off_m = float(rng.uniform(0.4, 0.6)), float(rng.uniform(0.0, 60e-9))
    deepest_m, time_s = float(rng.uniform(400e-9, 600e-9)), np.arange(0.0, 20.0, 0.025)

    def depth_m(t: Array) -> Array:
        return np.minimum((t - at_s) * 2e-6, deepest_m)

    def strain(t: Array) -> Array:
        return np.maximum(depth_m(t), 0.0) ** 1.5

    fine_s, stretch = _followed(time_s, strain, truth["k"], truth["c"])
    moduli = truth["k_p"] * strain(time_s) + truth["k"] * np.interp(time_s, fine_s, stretch)
    clean = 16 / 9 * np.sqrt(2.5e-6) * moduli
    read = clean + np.max(clean) * (0.03 + 0.004 * rng.standard_normal(len(time_s)))
    columns = {"time_s": time_s, "Force (N)": read, "Depth (m)": depth_m(time_s) - off_m}
    return Trace(columns, truth)


def rises(rng: Rng) -> Trace:
    """Return the stress of a Zener solid under a strain of 1 that is reached within 2 s."""
    truth, time_s = _zener(rng, 60.0), np.arange(1.0, 301.0) * 0.2
    k, k_p, c = truth.values()
    tau, inside = c / k, np.minimum(time_s, 2.0)
    spring = tau * (np.exp(-(time_s - inside) / tau) - np.exp(-time_s / tau)) / 2.0
    clean = k_p * inside / 2.0 + k * spring
    read = clean + _NOISE * clean.max() * rng.standard_normal(len(clean))
    return Trace({"time_s": time_s, "stress_Pa": read}, truth)


def with_zero(rng: Rng) -> Trace:
    """Return a creep whose sensor's zero is off by 5 % of the peak, with rows before the start."""
    trace = held(rng, "creep", np.linspace(0.5, _LASTS_S, 200))
    name, before_s = "J (1/Pa)", np.arange(-int(rng.integers(5, 60)), 1) * 0.5
    read, sd = trace.columns[name], _NOISE * float(np.max(trace.columns[name]))
    read = np.append(sd * rng.standard_normal(len(before_s)), read) + 2.5 * sd
    return Trace({"time_s": np.append(before_s, trace.columns["time_s"]), name: read}, trace.truth)


def resists(rng: Rng, course: Callable[[Rng], tuple[Array, Course]], sensor: float = 0.0) -> Trace:
    """Return the stress on a Kelvin-Voigt solid under a strain that is recorded with it."""
    (time_s, strain), truth = course(rng), {"k_p": 180.0, "c_p": 25.0}
    rate = (strain(time_s + 1e-6) - strain(time_s)) / 1e-6
    stress = truth["k_p"] * strain(time_s) + truth["c_p"] * rate
    return _recorded(rng, time_s, strain(time_s), stress, truth, "stress", sensor)


def _recorded(
    rng: Rng, time_s: Array, load: Array, read: Array, truth: Values, name: str, sensor: float
) -> Trace:
    read = read + 0.01 * np.max(np.abs(read)) * rng.standard_normal(len(read))
    load = load + sensor * np.max(np.abs(load)) * rng.standard_normal(len(read))
    names = ("strain", "stress_Pa") if name == "strain" else ("stress_Pa", "strain")
    return Trace({"time_s": time_s, names[0]: read, names[1]: load}, truth)


MODULI: dict[str, tuple[Callable[..., Any], Values]] = {
    "zener_maxwell": (
        lambda s, k, k_p, c: k_p + k * c * s / (k + c * s),
        {"k": 3000.0, "k_p": 500.0, "c": 2000.0},
    ),
    "maxwell": (lambda s, k, c: k * c * s / (k + c * s), {"k": 2000.0, "c": 1000.0}),
    "burgers": (
        lambda s, k_s, c_s, k_v, c_v: 1 / (1 / k_s + 1 / (c_s * s) + 1 / (k_v + c_v * s)),
        {"k_s": 3000.0, "c_s": 9000.0, "k_v": 2000.0, "c_v": 1500.0},
    ),
    "kelvin_voigt": (lambda s, k_p, c_p: k_p + c_p * s, {"k_p": 500.0, "c_p": 100.0}),
    "springpot_beside_damper": (
        lambda s, k_alpha, alpha, c_p: k_alpha * s**alpha + c_p * s,
        {"k_alpha": 600.0, "alpha": 0.2, "c_p": 3.0},
    ),
}
"""Complex moduli at s = i omega, and parameters."""


def swept(rng: Rng, model: str) -> Trace:
    """Return a sweep of 25 frequencies over three decades, with noise of 2 and 3 %."""
    omega, (modulus, truth) = np.geomspace(0.1, 100.0, 25), MODULI[model]
    truth = {
        name: it * (1 if name == "alpha" else 2 ** rng.uniform(-1, 1)) for name, it in truth.items()
    }
    clean = modulus(1j * omega, **truth)
    storage, loss = (
        part * (1 + share * rng.standard_normal(len(omega)))
        for part, share in ((clean.real, 0.02), (clean.imag, 0.03))
    )
    return Trace({"omega_rad_per_s": omega, "storage_Pa": storage, "loss_Pa": loss}, truth)


def _set_ups() -> list[SetUp]:
    even, log = partial(_times, 0), partial(_times, n=60)
    told = ("--start=0",)
    right: tuple[tuple[str, str, dict[str, Any], tuple[str, ...]], ...] = (
        ("12 readings", "relaxation", {"time_s": even(12)}, told),
        ("40 readings", "creep", {"time_s": even(40)}, told),
        ("200 readings, start not told", "relaxation", {"time_s": even(200)}, ()),
        ("200 readings, start not told", "creep", {"time_s": even(200)}, ()),
        ("2,000 readings", "relaxation", {"time_s": even(2000)}, told),
        ("60 readings over 3 decades", "creep", {"time_s": log(3)}, told),
        ("60 readings over 6 decades", "relaxation", {"time_s": log(6)}, told),
        ("short: 5 to 50 % of tau", "creep", {"time_s": even(100), "lasts": 0.01}, told),
        ("long: 50 to 500 tau", "relaxation", {"time_s": even(400), "lasts": 10.0}, told),
        (
            "noise of 10 %, told",
            "creep",
            {"time_s": even(100), "share": 0.1},
            (*told, "--noise-share=0.1"),
        ),
        ("rounded to 2 noises", "relaxation", {"time_s": even(200), "rounded": 2.0}, told),
    )
    found = [
        SetUp(
            RIGHT,
            f"{name}, {kind}",
            partial(held, kind=kind, **given),
            (*_RESPONSES[kind][2][1:], *options),
        )
        for name, kind, given, options in right
    ]
    relaxes = _RESPONSES["relaxation"][2][1:]
    found += [
        SetUp(
            WRONG,
            name,
            partial(held, kind="relaxation", time_s=even(200), change=change),
            relaxes if change is _late else (*relaxes, *told),
        )
        for name, change in CHANGES.items()
    ]
    creep = "--reading=strain=strain", "--load=stress_Pa", "--model=zener_kelvin"
    resist = "--reading=stress=stress_Pa", "--load=strain", "--model=kelvin_voigt"
    found += [
        SetUp(LOAD, name, partial(make, course=course, sensor=sensor), options)
        for name, make, course, sensor, options in (
            ("sine", creeps, _sine, 0.0, creep),
            ("sine, Kelvin-Voigt", resists, _sine, 0.0, resist),
            ("steps between rows", creeps, _steps, 0.0, creep),
            (_UNKNOWN, creeps, _late_clock, 0.0, creep),
            ("smooth", creeps, _smooth, 0.0, creep),
            ("smooth, Kelvin-Voigt", resists, _smooth, 0.0, resist),
            ("smooth, noisy sensor", creeps, _smooth, 0.002, creep),
        )
    ]
    zener = "--reading=stress=stress_Pa", "--load=strain", "--model=zener_maxwell"
    sphere = "--reading=force=Force (N)", "--load=Depth (m)", "--shape=sphere 2.5 um"
    rise = "--reading=stress=stress_Pa", "--hold=1", "--ramp=2s", "--model=zener_maxwell"
    found += [
        SetUp(ADDS, "zero, told by rows before", with_zero, (*_RESPONSES["creep"][2][1:], *told)),
        SetUp(ADDS, "contact and baseline", presses, (*sphere, "--model=sls", "--contact=fit")),
        SetUp(ADDS, "rise of 2 s", rises, rise),
        SetUp(ADDS, "from mid-phase, Kelvin-Voigt", partial(resists, course=_mid_phase), resist),
    ]
    found += [
        SetUp(
            ADDS,
            f"{name}, sensor of {100 * sensor:g} %",
            partial(make, course=course, sensor=sensor),
            options,
        )
        for name, make, course, options in (
            ("held, relaxation", relaxing, _held_later, zener),
            ("held, creep", creeps, _held_later, creep),
            ("sine, relaxation", relaxing, _sine, zener),
        )
        for sensor in (0.002, 0.01, 0.05)
    ]
    read = "--frequency=omega_rad_per_s", "--reading=storage=storage_Pa", "--reading=loss=loss_Pa"
    taken = (
        ("maxwell", "kelvin_voigt"),
        ("burgers", "zener_maxwell"),
        ("springpot_beside_damper", "zener_maxwell"),
    )
    return found + [
        SetUp(
            SWEEP,
            name if name == model else f"{name}{_TAKEN}{model}",
            partial(swept, model=name),
            (*read, f"--model={model}"),
        )
        for name, model in (*((name, name) for name in MODULI), *taken)
    ]


def _times(decades: int, n: int) -> Array:
    """Return even times, or logarithmic ones over decades, to the end of a trace."""
    first = _LASTS_S * (10.0**-decades if decades else 1 / n)
    return (np.geomspace if decades else np.linspace)(first, _LASTS_S, n)


def measure(set_up: SetUp, traces: int, first: int = 0) -> dict[str, Any]:
    """Identify traces of a set-up by the command, from a number on, and count what it says."""
    from biogrip.cli import main as command

    numbers = [_SEED, *set_up.name.encode()]
    made = [set_up.make(np.random.default_rng([*numbers, n])) for n in range(first, first + traces)]
    with TemporaryDirectory() as folder:
        files = [Path(folder) / f"{n:04}.csv" for n in range(traces)]
        for file, trace in zip(files, made, strict=True):
            pd.DataFrame(trace.columns).to_csv(file, index=False, float_format="%.10g")
        table = Path(folder) / "found.csv"
        with redirect_stdout(StringIO()), redirect_stderr(StringIO()):
            given = (*set_up.options, "--no-compare", "--csv", table)
            command(["identify", *map(str, (*files, *given))])
        found = pd.read_csv(table, dtype={"reasons": str})
    limits, status = [], Counter(found["fit"])
    for trace, (_, row) in zip(made, found.iterrows(), strict=True):
        for name, value in trace.truth.items():
            low, high = (_end(row, name, end) for end in ("low", "high"))
            if low == low or high == high:
                holds = not (value < low or value > high)
                limits.append((name, holds, row["fit"] == "ok"))
    told = pd.DataFrame(limits, columns=["quantity", "holds", "ok"])
    reasons = found["reasons"].fillna("")
    return {
        "group": set_up.group,
        "set_up": set_up.name,
        "traces": traces,
        **{each: status[each] for each in ("ok", "doubtful", "rejected", "failed")},
        "limits": len(told),
        "hold": int(told["holds"].sum()),
        "limits_of_ok": int(told["ok"].sum()),
        "hold_of_ok": int((told["holds"] & told["ok"]).sum()),
        "best_test": float(np.mean([trace.best for trace in made])),
        **{test: int(reasons.str.contains(words).sum()) for test, words in ALARMS.items()},
        "held_by_quantity": json.dumps(
            {
                name: [int(its["holds"].sum()), len(its)]
                for name, its in told.groupby("quantity", sort=False)
            }
        ),
    }


def _end(row: Any, name: str, end: str) -> float:
    """Return a limit of a quantity, NaN if there is none."""
    return float(next((row[it] for it in row.index if it.startswith(f"{name} {end}")), np.nan))


_PAGE = """# How often a verdict is right

{answer}

Traces are simulated by closed forms that share nothing with biogrip, with noise of 2 % of the
largest reading where nothing else is said, and identified by `biogrip identify --no-compare`.
Shares have 95 % intervals (Wilson's); those of limits count limits of one trace as independent, and
are up to twice as wide. [levels.csv](levels.csv) has all counts, by quantity and by test;
`python -m benchmarks.levels` makes this page.

## The set-up is right

All should be ok, and 95 % of limits should hold the truth.

{right}

Of these traces and of those with a recorded load below, {n}, tests blamed {tests};
each other one of {all_tests} blamed none, {none}. The level of each is 0.3 %, or 0.1 % if it may
reject a fit.

## The load or the strain was recorded

Rows have both; steps come between rows. A late clock begins after the step: no reading tells when
that was, and doubt is right.

{load}

## What the instrument adds

A zero off by 5 % of the peak, of which rows before the start tell; a contact 0 to 60 nm off, beside
a baseline of 3 %; a rise that is told; an oscillation recorded from any phase on; records whose
sensor has noise.

{adds}

## A frequency sweep

25 frequencies over three decades, noise of 2 and 3 % of storage and loss modulus.

{sweep}

## The set-up is wrong

200 readings of relaxation. None should be ok. The best test is the F test at the level of ours that
knows the shape that the right model's best fit leaves: more than anybody knows.

{wrong}
"""


def _table(rows: pd.DataFrame, *, wrong: bool = False) -> str:
    """Return a line a set-up, of wrong ones with the power of the best possible test."""
    lines = []
    for row in rows.to_dict("records"):
        line = {"set-up": row["set_up"], "traces": row["traces"]}
        line["ok"] = share_in_words(row["ok"], row["traces"])
        if wrong:
            line["limits of these that hold"] = f"{row['hold_of_ok']} of {row['limits_of_ok']}"
            line["rejected"] = row["rejected"]
            line["best test"] = f"{100 * row['best_test']:.0f} %"
        else:
            line["limits that hold"] = _held(row)
        lines.append(line)
    return str(pd.DataFrame(lines).to_markdown(index=False, disable_numparse=True))


def _held(row: Any) -> str:
    return share_in_words(row["hold"], row["limits"]) if row["limits"] else ""


def _page(rows: pd.DataFrame) -> str:
    """Return the page of all set-ups."""
    of = {group: rows[rows["group"] == group] for group in (RIGHT, LOAD, ADDS, SWEEP, WRONG)}
    own = of[SWEEP][~of[SWEEP]["set_up"].str.contains(_TAKEN)]
    told = of[LOAD][of[LOAD]["set_up"] != _UNKNOWN]
    right, wrong = pd.concat([of[RIGHT], told, own]), of[WRONG]

    def share(rows: pd.DataFrame, of: str, among: str = "traces") -> str:
        return share_in_words(int(rows[of].sum()), int(rows[among].sum()))

    in_time = pd.concat([of[RIGHT], told])
    blamed = {test: int(in_time[test].sum()) for test in ALARMS}
    return _PAGE.format(
        answer=(
            f"**Of {right['traces'].sum()} traces whose set-up is right {share(right, 'ok')} are "
            f"ok, and {share(right, 'hold', 'limits')} of their limits hold the truth. Of "
            f"{wrong['traces'].sum()} with an error {share(wrong, 'ok')} pass as ok.**"
        ),
        n=in_time["traces"].sum(),
        right=_table(of[RIGHT]),
        tests=", ".join(f"{n} ({test})" for test, n in blamed.items() if n),
        all_tests=len(ALARMS),
        none=share_in_words(0, int(in_time["traces"].sum())),
        load=_table(of[LOAD]),
        adds=_table(of[ADDS]),
        sweep=_table(of[SWEEP]),
        wrong=_table(wrong, wrong=True),
    )


def main() -> None:
    """Measure the set-ups that are asked for, and write all rows and the page."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("names", nargs="*", help="first words of groups or set-ups; default: all")
    parser.add_argument("--traces", type=int, default=200, help="of each set-up (200)")
    parser.add_argument("--table", type=Path, default=Path("docs/levels.csv"))
    asked = parser.parse_args()
    every = _set_ups()
    for set_up in every:
        if not asked.names or f"{set_up.group} {set_up.name}".startswith(tuple(asked.names)):
            rows = pd.read_csv(asked.table) if asked.table.is_file() else pd.DataFrame()
            before = [it for it in rows.to_dict("records") if it["set_up"] == set_up.name]
            first = before[0]["traces"] if before else 0
            row = added(*before, measure(set_up, asked.traces, first))
            print(*(f"{name}: {value}" for name, value in row.items()), sep="; ", flush=True)
            write({it["set_up"]: it for it in (*rows.to_dict("records"), row)}, asked.table)


def added(row: dict[str, Any], *more: dict[str, Any]) -> dict[str, Any]:
    """Return the counts of rows of one set-up together."""
    for other in more:
        counts = [name for name, value in row.items() if isinstance(value, int)]
        quantities, others = (json.loads(it["held_by_quantity"]) for it in (row, other))
        for name, pair in others.items():
            quantities[name] = [
                a + b for a, b in zip(pair, quantities.get(name, (0, 0)), strict=True)
            ]
        best = np.average(
            [it["best_test"] for it in (row, other)], weights=[it["traces"] for it in (row, other)]
        )
        row = {
            **row,
            **{name: row[name] + other[name] for name in counts},
            "best_test": float(best),
            "held_by_quantity": json.dumps(quantities),
        }
    return row


def write(rows: dict[str, dict[str, Any]], table: Path) -> None:
    """Write rows in the order of their set-ups, and the page if all are there."""
    names = [set_up.name for set_up in _set_ups()]
    found = pd.DataFrame([rows[name] for name in names if name in rows])
    write_text(table, found.to_csv(index=False, float_format="%.4g"))
    if len(found) == len(names):
        write_text(table.with_suffix(".md"), _page(found))


if __name__ == "__main__":
    keep_to_one_thread()
    main()
