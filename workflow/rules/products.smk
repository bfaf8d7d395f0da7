"""A rule for each thing that the study makes besides its stages, as they declare themselves."""


def reported(own):
    """The files of a rule; the pages among them are shown in Snakemake's report."""
    found = own.outputs
    for product in own.products:
        if product.category:
            kind = next(
                kind for kind in ("png", "html", "page") if kind in product.writes
            )
            labels = {
                "case": "{case}" if "case" in own.wildcards else "all",
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


for own in (own for own in RULES if own.name not in STAGES):

    rule:
        name:
            own.name
        input:
            unpack(own.inputs),
        output:
            **reported(own),
        log:
            own.log,
        wildcard_constraints:
            **own.constraints,
        group:
            own.weight.group
        localrule: own.weight.local
        resources:
            runtime=own.runtime,
            mem_mb=own.megabytes,
        params:
            job=own.command,
            made_for=own.digest,
        message:
            own.message
        shell:
            "biogrip make {params.job} --made-for {params.made_for} 2> {log:q}"
