"""RheoJAX: `GeneralizedMaxwell.fit`, on NLSQ.

Its page on the generalized Maxwell model makes ``GeneralizedMaxwell(n_modes=...)``, fits by
``fit(t, data, test_mode=..., optimization_factor=1.5)``, which then drops modes as long as the
coefficient of determination allows it, and gives None for "manual N selection". Both are here.
Starting values and bounds are its own. Its limits are `FitResult.params_ci`, from the
covariance, of ``return_result=True``. It integrates creep in steps; the compliance here is
the exact one of its parameters. Left out is `fit_bayesian`, NUTS after the fit: a chain of the
documented length takes longer than the time limit on a trace of one branch, and its prior, flat
over bounds many decades apart, takes the relaxation times to their upper end.
"""

from functools import partial

import numpy as np
from rheojax.models import GeneralizedMaxwell

from benchmarks.field.elements import Maxwell
from benchmarks.field.fitted import Fitted, Limits, Method
from benchmarks.field.traces import Trace


def fit(trace: Trace, *, optimization_factor: float | None) -> Fitted:
    """Identify a sample by as many modes as it has branches, or fewer."""
    model = GeneralizedMaxwell(n_modes=trace.branches)
    result = model.fit(
        trace.time_s,
        trace.compliance,
        test_mode="creep",
        optimization_factor=optimization_factor,
        return_result=True,
    )
    value = {name: float(model.parameters.get_value(name)) for name in model.parameters}
    modes = range(1, len(value) // 2 + 1)
    k = np.array([value[f"G_{j}"] for j in modes])
    tau = np.array([value[f"tau_{j}"] for j in modes])
    sample = Maxwell(value["G_inf"], k, tau).ordered()
    places = dict(zip(np.argsort(tau) + 1, modes, strict=True))
    return Fitted(
        sample, sample.compliance(trace.time_s), lambda: _limits(result.params_ci or {}, places)
    )


def _limits(ends: Limits, places: dict[int, int]) -> Limits:
    names = {
        "G_inf": "k_p",
        **{f"G_{j}": f"k_{place}" for j, place in places.items()},
        **{f"tau_{j}": f"tau_{place}" for j, place in places.items()},
    }
    return {names[name]: limits for name, limits in ends.items() if np.isfinite(sum(limits))}


METHODS = (
    Method("RheoJAX, all modes", partial(fit, optimization_factor=None)),
    Method("RheoJAX, modes dropped", partial(fit, optimization_factor=1.5)),
)
