"""pyvisco, which takes relaxation or oscillation, and no creep.

So it is given the relaxation of the same samples, with noise of the same share of the peak. Its
notebook verify_time_master.ipynb loads a master curve by `load.user_master`, passes `master.smooth`
with a window of one, calls ``prony.discretize(df_master)``, which puts a relaxation time in every
decade, and ``prony.fit(df_dis, df_master)``, which fits the moduli by L-BFGS-B. To have fewer
terms, `opt.nprony` calls for each number of them ``prony.discretize(df_master, "min", N)`` and fits
with ``opt=True``, times and all; on a trace of so few decades it has nothing to try itself, so
that call is made here. The instantaneous modulus is the first sample. It gives no limits.
"""

from functools import partial

from pyvisco import load, master, prony

from benchmarks.field.elements import Maxwell
from benchmarks.field.fitted import RELAXATION, Fitted, Method
from benchmarks.field.traces import Trace

# Of a master curve in °C, here of no importance.
_REFERENCE_TEMPERATURE = 20


def fit(trace: Trace, *, terms_given: bool) -> Fitted:
    """Identify a sample by a term a decade, or by as many as it has branches."""
    rows = zip(trace.time_s.tolist(), trace.modulus.tolist(), strict=True)
    lines = ["t,E_relax", "s,MPa", *(f"{time!r},{modulus!r}" for time, modulus in rows)]
    data, _ = load.user_master("\n".join(lines).encode(), "time", _REFERENCE_TEMPERATURE, "E")
    data = master.smooth(data, 1)
    if terms_given:
        found, _ = prony.fit(prony.discretize(data, "min", trace.branches), data, opt=True)
    else:
        found, _ = prony.fit(prony.discretize(data), data)
    share, tau = (found["df_terms"][name].to_numpy(float) for name in ("alpha_i", "tau_i"))
    whole = float(found["E_0"])
    there = share > 0
    own = Maxwell(whole * (1 - share.sum()), whole * share[there], tau[there]).ordered()
    return Fitted(own, own.modulus(trace.time_s))


METHODS = (
    Method("pyvisco, a term a decade", partial(fit, terms_given=False), measured=RELAXATION),
    Method("pyvisco, terms given", partial(fit, terms_given=True), measured=RELAXATION),
)
