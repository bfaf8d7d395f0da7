"""The command ``biogrip make``: one job of the study whose results are in this folder."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from biogrip.errors import BiogripError, nearest
from biogrip.products.catalogue import chosen, products
from biogrip.products.plan import Plan
from biogrip.products.product import Product
from biogrip.running.journal import JOURNALS, digest_of_files, hash_file, recorded_in
from biogrip.running.manifest import STUDY
from biogrip.running.places import refuse_files_as_folders, refuse_links
from biogrip.running.resolved import read_study
from biogrip.running.rules import ProductRule, inputs_of, make_rules


def make(
    names: Sequence[str], job: Mapping[str, str], results: Path, made_for: str | None = None
) -> None:
    """Make products of one job, and record their files.

    Parameters
    ----------
    names
        Names of the products.
    job
        Wildcards of the job: case, method, batch, sweep, seed, as far as needed.
    results
        Results folder of the study.
    made_for
        Digest of settings and code, as Snakemake passes it to the job.

    Raises
    ------
    BiogripError
        If there is no such product or job, or it cannot be made.
    """
    plan = Plan(read_study(results), results)
    requested = chosen(names)
    for product in requested:
        _check(ProductRule(product.name, (product,), plan), job)
    if made_for is not None:
        rule = ProductRule("", tuple(requested), plan)
        if rule.digest_of_settings(job) != made_for.split("-")[0]:
            raise BiogripError(
                f"{results / STUDY}: has changed since this run was planned: another run was begun "
                "beside it. Run again."
            )
        _make(rule, requested, job, made_for)
        return
    rules = make_rules(products().values(), plan)
    for product in requested:
        rule = _planned(rules, product, job)
        _make(rule, [product], job, rule.digest(job))


def _make(
    rule: ProductRule, requested: Iterable[Product], job: Mapping[str, str], made_for: str
) -> None:
    results = rule.plan.results
    outputs = [Path(file) for product in requested for file in product.outputs(job).values()]
    refuse_links(results, [*outputs, results / JOURNALS])
    refuse_files_as_folders(results, [*outputs, results / JOURNALS / "a journal"])
    files = [Path(file) for file in inputs_of(rule, job)]
    # If an input is missing, the product that reads it reports that.
    there = all(file.is_file() for file in files)
    inputs = digest_of_files(map(hash_file, files)) if there else ""
    with recorded_in(results, made_for, inputs):
        for product in requested:
            product.run(rule.plan, job)


def _planned(rules: Iterable[ProductRule], product: Product, job: Mapping[str, str]) -> ProductRule:
    """Return the rule that makes a product, or one of its own if none is planned."""
    found = [rule for rule in rules if product.name in {p.name for p in rule.products}]
    with_job = [rule for rule in found if job in rule.jobs or not rule.jobs]
    return (with_job or [ProductRule(product.name, (product,), found[0].plan)])[0]


def _check(rule: ProductRule, job: Mapping[str, str]) -> None:
    """Refuse a job whose wildcards are incomplete, superfluous or not of this study."""
    for name in rule.wildcards:
        if name not in job:
            raise BiogripError(f"{rule.name}: is made with --{name}, which is missing.")
    for name in job:
        if name not in rule.wildcards:
            raise BiogripError(f"--{name}: does not go with {rule.name}.")
    study = rule.plan.study
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
        _check_batch(rule, job)


def _check_batch(rule: ProductRule, job: Mapping[str, str]) -> None:
    """Refuse a batch whose inputs do not exist; it need not be a batch of the present plan."""
    for file in (Path(file) for files in rule.inputs(dict(job)).values() for file in files):
        if file.stem == job["batch"] and not file.exists():
            there = sorted(path.stem for path in file.parent.glob(f"*{file.suffix}"))
            hint, some = nearest(file.stem, there), ", ".join(there[:20])
            raise BiogripError(f"--batch: found '{file.stem}'.{hint} Allowed: {some}.")
