"""Other sample models fitted to a trace: whether the chosen one is what it asks for."""

from typing import Any

from biogrip.digits import rounded
from biogrip.experiment.random_streams import stream
from biogrip.experiment.sample import CANDIDATES, MODELS
from biogrip.experiment.springpot import LONGEST_S
from biogrip.identify.answer import Progress
from biogrip.identify.methods import best_fit
from biogrip.identify.model_choice import advice, ranked
from biogrip.identify.trace_fit import TraceFit
from biogrip.study.study import Case, Study

_MOST_SAMPLES = 50_000


def models_tried(study: Study, case: Case, fit: TraceFit, progress: Progress) -> dict[str, Any]:
    """Fit the other sample models in the same noise, and say which the trace asks for.

    With parameters that are known, or where a fit takes minutes, there is nothing to say.
    """
    posed = case.problem
    # Beside arms that ring there is no springpot yet, and beside so many samples its modes, of
    # which it has dozens, would take gigabytes.
    few = fit.problem.residuals.samples <= _MOST_SAMPLES
    power_laws = _power_laws(posed.torque.end_s) if few and not posed.inertia else []
    candidates = tuple(dict.fromkeys((*study.models_of(case), *power_laws)))
    if posed.nonlinear or posed.fixed:
        return {"models": [], "advice": None}
    least_squares = case.method("least_squares")
    misfits = []
    for name in candidates:
        problem = posed.for_model(fit.problem, CANDIDATES[name].model)
        rng = stream(study.study_seed, case.name, 0, f"model {name}")
        misfits.append(best_fit(problem, least_squares, rng, progress).misfit_rad)
    tried = ranked(candidates, misfits, fit.problem.residuals.samples)
    rows = [
        {
            "model": each.candidate,
            "title": each.model.title,
            "parameters": len(each.model.names),
            "misfit_rad": rounded(each.misfit_rad),
            "delta_aic": rounded(each.delta_aic),
            "delta_bic": rounded(each.delta_bic),
        }
        for each in tried
    ]
    return {"models": rows, "advice": advice(tried, case.sample.candidate)}


def _power_laws(duration_s: float) -> list[str]:
    """Power laws, which cells creep by, where an experiment is no longer than they hold for."""
    return [name for name, model in MODELS.items() if model.power_law and duration_s <= LONGEST_S]
