"""Where those start who have to be told: what the eye reads off a trace of creep."""

import numpy as np

from benchmarks.field.elements import Kelvin
from benchmarks.field.traces import Trace


def by_eye(trace: Trace) -> Kelvin:
    """Return the ends of the trace, the rise shared out among times even on a logarithmic axis."""
    first, last = float(trace.compliance[0]), float(trace.compliance[-1])
    times = np.geomspace(trace.time_s[0], trace.time_s[-1], trace.branches + 2)[1:-1]
    return Kelvin(first, np.full(trace.branches, (last - first) / trace.branches), times)
