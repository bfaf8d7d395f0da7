"""Figures and tables that the page shows, with the rules that make them."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from biogrip.products.catalogue import products
from biogrip.products.plan import Plan, Wildcards
from biogrip.products.product import Product, Reads
from biogrip.products.rule_products import group_by_rule

_FOLDERS = ("results/figures/", "results/tables/")


@dataclass(frozen=True)
class Entry:
    """A figure or table in the report."""

    name: str
    """Name of the product."""
    whose: str
    """Name of its case or sweep, if any."""
    caption: str
    file: str
    """Path among the results."""
    rule: str
    """Snakemake rule that makes it."""
    command: str
    """Command that makes it again."""


def files_of(plan: Plan, kinds: tuple[str, str]) -> Iterable[tuple[Product, Wildcards, str]]:
    """Yield products of a category with their jobs and the shown file of each."""
    category, kind = kinds
    for product in products().values():
        for job in product.jobs(plan) if product.category == category else []:
            file = product.outputs(job)[kind]
            # Skip processor times, since the report must be reproducible.
            if file.startswith(_FOLDERS):
                yield product, job, file


def rules_of(plan: Plan) -> dict[tuple[Any, ...], str]:
    """Return the rule of every job of every product."""
    return {
        (product.name, *job.items()): each.rule
        for each in group_by_rule(products().values(), plan)
        for product in each.products
        for job in each.jobs
    }


def entries(
    plan: Plan, kinds: tuple[str, str], rules: Mapping[tuple[Any, ...], str]
) -> Iterable[Entry]:
    """Yield the entries of a category, given the rules of all jobs."""
    for product, job, file in files_of(plan, kinds):
        options = "".join(f" --{name} {value}" for name, value in job.items())
        yield Entry(
            product.name,
            job.get("case") or job.get("sweep") or "",
            product.caption,
            file,
            rules[product.name, *job.items()],
            f"biogrip make {product.name}{options}",
        )


def files_shown(kinds: tuple[str, str]) -> Reads:
    """Return the input with the files of a category, in the order of their entries."""
    return Reads(lambda plan, _: [file for _, _, file in files_of(plan, kinds)])
