"""biogrip as docs/library.md shows it: `identify_sample` at the budget and ranges of the study.

The limits are those that the study counts in its table of coverage, profile likelihoods of
the optimum's own basin.
"""

import numpy as np

from benchmarks.field.elements import Maxwell
from benchmarks.field.fitted import Fitted, Limits, Method
from benchmarks.field.traces import Trace
from biogrip.identifiability.likelihood import make_likelihood
from biogrip.identifiability.limits import find_limits
from biogrip.identifiability.quantities import parameters_and_sum
from biogrip.library import Identification, identify_sample

CONFIDENCE = 0.95


def fit(trace: Trace) -> Fitted:
    """Identify a sample from its trace."""
    experiment = trace.experiment
    found = identify_sample(experiment, trace.recorded_s, trace.rotation_rad, trace.seed)
    value = dict(zip(experiment.searched.names, map(float, found.parameters), strict=True))
    k, c = np.array([[value[k], value[c]] for k, c in experiment.model.branches]).T
    sample = Maxwell(value["k_p"], k, c / k).ordered()
    return Fitted(sample, sample.compliance(trace.time_s), lambda: _limits(trace, found))


def _limits(trace: Trace, found: Identification) -> Limits:
    model, branches = trace.experiment.searched, trace.experiment.model.branches
    problem = trace.experiment.of(trace.recorded_s, trace.rotation_rad)
    likelihood = make_likelihood(
        problem, np.log(found.parameters), found.misfit_rad, confidence=CONFIDENCE
    )
    quantities = [q for q in parameters_and_sum(model) if q.label in model.names]
    low, high = find_limits([likelihood], quantities)[0][0].T
    ends = np.nan_to_num(np.exp(low), nan=-np.inf), np.nan_to_num(np.exp(high), nan=np.inf)
    limits = {q.label: (float(a), float(b)) for q, a, b in zip(quantities, *ends, strict=True)}
    value = dict(zip(model.names, found.parameters, strict=True))
    ordered = sorted(branches, key=lambda names: value[names[1]] / value[names[0]])
    return {
        "k_p": limits["k_p"],
        **{f"k_{j}": limits[k] for j, (k, _) in enumerate(ordered, start=1)},
        **{f"c_{j}": limits[c] for j, (_, c) in enumerate(ordered, start=1)},
    }


OURS = "biogrip"
METHODS = (Method(OURS, fit),)
