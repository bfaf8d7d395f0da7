"""Stage 4: posterior samples of one trace of a case, and evidence of sample models."""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from biogrip.arrays import Array
from biogrip.digits import rounded
from biogrip.experiment.random_streams import stream
from biogrip.experiment.sample import CANDIDATES, Sample, SampleModel
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
from biogrip.products.files.traces import MEASUREMENTS, read_measurements
from biogrip.products.files.verdicts import PATH, read_verdicts
from biogrip.products.plan import Wildcards
from biogrip.products.product import JUDGEMENT, Product, Reads, the, wildcards_of
from biogrip.products.stages import judgement
from biogrip.products.stages.calibrated import calibration_of
from biogrip.products.stages.judgement import TRACE
from biogrip.study.study import Case, Study

# Imported lazily: the sampler takes a second to import.
_SAMPLER = "biogrip.identifiability.sampling"
_EVIDENCE = "biogrip.identifiability.evidence"


@dataclass(frozen=True)
class Settings(judgement.Settings):
    """Settings of posterior sampling for the judged trace.

    Parameters
    ----------
    posterior
        Prior, walkers and steps.
    models
        Those whose evidence is compared, by name, see `CANDIDATES`; none without.
    """

    posterior: PosteriorSettings
    models: Mapping[str, Sample]


def settings_of(study: Study, case: Case) -> Settings:
    """Return the settings that the posterior of a case depends on."""
    assert case.posterior is not None
    compared = case.posterior.evidence and not case.fixed
    return Settings(
        **vars(judgement.settings_of(study, case)),
        posterior=case.posterior,
        models={name: CANDIDATES[name] for name in study.models_of(case)} if compared else {},
    )


def settings(study: Study, job: Wildcards) -> Settings:
    """Return the settings that the posterior of a case depends on."""
    return settings_of(study, study.case(job["case"]))


def sample(
    settings: Settings,
    measurements: Path,
    verdicts: Path,
    calibrated: list[Path],
    posterior: Path,
    samples: Path,
) -> None:
    """Sample the posterior of the trace of seed 0.

    Parameters
    ----------
    settings
        Settings of the job.
    measurements
        Noisy traces, Parquet.
    verdicts
        Verdicts on the same trace, JSON.
    calibrated
        A calibration, YAML, whose arms replace the gripper's, if there is one.
    posterior
        Summary of the posterior, JSON.
    samples
        Posterior samples, Parquet.
    """
    case_problem = settings.problem.calibrated(calibrated)
    recorded = read_measurements(measurements, [TRACE])
    time_s, trace = recorded.time_s, recorded.rotation_rad[TRACE]
    limits = limits_in(read_verdicts(verdicts))
    pose = partial(case_problem.of, time_s, trace)
    if not case_problem.plain:
        # Use the noise model that the verdicts are based on.
        fit = settings.fit(case_problem, time_s, trace, TRACE)
        pose = partial(case_problem.for_model, fit.problem)
    data, drawn = posterior_of_trace(settings, case_problem, pose, limits, silent)
    write_samples(samples, case_problem.searched, drawn)
    write_text(posterior, json.dumps({"case": settings.case, **data}, indent=1) + "\n")


def posterior_of_trace(
    settings: Settings,
    case_problem: CaseProblem,
    pose: Callable[[SampleModel], Problem],
    limits: Limits,
    progress: Progress,
) -> tuple[dict[str, Any], Array]:
    """Sample the posterior of a trace, and compute the evidence of other models.

    Parameters
    ----------
    settings
        Settings of the job.
    case_problem
        Assumptions of the identification, with a calibrated gripper if the case uses one.
    pose
        Function that returns the trace's fit problem for a sample model.
    limits
        Limits of its profile likelihoods.
    progress
        Callback for progress.

    Returns
    -------
    data
        Summary of the posterior.
    log_parameters : (n, n_parameters)
        Some thousand samples.
    """
    from biogrip.identifiability.marginals import compute_marginals
    from biogrip.identifiability.quantities import parameters_and_sum
    from biogrip.identifiability.sampling import sampled

    rng = stream(settings.study_seed, settings.case, TRACE, "posterior")
    problem = pose(case_problem.searched)
    posterior = _posterior(problem, settings.posterior, case_problem.noise_rad)
    found = sampled(posterior, settings.posterior, rng, progress)
    drawn = thinned(found.log_parameters)
    every = found.log_parameters.reshape(-1, drawn.shape[1])
    quantities = parameters_and_sum(case_problem.searched)
    marginals = compute_marginals(
        every, quantities, problem.residuals.duration_s, settings.confidence
    )
    data = {
        "model": case_problem.model.name,
        "confidence": settings.confidence,
        **posterior_data(found, settings.posterior, marginals, limits),
        "evidence": _evidence(settings, pose, case_problem.noise_rad, progress),
    }
    return data, drawn


def _posterior(problem: Problem, settings: PosteriorSettings, noise_rad: float | None) -> Any:
    from biogrip.identifiability.posterior import Posterior
    from biogrip.identifiability.prior import make_prior

    prior = make_prior(problem.residuals.model, problem.low, problem.high, settings.prior)
    return Posterior(problem, prior, noise_rad)


def _evidence(
    settings: Settings,
    of_model: Callable[[SampleModel], Problem],
    noise_rad: float | None,
    progress: Progress,
) -> list[dict[str, Any]]:
    """Return one row per model: evidence, AIC and BIC, as differences from the best."""
    if not settings.models:
        return []
    from biogrip.identifiability.evidence import compute_evidence
    from biogrip.identifiability.sampling import sampled

    rows, misfits, samples = [], [], 0
    for name, candidate in settings.models.items():
        problem = of_model(candidate.model)
        samples = problem.residuals.samples
        fits = stream(settings.study_seed, settings.case, TRACE, f"model {name}")
        misfits.append(best_fit(problem, settings.least_squares, fits, silent).misfit_rad)
        rng = stream(settings.study_seed, settings.case, TRACE, f"evidence {name}")
        posterior = _posterior(problem, settings.posterior, noise_rad)
        found = sampled(posterior, settings.posterior, rng, progress)
        own = compute_evidence(posterior, found, rng)
        rows.append((own, found.convergence.reached))
    highest = max(own.log for own, _ in rows)
    tried = ranked(list(settings.models), misfits, samples)
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
    settings,
    lambda plan: wildcards_of(plan.study.sampled),
    message="Sampling the posterior of the first trace of {case}",
    reads={
        "measurements": Reads(
            lambda plan, job: [plan.batch_of_seed(MEASUREMENTS, job["case"], TRACE)], one=True
        ),
        "verdicts": the(PATH),
        "calibrated": calibration_of(),
    },
    weight=JUDGEMENT,
    modules=lambda _: (METHODS["least_squares"].module, _SAMPLER, _EVIDENCE),
)
