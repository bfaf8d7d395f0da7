"""Grouping of products into jobs, and names of the resulting Snakemake rules."""

from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass

from biogrip.products.plan import Plan, Wildcards
from biogrip.products.product import Product


@dataclass(frozen=True)
class RuleProducts:
    """Products that one rule makes, with its jobs."""

    rule: str
    """Name of the Snakemake rule."""
    products: tuple[Product, ...]
    """Products of each job."""
    jobs: tuple[Wildcards, ...]
    """Wildcards of each job."""


def group_by_rule(products: Iterable[Product], plan: Plan) -> list[RuleProducts]:
    """Group products by rule.

    A rule always makes all its outputs, but not every case has every figure. So there
    is one rule for each set of products that cases have in common.
    """
    rules: dict[str, list[Product]] = defaultdict(list)
    for product in products:
        rules[product.rule or product.name].append(product)
    found = []
    for name, members in rules.items():
        if not members[0].by_default:
            found.append(RuleProducts(name, tuple(members), ()))
        for number, (makes, jobs) in enumerate(_in_common(members, plan).items(), 1):
            rule = name if number == 1 else f"{name}_{number}"
            found.append(RuleProducts(rule, tuple(members[i] for i in makes), tuple(jobs)))
    return found


def _in_common(members: list[Product], plan: Plan) -> dict[tuple[int, ...], list[Wildcards]]:
    """Return the wildcards of jobs by indices of the products they make."""
    makes: dict[tuple[tuple[str, str], ...], list[int]] = defaultdict(list)
    for index, product in enumerate(members):
        for job in product.jobs(plan):
            makes[tuple(job.items())].append(index)
    found: dict[tuple[int, ...], list[Wildcards]] = defaultdict(list)
    for items, indices in makes.items():
        found[tuple(indices)].append(dict(items))
    return found
