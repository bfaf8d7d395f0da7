"""One job of the study that was last run here."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from biogrip.errors import BiogripError, nearest
from biogrip.products.catalogue import chosen
from biogrip.products.plan import Plan
from biogrip.running.resolved import read_study
from biogrip.running.sheet import Sheet


def make(names: Sequence[str], job: Mapping[str, str], results: Path) -> None:
    """Make some products.

    Parameters
    ----------
    names
        Which.
    job
        Of which case, method, batch, sweep, seed.
    results
        Where the study stands that was last run.

    Raises
    ------
    BiogripError
        If there is no such product or job, or it cannot be made.
    """
    plan = Plan(read_study(results), results)
    for product in chosen(names):
        _check(Sheet(product.name, (product,), plan), job)
        product.run(plan, job)


def _check(sheet: Sheet, job: Mapping[str, str]) -> None:
    """See that a job is named in full, and is of this study."""
    for name in sheet.wildcards:
        if name not in job:
            raise BiogripError(f"{sheet.name}: is made with --{name}, which is missing.")
    for name in job:
        if name not in sheet.wildcards:
            raise BiogripError(f"--{name}: does not go with {sheet.name}.")
    study = sheet.plan.study
    for name, allowed in (
        ("case", [*study.cases, *study.points]),
        ("method", study.methods),
        ("sweep", list(study.sweeps)),
    ):
        if name in job and job[name] not in allowed:
            hint = nearest(job[name], allowed)
            raise BiogripError(
                f"--{name}: found '{job[name]}'.{hint} Allowed: {', '.join(allowed[:20])}."
            )
    if "seed" in job and not job["seed"].isdigit():
        raise BiogripError(f"--seed: found '{job['seed']}', allowed is a number.")
    if "batch" in job:
        _check_batch(sheet, job)


def _check_batch(sheet: Sheet, job: Mapping[str, str]) -> None:
    """See that a batch has what it is made of, planned or not: it may be of another plan."""
    for file in (Path(file) for files in sheet.inputs(dict(job)).values() for file in files):
        if file.stem == job["batch"] and not file.exists():
            there = sorted(path.stem for path in file.parent.glob(f"*{file.suffix}"))
            hint, some = nearest(file.stem, there), ", ".join(there[:20])
            raise BiogripError(f"--batch: found '{file.stem}'.{hint} Allowed: {some}.")
