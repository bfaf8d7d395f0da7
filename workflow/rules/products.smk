"""A rule for each thing that the study makes, or each sheet of them, as they declare themselves."""


def reported(sheet):
    """The files of a sheet; the pages among them are shown in Snakemake's report."""
    found = sheet.outputs
    for product in sheet.products:
        if product.category:
            kind = next(
                kind for kind in ("png", "html", "page") if kind in product.writes
            )
            labels = {
                "case": "{case}" if "case" in sheet.wildcards else "all",
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


for sheet in SHEETS:

    rule:
        name:
            sheet.name
        input:
            unpack(sheet.inputs),
        output:
            **reported(sheet),
        log:
            sheet.log,
        wildcard_constraints:
            **sheet.constraints,
        group:
            sheet.weight.group
        localrule: sheet.weight.local
        resources:
            runtime=sheet.runtime,
            mem_mb=sheet.megabytes,
        params:
            job=sheet.command,
            made_for=sheet.digest,
        message:
            sheet.message
        shell:
            "biogrip make {params.job} --made-for {params.made_for} 2> {log:q}"
