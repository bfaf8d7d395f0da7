"""lmfit: a composite `Model`, `Model.fit` and `conf_interval`.

Its chapter "Modeling Data and Curve Fitting" wraps a function as `Model(func, prefix=...)`, adds
models, gives every parameter a value and bounds by `make_params(name=dict(value=..., min=...))`
and calls `model.fit(data, params, x=x)`. Starting values are the user's affair: here
those of `by_eye`. "Calculation of confidence intervals" names the sum of two exponentials as a
case for `conf_interval`, which holds each parameter and fits the others until an F test says
stop; `sigmas` below one are probabilities.
"""

import lmfit
import numpy as np

from benchmarks.field.elements import Kelvin
from benchmarks.field.fitted import Fitted, Limits, Method
from benchmarks.field.starts import by_eye
from benchmarks.field.traces import Trace
from biogrip.arrays import Array


def _instant(t: Array, J: float) -> Array:
    return np.full_like(t, J)


def _retarded(t: Array, J: float, T: float) -> Array:
    return np.asarray(-J * np.expm1(-t / T))


def fit(trace: Trace) -> Fitted:
    """Identify a sample by the trust region (`method="least_squares"`)."""
    time_s, start = trace.time_s, by_eye(trace)
    model = lmfit.Model(_instant, prefix="spring_")
    given = {"spring_J": {"value": start.instant, "min": 0.0}}
    for j in range(trace.branches):
        model += lmfit.Model(_retarded, prefix=f"element{j}_")
        given[f"element{j}_J"] = {"value": start.share[j], "min": 0.0}
        given[f"element{j}_T"] = {
            "value": start.time[j],
            "min": time_s[0] / 10,
            "max": 10 * time_s[-1],
        }
    result = model.fit(
        trace.compliance, model.make_params(**given), t=time_s, method="least_squares"
    )
    value = result.best_values
    found = Kelvin(
        value["spring_J"],
        np.array([value[f"element{j}_J"] for j in range(trace.branches)]),
        np.array([value[f"element{j}_T"] for j in range(trace.branches)]),
    )
    return Fitted(found.maxwell(), result.best_fit, lambda: _limits(result, found))


def _limits(result: lmfit.model.ModelResult, found: Kelvin) -> Limits:
    ends = {
        name: (float(of[0][1]), float(of[-1][1]))
        for name, of in result.conf_interval(sigmas=[0.95]).items()
    }
    limits = {"J_0": ends["spring_J"]}
    for place, j in enumerate(np.argsort(found.time), start=1):
        limits[f"J_{place}"] = ends[f"element{j}_J"]
        limits[f"T_{place}"] = ends[f"element{j}_T"]
    return limits


METHODS = (Method("lmfit", fit),)
