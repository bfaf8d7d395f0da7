"""How often limits without a model hold, and how wide they are beside those of the right model.

Traces are simulated by inverting Laplace transforms, with noise of 2 % of the largest reading, of
which biogrip is told nothing. The right model's limits are those of first order at the truth.

    python -m benchmarks.without_model [--traces 100]

Written are `results/without_model.csv`, a row per set-up, model and quantity, and `.md`. lmfit is
in the environment of `make bench`.
"""

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from benchmarks.one_thread import keep_to_one_thread
from biogrip.arrays import Array
from biogrip.files import write_text
from biogrip.judging.without_model import LinearLimits, tell_without_model
from biogrip.physics.condensed import Condensed
from biogrip.physics.gripper import NO_ARMS, Arm, Gripper
from biogrip.physics.instruments import INSTRUMENTS
from biogrip.physics.models import MODELS
from biogrip.physics.noise import nuisance_basis
from biogrip.physics.protocol import Phase, hold, join_phases, ramp
from biogrip.physics.residuals import CondensedTrace, Residuals
from biogrip_study.records.identifications import share_in_words
from tests.helpers.laplace import IMPEDANCES

_RESULTS = Path(__file__).parent / "results" / "without_model.csv"
_SEED, _NOISE, _CONFIDENCE, _QUANTILE = 2019, 0.02, 0.95, 1.96
_STIFFNESS_NM, _DAMPING_NMS, _LENGTH_M, _ANGLE_DEG = 4.4e-7, 3.3e-12, 1.5e-3, 75.0
_LEVER_M = _LENGTH_M * np.sin(np.radians(_ANGLE_DEG))
_ARM = Arm(inertia_kgm2=0.0, damping_Nms_per_rad=_DAMPING_NMS, stiffness_Nm_per_rad=_STIFFNESS_NM)
_GRIPPER = Gripper(arm_length_m=_LENGTH_M, reference_angle_deg=_ANGLE_DEG, left=_ARM, right=_ARM)
# Talbot's nodes, and a step of log-parameters for differences.
_NODES, _STEP = 24, 1e-4
_SPREAD_S, _EVEN_S = np.geomspace(0.1, 100.0, 80), np.arange(0.25, 100.0, 0.5)


_PAGE = """# Limits without a model

**Over all sample models, the 95 % limits of each quantity hold in {least:.0f} to {most:.0f} %.**

Of a sample at an edge of what is possible, such as a Maxwell liquid, of whose spectrum all but one
time is zero, 3.84 is too small a rise of chi-squared (P. Batlle et al., Optimization-based
frequentist confidence intervals for functionals in constrained inverse problems: resolving the
Burrus conjecture, arXiv:2310.02461, 2023). So it has one degree of freedom more for each time by
which a fit has fewer than the best (E. Susko, Likelihood ratio tests with boundary constraints
using data-dependent degrees of freedom, Biometrika 100, 2013, 1019-1023). Of few traces a share
scatters further.

Traces of each of the sample models have noise of 2 % of the largest reading; shares have 95 %
intervals (Wilson's), and each model's stand in `without_model.csv`. The right model's limits are
those of first order. A single limit holds with 97.5 %. `python -m benchmarks.without_model` makes
this page.

{table}

## Beside lmfit

Relaxation of three branches, 50 + 60 exp(-t/0.5 s) + 40 exp(-t/5 s) + 30 exp(-t/50 s): {lmfit}
traces as above. lmfit fits a constant and exponentials, and is told how many; its limits are those
of `eval_uncertainty`. Widths are over the value.

{beside}
"""


@dataclass(frozen=True, eq=False)
class SetUp:
    """An instrument and its protocol: as biogrip has it, and as changes of what is controlled."""

    reads: str
    phases: tuple[Phase, ...]
    time_s: Array
    changes: Array
    """Times and heights of changes, (2, n_changes)."""
    order: int = 0
    """0 for changes of the level, 1 for those of its slope."""
    offset: bool = False
    hidden: tuple[str, ...] = ()
    """Models of which nothing is read."""


_ONE = np.array([[0.0], [1.0]])
_TIMES_S = np.arange(0.0, 100.5, 0.5)
_SINE = 1 - np.cos(2 * np.pi * _TIMES_S / 20.0)
_RECORDED = tuple(ramp(0.5, *ends) for ends in pairwise(_SINE))
_CORNERS = np.stack((_TIMES_S[:-1], np.diff(np.diff(_SINE) / 0.5, prepend=0.0)))
_RAMPED = ramp(5.0, 0.0, 1.0), hold(95.0, 1.0)
_TORQUES = hold(50.0, 1.6e-9), hold(50.0, 0.32e-9)
_HELD = (hold(101.0, 1.0),)
SET_UPS = {
    "strain held": SetUp("stress", _HELD, _SPREAD_S, _ONE, hidden=("damper",)),
    "stress held": SetUp("strain", _HELD, _SPREAD_S, _ONE),
    "stress held, offset": SetUp("strain", _HELD, _SPREAD_S, _ONE, offset=True),
    "strain ramped": SetUp("stress", _RAMPED, _EVEN_S, np.array([[0, 5], [0.2, -0.2]]), 1),
    "stress recorded, a sine": SetUp("strain", _RECORDED, _EVEN_S, _CORNERS, 1),
    "gripper, two torques": SetUp(
        "rotation", _TORQUES, _EVEN_S, np.array([[0, 50], [1.6e-9, -1.28e-9]])
    ),
}


def inverted(transform: Callable[[Any], Any], time_s: Array) -> Array:
    """Inverse Laplace transform at times above zero, by the fixed Talbot method."""
    angle = np.pi * np.arange(1, _NODES) / _NODES
    radius = 0.4 * _NODES / time_s[:, None]
    s = radius * angle * (1 / np.tan(angle) + 1j)
    turn = 1 + 1j * (angle + (angle / np.tan(angle) - 1) / np.tan(angle))
    rest = np.sum((np.exp(s * time_s[:, None]) * transform(s) * turn).real, axis=1)
    first = 0.5 * np.exp(0.4 * _NODES) * transform(radius[:, 0] + 0j).real
    found: Array = (first + rest) * radius[:, 0] / _NODES
    return found


@dataclass(frozen=True)
class Truth:
    """A sample in a set-up: what is read, and every quantity."""

    model: str
    set_up: SetUp
    parameters: tuple[float, ...]

    def _impedance(self, s: Any) -> Any:
        return IMPEDANCES[self.model](s, *self.parameters)

    def _response(self, s: Any) -> Any:
        """Reading over what is controlled."""
        if self.set_up.reads == "stress":
            return self._impedance(s)
        if self.set_up.reads == "rotation":
            return 1 / (_STIFFNESS_NM + _DAMPING_NMS * s + 2 * _LEVER_M**2 * self._impedance(s))
        return 1 / self._impedance(s)

    def readings(self) -> Array:
        """Readings without noise."""
        starts, heights = self.set_up.changes
        elapsed = np.round(np.subtract.outer(self.set_up.time_s, starts), 9)
        each, which = np.unique(elapsed[elapsed > 0], return_inverse=True)
        responses = np.zeros_like(elapsed)
        power = self.set_up.order + 1
        responses[elapsed > 0] = inverted(lambda s: self._response(s) / s**power, each)[which]
        return responses @ heights

    def value(self, told: LinearLimits) -> float:
        """Value of a quantity by its name."""
        name, at = told.quantity, told.at_s or 0.0
        if "rad/s" in name:
            modulus = np.complex128(self._modulus(1 / at))
            if self.set_up.reads == "strain":
                modulus = 1 / modulus.conjugate()
            parts = {"'": modulus.real, "''": modulus.imag, "tan delta": np.tan(np.angle(modulus))}
            return float(parts[name.split("(")[0].lstrip("GJ")])
        if name == "viscosity":
            return float(self._impedance(1e-12)) / 1e-12
        if name == "slope at the end":
            return self._rate(at)
        if name.startswith("exponent"):
            return abs(at * self._rate(at) / self._step(at))
        if " to " in name:
            return self._step(at) - self._step(float(name.split()[0][2:]))
        step = self._step({"e": 1e-9, "t": 1e12}.get(name[-1], at))
        if self.set_up.reads == "rotation":
            return (1 / step - _STIFFNESS_NM) / (2 * _LEVER_M**2)
        return step

    def _step(self, time_s: float) -> float:
        return float(inverted(lambda s: self._response(s) / s, np.array([time_s]))[0])

    def _rate(self, time_s: float) -> float:
        return float(inverted(self._response, np.array([time_s]))[0])

    def _modulus(self, omega: float) -> complex:
        """Complex modulus; under a held strain without what relaxes before the first reading."""
        modulus = complex(self._impedance(1j * omega))
        if self.set_up.reads != "stress" or self.set_up.order:
            return modulus
        names = MODELS[self.model].names
        damper = self.parameters[names.index("c_p")] if "c_p" in names else 0.0
        places = np.linspace(0.0, 30.0, 4001)
        rates = np.exp(places) / self.set_up.time_s[0]
        # The spectrum of rates is the jump of G(s)/s across the negative axis.
        s = rates * np.exp(1j * (np.pi - 1e-9))
        spectrum = -(self._impedance(s) / s).imag / np.pi
        fast = np.trapezoid(spectrum * rates * 1j * omega / (rates + 1j * omega), places)
        return modulus - 1j * omega * damper - complex(fast)


@cache
def _condensed(name: str) -> Condensed:
    set_up = SET_UPS[name]
    nuisance = nuisance_basis(set_up.time_s, offset=set_up.offset, drift=False)
    deforms = INSTRUMENTS[set_up.reads].deforms
    return Condensed(join_phases(set_up.phases, deforms=deforms), set_up.time_s, nuisance)


def residuals(name: str, readings: Array) -> Residuals:
    """Pose a trace to biogrip, which does not use the model."""
    set_up, condensed = SET_UPS[name], _condensed(name)
    instrument = INSTRUMENTS[set_up.reads]
    gripper = _GRIPPER if instrument.has_jaws else NO_ARMS
    trace = CondensedTrace(readings, condensed)
    return Residuals(gripper, MODELS["maxwell"], condensed.course, trace, instrument=instrument)


def first_order(truth: Truth, told: list[LinearLimits], noise_sd: float) -> list[float]:
    """Return widths of the right model's limits of quantities; inf where it tells nothing."""
    logs = np.log(truth.parameters)

    def differences(of: Callable[[Truth], Array]) -> Array:
        ends = [
            [
                of(Truth(truth.model, truth.set_up, tuple(np.exp(logs + side * step))))
                for side in (1, -1)
            ]
            for step in _STEP * np.eye(len(logs))
        ]
        return np.array([(up - down) / (2 * _STEP) for up, down in ends])

    slopes = differences(Truth.readings)
    if truth.set_up.offset:
        slopes -= slopes.mean(axis=1, keepdims=True)
    information = slopes @ slopes.T / noise_sd**2
    values, vectors = np.linalg.eigh(information)
    values = np.maximum(values, 1e-9 * values[-1])
    covariance = vectors / values @ vectors.T
    rows = differences(lambda it: np.array([it.value(each) for each in told]))
    return [2 * _QUANTILE * float(np.sqrt(row @ covariance @ row)) for row in rows.T]


def measure(name: str, model: str, traces: int) -> pd.DataFrame:
    """Return a row per trace and quantity: if its limits hold, how many there are, their width."""
    set_up = SET_UPS[name]
    truth = Truth(model, set_up, MODELS[model].example)
    clean = truth.readings()
    noise_sd = _NOISE * float(np.abs(clean).max())
    seeds = np.random.SeedSequence(
        [_SEED, list(SET_UPS).index(name), list(IMPEDANCES).index(model)]
    )
    values, widths, rows = dict[str, float](), dict[str, float](), []
    for rng in map(np.random.default_rng, seeds.spawn(traces)):
        trace = residuals(name, clean + noise_sd * rng.standard_normal(len(clean)))
        found = tell_without_model(trace, confidence=_CONFIDENCE)
        if not values:
            values = {each.quantity: truth.value(each) for each in found.told}
            widths = dict(zip(values, first_order(truth, found.told, noise_sd), strict=True))
        for each in found.told:
            low, high = (np.nan if end is None else end for end in (each.low, each.high))
            rows.append(
                {
                    "set-up": name,
                    "model": model,
                    "quantity": each.quantity,
                    "truth": values[each.quantity],
                    "holds": not (values[each.quantity] < low or values[each.quantity] > high),
                    "limits": int(low == low) + int(high == high),
                    "width": high - low,
                    "of the model": widths[each.quantity],
                    "linear": found.is_linear,
                }
            )
    return pd.DataFrame(rows)


# Modulus at rest, and moduli and times of three branches; times of a trace at which it is told.
_PRONY, _AT_S = np.array([50.0, 60.0, 40.0, 30.0, 0.5, 5.0, 50.0]), (1.0, 10.0, 100.0)


def prony(time_s: Any, parameters: Array) -> Any:
    """Relaxation modulus of Maxwell branches: modulus at rest, moduli, relaxation times."""
    moduli, times_s = np.split(parameters[1:], 2)
    return parameters[0] + np.exp(-np.divide.outer(np.asarray(time_s), times_s)) @ moduli


def beside_lmfit(traces: int) -> pd.DataFrame:
    """Return whether limits of a Prony series' moduli hold, and their widths, and so of lmfit's.

    lmfit is told of one branch too few, of as many as there are, and of one too many.
    """
    from lmfit import create_params
    from lmfit.models import ConstantModel, ExponentialModel

    name, truth, rows = "strain held", prony(_AT_S, _PRONY), []
    clean = prony(SET_UPS[name].time_s, _PRONY)
    for seed in range(traces):
        noise = np.random.default_rng([_SEED, seed]).standard_normal(len(clean))
        readings = clean + _NOISE * clean.max() * noise
        told = tell_without_model(residuals(name, readings), confidence=_CONFIDENCE, at_s=_AT_S)
        levels = [each for each in told.told if each.quantity.startswith("G(")]
        found = {"biogrip, no model": [(each.low or 0.0, each.high or np.inf) for each in levels]}
        for branches in (2, 3, 4):
            series: Any = ConstantModel()
            given = {"c": {"value": 1.0, "min": 0.0}}
            for n, time_s in enumerate(np.geomspace(0.3, 100.0, branches)):
                series += ExponentialModel(prefix=f"b{n}_")
                given[f"b{n}_amplitude"] = {"value": 30.0, "min": 0.0}
                given[f"b{n}_decay"] = {"value": time_s, "min": 1e-3}
            fit = series.fit(readings, create_params(**given), x=SET_UPS[name].time_s)
            middle, half = fit.eval(x=np.array(_AT_S)), np.inf
            if fit.errorbars:
                half = fit.eval_uncertainty(x=np.array(_AT_S), sigma=_CONFIDENCE)
            found[f"lmfit, {branches} branches"] = [*zip(middle - half, middle + half, strict=True)]
        for program, limits in found.items():
            for at_s, value, (low, high) in zip(_AT_S, truth, limits, strict=True):
                rows.append((program, at_s, low <= value <= high, (high - low) / value))
    return pd.DataFrame(rows, columns=["program", "at_s", "holds", "width"])


def table(rows: pd.DataFrame) -> str:
    """Return a line per set-up and quantity, over all models, as Markdown."""
    lines = []
    for (name, quantity), group in rows.groupby(["set-up", "quantity"], sort=False):
        holds = group.groupby("model")["holds"].mean()
        both = group[group["limits"] == 2]
        ratio = both["width"] / both["of the model"]
        lines.append(
            {
                "set-up": name,
                "quantity": quantity,
                "traces": len(group),
                "limits hold": share_in_words(int(group["holds"].sum()), len(group)),
                "least often": f"{holds.min():.0%} ({holds.idxmin()})",
                "both limits": f"{len(both) / len(group):.0%}",
                "width over the right model's": f"{ratio.median():.2g}" if len(both) else "",
            }
        )
    return str(pd.DataFrame(lines).to_markdown(index=False, disable_numparse=True))


def _write(rows: pd.DataFrame, lmfits: pd.DataFrame) -> None:
    """Write what has been measured."""
    kept = rows.groupby(["set-up", "model", "quantity"], sort=False).agg(
        truth=("truth", "first"),
        traces=("holds", "size"),
        holds=("holds", "sum"),
        limits=("limits", "mean"),
        width=("width", "median"),
        of_the_model=("of the model", "first"),
    )
    write_text(_RESULTS, kept.to_csv(float_format="%.4g"))
    holds = 100 * rows.groupby(["set-up", "quantity"])["holds"].mean()
    beside = [
        {
            "program": program,
            **{
                f"G({at_s:g} s)": f"{share_in_words(int(its['holds'].sum()), len(its))}, width "
                f"{its['width'].median():.2g}"
                for at_s, its in own.groupby("at_s")
            },
        }
        for program, own in lmfits.groupby("program")
    ]
    page = _PAGE.format(
        least=holds.min(),
        most=holds.max(),
        table=table(rows),
        lmfit=len(lmfits) // lmfits.groupby(["program", "at_s"]).ngroups,
        beside=pd.DataFrame(beside).to_markdown(index=False, disable_numparse=True),
    )
    write_text(_RESULTS.with_suffix(".md"), page)


def main() -> None:
    """Measure all set-ups and models, and write the results."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--traces", type=int, default=100, help="of each set-up and model")
    traces = parser.parse_args().traces
    parts = [
        measure(name, model, traces)
        for name, set_up in SET_UPS.items()
        for model in IMPEDANCES
        if model not in set_up.hidden
    ]
    _write(pd.concat(parts), beside_lmfit(traces))


if __name__ == "__main__":
    keep_to_one_thread()
    main()
