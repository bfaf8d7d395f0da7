"""Snakemake rules: products that one job makes, with wildcards, inputs, outputs and resources."""

import re
import shlex
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import PurePath

from biogrip.products.digest import digest
from biogrip.products.plan import Plan, Wildcards
from biogrip.products.product import Product, Weight
from biogrip.products.rule_products import group_by_rule
from biogrip.products.source_files import fingerprint

_CONSTRAINTS = {
    "case": "[A-Za-z][A-Za-z0-9_-]*",
    "batch": r"seeds_\d+-\d+",
    "method": "[a-z_]+",
    "sweep": "[A-Za-z][A-Za-z0-9_]*",
    "seed": r"\d+",
}

GROUPS = {
    "tables": "results/tables/*",
    "maps": "robustness_*",
}
"""Patterns of results that a rule asks for together, see `pathlib.PurePath.match`."""


@dataclass(frozen=True)
class ProductRule:
    """A Snakemake rule: products that one job makes."""

    name: str
    """Name of the rule."""
    products: tuple[Product, ...]
    """Products of each job."""
    plan: Plan
    """Plan of the study's jobs."""
    jobs: tuple[Wildcards, ...] = ()
    """Wildcards of all its jobs."""

    @property
    def wildcards(self) -> list[str]:
        """Names of the wildcards of the rule."""
        patterns = "".join(self.products[0].writes.values())
        return sorted(set(re.findall(r"{(\w+)}", patterns)))

    @property
    def constraints(self) -> dict[str, str]:
        """Wildcard constraints as regular expressions: values in the study's jobs, if any."""
        found = {}
        for name in self.wildcards:
            values = {job[name] for job in self.jobs} if name in ("case", "sweep") else set()
            found[name] = "|".join(map(re.escape, sorted(values))) or _CONSTRAINTS[name]
        return found

    @property
    def outputs(self) -> dict[str, str]:
        """Patterns of output files, by product and kind."""
        return {
            f"{product.name}_{kind}": pattern
            for product in self.products
            for kind, pattern in product.writes.items()
        }

    def makes(self, file: str) -> bool:
        """Return True if a job of the rule could write a file, planned or not."""
        values = {name: f"(?:{value})" for name, value in self.constraints.items()}
        patterns = (pattern.replace(".", r"\.") for pattern in self.outputs.values())
        return any(re.fullmatch(pattern.format(**values), file) for pattern in patterns)

    def files(self, job: Wildcards) -> list[str]:
        """Return the output files of a job."""
        return [pattern.format(**job) for pattern in self.outputs.values()]

    def inputs(self, job: Wildcards) -> dict[str, list[str]]:
        """Return the input files of a job that are not made by the rule itself."""
        made = set(self.files(job))
        needed: dict[str, list[str]] = {}
        for product in self.products:
            for name, files in product.inputs(self.plan, job).items():
                others = [file for file in files if file not in made]
                needed[name] = list(dict.fromkeys([*needed.get(name, []), *others]))
        return needed

    def digest(self, job: Wildcards) -> str:
        """Return a digest of the settings and the code that a job uses."""
        modules = {
            module
            for product in self.products
            for module in (product.module, *product.modules(job))
        }
        return f"{self.digest_of_settings(job)}-{fingerprint(*sorted(modules))}"

    def digest_of_settings(self, job: Wildcards) -> str:
        """Return a digest of the settings alone."""
        return digest([product.settings(self.plan.study, job) for product in self.products])

    def command(self, job: Wildcards) -> str:
        """Return the arguments of `biogrip make` for a job."""
        names = [product.name for product in self.products]
        options = [f"--{name} {shlex.quote(str(job[name]))}" for name in self.wildcards]
        return " ".join([*names, *options])

    @property
    def log(self) -> str:
        """Pattern of the log file."""
        inner = "".join(f"/{{{name}}}" for name in self.wildcards)
        return f"results/logs/{self.name}{inner}.log"

    @property
    def message(self) -> str:
        """Message of the rule, with Snakemake's wildcards."""
        if len(self.products) == 1:
            return re.sub(r"{(\w+)}", r"{wildcards.\1}", self.products[0].message)
        whose = "".join(f" of {{wildcards.{name}}}" for name in self.wildcards)
        return f"Making {', '.join(product.name for product in self.products)}{whose}"

    @property
    def weight(self) -> Weight:
        """Resources of a job: the maximum over its products."""
        weights = [product.weight for product in self.products]
        return Weight(
            max(weight.minutes for weight in weights),
            max(weight.megabytes for weight in weights),
            next((weight.group for weight in weights if weight.group), None),
            all(weight.local for weight in weights),
        )

    def runtime(self, job: Wildcards, attempt: int) -> int:
        """Return the upper limit of a job's minutes, which increases at every retry."""
        return self.weight.minutes * attempt

    def megabytes(self, job: Wildcards, attempt: int) -> int:
        """Return the upper limit of a job's megabytes, which increases at every retry."""
        return self.weight.megabytes * attempt

    @property
    def caption(self) -> str:
        """Caption in the report."""
        if len(self.products) == 1:
            return self.products[0].caption
        return "\n\n".join(f"{p.item}: {p.caption}" for p in self.products if p.caption)


def inputs_of(rule: ProductRule, job: Wildcards) -> list[str]:
    """Return all input files of a job, sorted."""
    return sorted({file for files in rule.inputs(job).values() for file in files})


def make_rules(products: Iterable[Product], plan: Plan) -> list[ProductRule]:
    """Return the rules of a plan, grouping products that one job makes."""
    return [
        ProductRule(each.rule, each.products, plan, each.jobs)
        for each in group_by_rule(products, plan)
    ]


def files_of(rules: Iterable[ProductRule]) -> list[str]:
    """Return every output file of a study; all are targets, so that lost ones are made again."""
    return [
        file
        for rule in rules
        for product in rule.products
        for job in rule.jobs
        for file in product.outputs(job).values()
    ]


def needed_for(targets: Iterable[str], rules: Iterable[ProductRule]) -> set[str]:
    """Return the planned files that a run for some targets needs, and all that these are made of.

    Parameters
    ----------
    targets
        Files and names of rules; for none or ``all`` a run needs all files.
    rules
        All rules that make files.
    """
    makers = {file: (rule, job) for rule in rules for job in rule.jobs for file in rule.files(job)}
    requested = set(targets) or {"all"}
    patterns = [pattern for name, pattern in GROUPS.items() if f"all_{name}" in requested]
    waiting = [
        file
        for file, (rule, _) in makers.items()
        if requested & {"all", file, rule.name} or any(map(PurePath(file).match, patterns))
    ]
    needed: set[str] = set()
    while waiting:
        file = waiting.pop()
        if file not in needed and file in makers:
            needed.add(file)
            waiting += inputs_of(*makers[file])
    return needed
