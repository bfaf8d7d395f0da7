"""lmfit and RheoJAX on measured traces, called as their documentation shows.

lmfit has no models of rheology: its user writes the curve, and here is given biogrip's, from moduli
as the eye reads them off a trace, and exponents in the middle. RheoJAX has the springpot, the
fractional Kelvin-Voigt solid, two springpots in series (its `FractionalMaxwellModel`), the
fractional Jeffreys liquid and Maxwell branches, all under a step. It starts by itself, takes no
standard deviations, and divides the readings of all but Maxwell branches by themselves.
"""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import lmfit
import numpy as np
from rheojax.models import (
    FractionalJeffreysModel,
    FractionalKelvinVoigt,
    FractionalMaxwellModel,
    GeneralizedMaxwell,
    SpringPot,
)

from benchmarks.field.measured import (
    EQUAL,
    KNOWN,
    RELATIVE,
    Answer,
    Program,
    Said,
    Task,
    natural,
)
from biogrip.arrays import Array

Values = Mapping[str, float]


def by_lmfit(task: Task) -> Answer:
    """Fit biogrip's curve by `Minimizer.minimize`; limits are those of `conf_interval`.

    Where that fails they are 1.96 of the standard errors of its report.
    """
    deviations = task.deviations(KNOWN)

    def rest(values: lmfit.Parameters) -> Array:
        left: Array = task.curve(values.valuesdict()) - task.data
        return left if deviations is None else left / deviations

    given = lmfit.create_params(
        **{name: _by_eye(task, name) for name in task.experiment(EQUAL).searched.names}
    )
    minimizer = lmfit.Minimizer(rest, given)
    result = minimizer.minimize()
    values = result.params.valuesdict()
    return Answer(task.curve(values), dict(values), partial(_lmfit_says, minimizer, result))


def _by_eye(task: Task, name: str) -> dict[str, float]:
    if name in {"alpha", "beta"}:
        return {"value": 0.5 if name == "alpha" else 0.25, "min": 0.0, "max": 1.0}
    level = float(np.median(task.data))
    if not task.experiment(EQUAL).instrument.deforms:
        level = 1 / level
    times = np.geomspace(task.time_s[0], task.time_s[-1], task.sample.branches + 2)[1:-1]
    if name.startswith("c"):
        level *= times[int(name[-1]) - 1 if name[-1].isdigit() else 0]
    return {"value": level, "min": 0.0}


def _lmfit_says(minimizer: lmfit.Minimizer, result: lmfit.minimizer.MinimizerResult) -> Said:
    try:
        ends = lmfit.conf_interval(minimizer, result, sigmas=[0.95])
    except Exception:
        return {name: (p.value, *_around(p.value, p.stderr)) for name, p in result.params.items()}
    return {
        name: (result.params[name].value, float(of[0][1]), float(of[-1][1]))
        for name, of in ends.items()
    }


def _around(value: float, deviation: float | None) -> tuple[float | None, float | None]:
    if deviation is None or not np.isfinite(deviation):
        return None, None
    return value - 1.96 * deviation, value + 1.96 * deviation


def _in_series(p: Values) -> Values | None:
    """Two springpots in series, of c1 (iw)^alpha / (1 + (iw tau)^beta), which also has others."""
    if p["beta"] > p["alpha"]:
        return None
    return {
        "k_alpha": p["c1"],
        "alpha": p["alpha"],
        "k_beta": p["c1"] / p["tau"] ** p["beta"],
        "beta": p["alpha"] - p["beta"],
    }


def _jeffreys(p: Values) -> Values:
    """The liquid of eta1 s (1 + (s tau2)^alpha) / (1 + (s tau1)^alpha), tau2 = tau1 eta2/eta1."""
    c_p = p["eta1"] * (p["eta2"] / p["eta1"]) ** p["alpha"]
    c = p["eta1"] - c_p
    return {"k_alpha": c / p["tau1"] ** p["alpha"], "alpha": 1 - p["alpha"], "c": c, "c_p": c_p}


def _branches(p: Values) -> Values:
    modes = range(1, len(p) // 2 + 1)
    return {
        "k_p": p["G_inf"],
        **{f"k_{j}": p[f"G_{j}"] for j in modes},
        **{f"c_{j}": p[f"G_{j}"] * p[f"tau_{j}"] for j in modes},
    }


_IN_RHEOJAX: Mapping[str, tuple[Callable[..., Any], Callable[[Values], Values | None]]] = {
    "springpot": (SpringPot, lambda p: {"k_alpha": p["c_alpha"], "alpha": p["alpha"]}),
    "fractional_kelvin_voigt": (
        FractionalKelvinVoigt,
        lambda p: {"k_p": p["Ge"], "k_alpha": p["c_alpha"], "alpha": p["alpha"]},
    ),
    "springpots_in_series": (FractionalMaxwellModel, _in_series),
    "fractional_jeffreys": (FractionalJeffreysModel, _jeffreys),
    "generalized_maxwell": (GeneralizedMaxwell, _branches),
}


def by_rheojax(task: Task) -> Answer:
    """Fit a model of RheoJAX by `fit`; limits are `FitResult.params_ci`."""
    make, translate = _IN_RHEOJAX[task.sample.name]
    how: dict[str, Any] = {}
    if make is GeneralizedMaxwell:
        make, how = partial(make, n_modes=task.sample.branches), {"optimization_factor": None}
    kind = "relaxation" if task.experiment(EQUAL).instrument.deforms else "creep"
    result = make().fit(task.time_s, task.data, test_mode=kind, return_result=True, **how)
    ends = result.params_ci or {}
    return Answer(
        np.asarray(result.fitted_curve),
        translate(result.params),
        lambda: {n: (v, *ends.get(n, (None, None))) for n, v in result.params.items()},
    )


def _under_a_step(task: Task) -> bool:
    return task.load_s is not None or task.name != "hl60"


PEERS = (
    Program("lmfit, biogrip's curve", by_lmfit, lambda task: True, natural),
    Program(
        "RheoJAX",
        by_rheojax,
        lambda task: _under_a_step(task) and task.sample.name in _IN_RHEOJAX,
        lambda task: EQUAL if task.sample.name == "generalized_maxwell" else RELATIVE,
    ),
)
