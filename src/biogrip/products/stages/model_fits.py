"""Stage 4: fits of every sample model to every trace, for model selection."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from biogrip.experiment.nesting import Way, contained
from biogrip.experiment.random_streams import stream
from biogrip.experiment.sample import CANDIDATES, Sample
from biogrip.identify.case_problem import CaseProblem
from biogrip.identify.least_squares import LeastSquaresSettings
from biogrip.identify.methods import METHODS
from biogrip.identify.nested_fits import fit_models
from biogrip.products.files.model_fits import MODEL_FITS
from biogrip.products.files.traces import MEASUREMENTS, Measurements, read_measurements
from biogrip.products.plan import Plan, Wildcards
from biogrip.products.product import Product, Weight, the
from biogrip.products.stages.calibrated import calibration_of
from biogrip.products.stages.groups import groups
from biogrip.progress import Progress
from biogrip.study.study import Study


@dataclass(frozen=True)
class Settings:
    """Settings of the model fits of a case.

    Parameters
    ----------
    study_seed, case
        Random streams derive from them.
    problem, least_squares
        Assumptions of the identification except the model, and settings of the fits.
    models
        The models by name, see `CANDIDATES`.
    contained
        Of each, those of the others that it contains: fits of it begin at theirs, too.
    """

    study_seed: int
    case: str
    problem: CaseProblem
    least_squares: LeastSquaresSettings
    models: Mapping[str, Sample]
    contained: Mapping[str, Mapping[str, Way]]


def settings(study: Study, job: Wildcards) -> Settings:
    """Return the settings that the fits of a case depend on."""
    case = study.case(job["case"])
    fits, models = case.method("least_squares"), study.models_of(case)
    assert isinstance(fits, LeastSquaresSettings)
    problem = case.problem.to_identify(*(CANDIDATES[name].model for name in models))
    inner = {
        name: {other: way for other, way in contained(name).items() if other in models}
        for name in models
    }
    samples = {name: CANDIDATES[name] for name in models}
    return Settings(study.study_seed, case.name, problem, fits, samples, inner)


def fit(
    settings: Settings,
    seeds: Sequence[int],
    measurements: Path,
    calibrated: list[Path],
    fits: Path,
) -> None:
    """Fit a batch of seeds by least squares with each model.

    Parameters
    ----------
    settings
        Settings of the job.
    seeds
        Seeds of the batch.
    measurements
        Noisy traces, Parquet.
    calibrated
        A calibration, YAML, whose arms replace the gripper's, if there is one.
    fits
        One row per model and seed, CSV.
    """
    case_problem = settings.problem.calibrated(calibrated)
    recorded = read_measurements(measurements, list(seeds))
    MODEL_FITS.write(fits, _rows(settings, case_problem, seeds, recorded))


def _rows(
    settings: Settings, case_problem: CaseProblem, seeds: Sequence[int], recorded: Measurements
) -> Iterator[tuple[str | int, ...]]:
    case, samples = settings.case, len(recorded.time_s)
    progress = Progress(f"{case}, models", len(settings.models) * len(seeds))
    rows: dict[str, list[tuple[str | int, ...]]] = {name: [] for name in settings.models}
    for group in groups(seeds):
        traces = [case_problem.of(recorded.time_s, recorded.rotation_rad[seed]) for seed in group]
        models = {name: sample.model for name, sample in settings.models.items()}
        found = fit_models(
            {
                name: [case_problem.for_model(trace, model) for trace in traces]
                for name, model in models.items()
            },
            settings.least_squares,
            {
                name: [stream(settings.study_seed, case, seed, f"model {name}") for seed in group]
                for name in models
            },
            partial(progress.done, len(group)),
        )
        for name, answers in found.items():
            rows[name] += [
                (case, name, seed, len(models[name].names), samples, f"{answer.misfit_rad:.8e}")
                for seed, answer in zip(group, answers, strict=True)
            ]
    for of_model in rows.values():
        yield from of_model


def _jobs(plan: Plan) -> list[Wildcards]:
    return plan.batch_jobs("selection", plan.study.cases) if plan.study.selects_models else []


MODEL_FIT = Product(
    "model_fits",
    {"fits": MODEL_FITS.batch_path},
    fit,
    settings,
    _jobs,
    message="Fitting every sample model to {case}, {batch}",
    reads={"measurements": the(MEASUREMENTS), "calibrated": calibration_of()},
    weight=Weight(240, 1000, group="batch"),
    modules=lambda _: (METHODS["least_squares"].module,),
)
