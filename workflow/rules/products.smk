"""A rule for each thing that the study makes besides its stages, as they declare themselves."""


def reported(rule):
    """The files of a rule; the pages among them are shown in Snakemake's report."""
    found = rule.outputs
    for product in rule.products:
        if product.category:
            kind = next(
                kind for kind in ("png", "html", "page") if kind in product.writes
            )
            labels = {
                "case": "{case}" if "case" in rule.wildcards else "all",
                "item": product.item,
                "format": {"png": "figure", "html": "table", "page": "page"}[kind],
            }
            found[f"{product.name}_{kind}"] = report(
                product.writes[kind],
                caption="../report/product.rst",
                category=product.category,
                labels=labels,
            )
    return found


for rule in (rule for rule in SHEETS if rule.name not in STAGES):

    rule:
        name:
            rule.name
        input:
            unpack(rule.inputs),
        output:
            **reported(rule),
        log:
            rule.log,
        wildcard_constraints:
            **rule.constraints,
        group:
            rule.weight.group
        localrule: rule.weight.local
        resources:
            runtime=rule.runtime,
            mem_mb=rule.megabytes,
        params:
            job=rule.command,
            made_for=rule.digest,
        message:
            rule.message
        shell:
            "biogrip make {params.job} --made-for {params.made_for} 2> {log:q}"
