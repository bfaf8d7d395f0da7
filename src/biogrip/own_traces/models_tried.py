"""Other sample models fitted to a trace: whether the chosen one is what it asks for."""

from typing import Any

from biogrip.digits import rounded
from biogrip.experiment.random_streams import stream
from biogrip.experiment.sample import CANDIDATES
from biogrip.identify.answer import Progress
from biogrip.identify.methods import identifier
from biogrip.identify.model_choice import advice, ranked
from biogrip.products.files.traces import Measurements
from biogrip.study.study import Case, Study


def models_tried(
    study: Study, case: Case, recorded: Measurements, progress: Progress
) -> dict[str, Any]:
    """Fit the other sample models, too, and say which the trace asks for.

    With parameters that are known, or where a fit takes minutes, there is nothing to say.
    """
    posed, candidates = case.problem, study.models_of(case)
    if posed.nonlinear or posed.fixed:
        return {"models": [], "advice": None}
    identify = identifier("least_squares", case.method("least_squares"))
    trace, misfits = posed.of(recorded.time_s, recorded.rotation_rad[0]), []
    for name in candidates:
        model = CANDIDATES[name].model
        problem = posed.for_model(trace, model)
        rng = stream(study.study_seed, case.name, 0, f"model {name}")
        (found,) = identify([problem], [rng], progress)
        misfits.append(found.misfit_rad)
    tried = ranked(candidates, misfits, len(recorded.time_s))
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
