"""mcreep: its model of a spring, a damper and Kelvin-Voigt elements in series.

The example of its docstring makes an `Experiment`, a `Model` of `mcreep.func.evp_s_d_2kv` with the
retardation times given, ``rtimes=[5, 20]`` of a trace of 99 s, and runs it. `Model` documents what
else there is: without `rtimes` the times are fitted, too, from `iguess`, and without that from
SciPy's ones. All three are here, what is given or guessed being read off by eye. `Model.run` reads
a file and draws; what is timed is the step in between, `Model.fit_function_to_data`. In tension the
deformation is the strain; under unit stress that is the compliance. The damper in series, which the
samples do not have, is an element more. Its limits are those of the covariance that it returns,
whose diagonal the documentation calls sigma^2.
"""

from functools import partial
from typing import Any

import numpy as np
from mcreep import const, func, model

from benchmarks.field.elements import Kelvin
from benchmarks.field.fitted import Fitted, Limits, Method
from benchmarks.field.starts import by_eye
from benchmarks.field.traces import Trace
from biogrip.arrays import Array

_FUNCTIONS = {1: func.evp_s_d_1kv, 2: func.evp_s_d_2kv, 3: func.evp_s_d_3kv}
_DEVIATIONS = 1.96


def fit(trace: Trace, *, times_given: bool = False, guess: bool = False) -> Fitted:
    """Identify a sample, whose retardation times may be given, or guessed by eye."""
    start = by_eye(trace)
    how: dict[str, Any] = {}
    if times_given:
        how["rtimes"] = start.time.tolist()
    if guess:
        last = start.instant + start.share.sum()
        how["iguess"] = [last, 0.0, *start.share, *start.time]
    case_problem = model.Model(
        const.Experiment(etype="Tensile", sigma=1.0),
        const.DataParameters(),
        const.PlotParameters(xlabel="t [s]", ylabel="J [m/N]"),
        name="creep",
        func=_FUNCTIONS[trace.branches],
        **how,
    )
    data = np.array([trace.time_s, trace.compliance])
    values, covariance = case_problem.fit_function_to_data(data, trace.time_s[0], trace.time_s[-1])
    shares = values[2 : 2 + trace.branches]
    times = start.time if times_given else values[2 + trace.branches :]
    found = Kelvin(float(values[0] - shares.sum()), shares, times)
    deviations = np.sqrt(np.diag(covariance))
    return Fitted(
        found.maxwell(),
        case_problem.func(trace.time_s, *values),
        lambda: _limits(values, deviations, times, times_given=times_given),
    )


def _limits(values: Array, deviations: Array, times: Array, *, times_given: bool) -> Limits:
    low, high = values - _DEVIATIONS * deviations, values + _DEVIATIONS * deviations
    names = ["J_inf", "flow"]
    places = np.argsort(np.argsort(times)) + 1
    names += [f"J_{place}" for place in places]
    names += [] if times_given else [f"T_{place}" for place in places]
    return {
        name: (float(a), float(b))
        for name, a, b in zip(names, low, high, strict=True)
        if np.isfinite(a + b)
    }


METHODS = (
    Method("mcreep, times given", partial(fit, times_given=True), more_general=True),
    Method("mcreep, times fitted", fit, more_general=True),
    Method("mcreep, times fitted from a guess", partial(fit, guess=True), more_general=True),
)
