"""Stage 4: fits of every sample model to every trace, for model selection."""

from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

from biogrip.experiment.random_streams import stream
from biogrip.fit.case_problem import CaseProblem
from biogrip.fit.nested_fits import fit_models
from biogrip.progress import Progress
from biogrip.records.model_fits import MODEL_FITS
from biogrip.records.traces import Measurements, read_measurements
from biogrip.stages.groups import groups
from biogrip.study.study import Case


def _problem(case: Case) -> CaseProblem:
    return case.problem.to_identify(*(sample.model for sample in case.models.values()))


def fit(
    case: Case,
    seeds: Sequence[int],
    measurements: Path,
    calibrated: list[Path],
    fits: Path,
) -> None:
    """Fit a batch of seeds by least squares with each model."""
    case_problem = _problem(case).calibrated(calibrated)
    recorded = read_measurements(measurements, list(seeds))
    weighted = case_problem.weighted(recorded.sd_rad)
    MODEL_FITS.write(fits, _rows(case, weighted, seeds, recorded))


def _rows(
    case: Case, case_problem: CaseProblem, seeds: Sequence[int], recorded: Measurements
) -> Iterator[tuple[str | int, ...]]:
    samples, study_seed = len(recorded.time_s), case.study.study_seed
    progress = Progress(f"{case.name}, models", len(case.models) * len(seeds))
    rows: dict[str, list[tuple[str | int, ...]]] = {name: [] for name in case.models}
    for group in groups(seeds):
        traces = [case_problem.of(recorded.time_s, recorded.rotation_rad[seed]) for seed in group]
        models = {name: sample.model for name, sample in case.models.items()}
        found = fit_models(
            {
                name: [case_problem.for_model(trace, model) for trace in traces]
                for name, model in models.items()
            },
            case.least_squares,
            {
                name: [stream(study_seed, case.name, seed, f"model {name}") for seed in group]
                for name in models
            },
            partial(progress.done, len(group)),
        )
        for name, answers in found.items():
            rows[name] += [
                (
                    case.name,
                    name,
                    seed,
                    len(models[name].names),
                    samples,
                    f"{answer.misfit_rad:.8e}",
                )
                for seed, answer in zip(group, answers, strict=True)
            ]
    for of_model in rows.values():
        yield from of_model
