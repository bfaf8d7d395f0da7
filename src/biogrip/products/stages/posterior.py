"""Stage 4: posterior samples of one trace of a case, and evidence of sample models."""

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from biogrip.arrays import Array
from biogrip.digits import rounded
from biogrip.experiment.random_streams import stream
from biogrip.experiment.sample import SampleModel
from biogrip.files import write_text
from biogrip.identifiability.posterior_settings import PosteriorSettings
from biogrip.identify.answer import Progress, silent
from biogrip.identify.case_problem import CaseProblem
from biogrip.identify.identifier import best_fit
from biogrip.identify.methods import METHODS
from biogrip.identify.model_choice import ranked
from biogrip.identify.problem import Problem
from biogrip.products.files.posterior import (
    POSTERIOR,
    SAMPLES,
    Limits,
    limits_in,
    posterior_data,
    thinned,
    write_samples,
)
from biogrip.products.files.traces import read_measurements
from biogrip.products.files.verdicts import PATH, read_verdicts
from biogrip.products.product import JUDGEMENT, Product, the, wildcards_of
from biogrip.products.stages.calibrated import CALIBRATED
from biogrip.products.stages.judgement import JUDGED_TRACE, TRACE, fit_judged
from biogrip.products.uses import from_case
from biogrip.study.study import Case

# Imported lazily: the sampler takes a second to import.
_SAMPLER = "biogrip.identifiability.sampling"
_SENSITIVITY = "biogrip.identifiability.prior_sensitivity"
_EVIDENCE = "biogrip.identifiability.evidence"


def sample(
    case: Case,
    measurements: Path,
    verdicts: Path,
    calibrated: list[Path],
    posterior: Path,
    samples: Path,
) -> None:
    """Sample the posterior of the trace of seed 0."""
    recorded = read_measurements(measurements, [TRACE])
    case_problem = case.problem.calibrated(calibrated).weighted(recorded.sd_rad)
    time_s, trace = recorded.time_s, recorded.rotation_rad[TRACE]
    limits = limits_in(read_verdicts(verdicts))
    pose = partial(case_problem.of, time_s, trace)
    if not case_problem.plain:
        # Use the noise model that the verdicts are based on.
        fit = fit_judged(case, case_problem, time_s, trace, TRACE)
        pose = partial(case_problem.for_model, fit.problem)
    data, drawn = posterior_of_trace(case, case_problem, pose, limits, silent)
    write_samples(samples, case_problem.searched, drawn)
    write_text(posterior, json.dumps({"case": case.name, **data}, indent=1) + "\n")


def posterior_of_trace(
    case: Case,
    case_problem: CaseProblem,
    pose: Callable[[SampleModel], Problem],
    limits: Limits,
    progress: Progress,
) -> tuple[dict[str, Any], Array]:
    """Sample the posterior of a trace, and compute the evidence of other models.

    A function returns the trace's fit problem for a sample model; the limits are those of its
    profile likelihoods. Returns the summary of the posterior, and some thousand samples of the
    log-parameters, (n, n_parameters).
    """
    from biogrip.identifiability.marginals import compute_marginals
    from biogrip.identifiability.prior_sensitivity import compute_sensitivities
    from biogrip.identifiability.quantities import parameters_and_sum
    from biogrip.identifiability.sampling import sampled

    rng = stream(case.study.study_seed, case.name, TRACE, "posterior")
    problem, block = pose(case_problem.searched), _posterior_block(case)
    posterior = _posterior(problem, block, case_problem.noise_rad)
    found = sampled(posterior, block, rng, progress)
    drawn = thinned(found.log_parameters)
    every = found.log_parameters.reshape(-1, drawn.shape[1])
    quantities = parameters_and_sum(case_problem.searched)
    marginals = compute_marginals(every, quantities, problem.residuals.duration_s, case.confidence)
    sensitivities = compute_sensitivities(posterior, drawn, quantities)
    data = {
        "model": case_problem.model.name,
        "confidence": case.confidence,
        **posterior_data(
            found, block, marginals, sensitivities, limits, exact_onset=case_problem.fit_start
        ),
        "evidence": _evidence(case, pose, case_problem.noise_rad, progress),
    }
    return data, drawn


def _posterior_block(case: Case) -> PosteriorSettings:
    assert case.posterior is not None
    return case.posterior


def _posterior(problem: Problem, block: PosteriorSettings, noise_rad: float | None) -> Any:
    from biogrip.identifiability.posterior import Posterior
    from biogrip.identifiability.prior import make_prior

    prior = make_prior(problem.residuals.model, problem.low, problem.high, block.prior)
    return Posterior(problem, prior, noise_rad)


def _evidence(
    case: Case,
    of_model: Callable[[SampleModel], Problem],
    noise_rad: float | None,
    progress: Progress,
) -> list[dict[str, Any]]:
    """Return one row per model: evidence, AIC and BIC, as differences from the best."""
    if not case.compared_models:
        return []
    from biogrip.identifiability.evidence import compute_evidence
    from biogrip.identifiability.sampling import sampled

    rows, misfits, samples, block = [], [], 0, _posterior_block(case)
    for name, candidate in case.compared_models.items():
        problem = of_model(candidate.model)
        samples = problem.residuals.samples
        fits = stream(case.study.study_seed, case.name, TRACE, f"model {name}")
        misfits.append(best_fit(problem, case.least_squares, fits, silent).misfit_rad)
        rng = stream(case.study.study_seed, case.name, TRACE, f"evidence {name}")
        posterior = _posterior(problem, block, noise_rad)
        found = sampled(posterior, block, rng, progress)
        own = compute_evidence(posterior, found, rng)
        rows.append((own, found.convergence.reached))
    highest = max(own.log for own, _ in rows)
    tried = ranked(list(case.compared_models), misfits, samples)
    return [
        {
            "model": each.candidate,
            "title": each.model.title,
            "parameters": len(each.model.names),
            "delta_aic": rounded(each.delta_aic),
            "delta_bic": rounded(each.delta_bic),
            "log_evidence": float(np.round(own.log, 3)),
            "delta_log_evidence": float(np.round(highest - own.log, 3)),
            "error": rounded(own.error),
            "reliable": bool(own.reliable and reached),
        }
        for each, (own, reached) in zip(tried, rows, strict=True)
    ]


SAMPLED = Product(
    "posterior_samples",
    {"posterior": POSTERIOR, "samples": SAMPLES},
    sample,
    from_case("name problem least_squares confidence posterior compared_models study.study_seed"),
    lambda plan: wildcards_of(plan.study.sampled),
    message="Sampling the posterior of the first trace of {case}",
    reads={
        "measurements": JUDGED_TRACE,
        "verdicts": the(PATH),
        "calibrated": CALIBRATED,
    },
    weight=JUDGEMENT,
    modules=lambda _: (METHODS["least_squares"].module, _SAMPLER, _SENSITIVITY, _EVIDENCE),
)
