"""Tables: the study's inputs, its errors, and the paper held against itself."""

INPUT_TABLES = {
    "gripper": ("gripper", "reconstructed"),
    "actuator": ("actuator", "reconstructed"),
    "gene_ranges": ("search_range", "reconstructed"),
    "parameter_ranges": ("search_range",),
    "contact": ("gripper", "actuator"),
}
TABLE_KINDS = ["csv", "md", "tex", "html"]
TABLES = [
    *INPUT_TABLES,
    *(f"errors_{case}" for case in CASES),
    "errors",
    *(f"verdicts_{case}" for case in CASES),
    *(["models"] if COMPARES_MODELS else []),
    *(["methods", "linearisation"] if PLAN.simulated else []),
    *(["coverage"] if PLAN.covered else []),
    *(["evidence", "printed_values"] if PUBLISHED_CASES else []),
]


rule input_table:
    input:
        code=lambda wildcards: source_files(
            "biogrip.tables.contact"
            if wildcards.table == "contact"
            else "biogrip.tables.inputs"
        ),
    output:
        csv="results/tables/{table}.csv",
        text=multiext("results/tables/{table}", ".md", ".tex"),
        html=report(
            "results/tables/{table}.html",
            caption="../report/input_table.rst",
            category="Tables",
            labels={"case": "all", "item": "input: {table}", "format": "table"},
        ),
    log:
        "results/logs/tables/{table}.log",
    wildcard_constraints:
        table="|".join(INPUT_TABLES),
    conda:
        "../envs/biogrip.yaml"
    params:
        settings=lambda wildcards: PLAN.blocks(*INPUT_TABLES[wildcards.table]),
    message:
        "Writing the table {wildcards.table}"
    shell:
        "biogrip table {wildcards.table} --settings {params.settings:q} "
        "--output {output.csv:q} 2> {log:q}"


rule error_table:
    input:
        identifications="results/identifications/{case}.csv",
        code=source_files("biogrip.tables.errors"),
    output:
        csv="results/tables/errors_{case}.csv",
        text=multiext("results/tables/errors_{case}", ".md", ".tex"),
        html=report(
            "results/tables/errors_{case}.html",
            caption="../report/errors.rst",
            category="Tables",
            labels={"case": "{case}", "item": "errors", "format": "table"},
        ),
    log:
        "results/logs/tables/errors_{case}.log",
    conda:
        "../envs/biogrip.yaml"
    params:
        settings=lambda wildcards: PLAN.errors(wildcards.case),
    message:
        "Writing the error table of {wildcards.case}"
    shell:
        "biogrip table errors --settings {params.settings:q} "
        "--inputs {input.identifications:q} --output {output.csv:q} 2> {log:q}"


rule all_errors_table:
    input:
        tables=collect("results/tables/errors_{case}.csv", case=CASES),
        code=source_files("biogrip.tables.all_errors"),
    output:
        csv="results/tables/errors.csv",
        text=multiext("results/tables/errors", ".md", ".tex"),
        html=report(
            "results/tables/errors.html",
            caption="../report/errors.rst",
            category="Tables",
            labels={"case": "all", "item": "errors", "format": "table"},
        ),
    log:
        "results/logs/tables/errors.log",
    conda:
        "../envs/biogrip.yaml"
    message:
        "Writing the error table of all cases"
    shell:
        "biogrip table all_errors --settings '{{}}' "
        "--inputs {input.tables:q} --output {output.csv:q} 2> {log:q}"


rule verdicts_table:
    input:
        measured="results/identifiability/{case}.json",
        expected=lambda wildcards: expectation_of(wildcards.case),
        code=source_files("biogrip.tables.verdicts"),
    output:
        csv="results/tables/verdicts_{case}.csv",
        text=multiext("results/tables/verdicts_{case}", ".md", ".tex"),
        html=report(
            "results/tables/verdicts_{case}.html",
            caption="../report/verdicts.rst",
            category="Tables",
            labels={"case": "{case}", "item": "verdicts", "format": "table"},
        ),
    log:
        "results/logs/tables/verdicts_{case}.log",
    conda:
        "../envs/biogrip.yaml"
    params:
        settings=lambda wildcards: PLAN.verdicts(wildcards.case),
    message:
        "Writing the verdicts on {wildcards.case}"
    shell:
        "biogrip table verdicts --settings {params.settings:q} "
        "--inputs {input.measured:q} {input.expected:q} --output {output.csv:q} 2> {log:q}"


rule models_table:
    input:
        fits=collect("results/selection/{case}.csv", case=CASES),
        code=source_files("biogrip.tables.models"),
    output:
        csv="results/tables/models.csv",
        text=multiext("results/tables/models", ".md", ".tex"),
        html=report(
            "results/tables/models.html",
            caption="../report/models.rst",
            category="Tables",
            labels={"case": "all", "item": "sample models", "format": "table"},
        ),
    log:
        "results/logs/tables/models.log",
    conda:
        "../envs/biogrip.yaml"
    params:
        settings=PLAN.models_table(),
    message:
        "Counting which sample model is the simplest adequate one"
    shell:
        "biogrip table models --settings {params.settings:q} "
        "--inputs {input.fits:q} --output {output.csv:q} 2> {log:q}"


rule methods_table:
    input:
        identifications=collect(
            "results/identifications/{case}.csv", case=PLAN.simulated
        ),
        code=source_files("biogrip.tables.methods"),
    output:
        csv="results/tables/methods.csv",
        text=multiext("results/tables/methods", ".md", ".tex"),
        html=report(
            "results/tables/methods.html",
            caption="../report/methods.rst",
            category="Tables",
            labels={"case": "all", "item": "methods", "format": "table"},
        ),
    log:
        "results/logs/tables/methods.log",
    conda:
        "../envs/biogrip.yaml"
    params:
        settings=PLAN.methods(),
    message:
        "Comparing the methods"
    shell:
        "biogrip table methods --settings {params.settings:q} "
        "--inputs {input.identifications:q} --output {output.csv:q} 2> {log:q}"


rule coverage_table:
    input:
        targets=collect("results/targets/{case}.csv", case=PLAN.covered),
        intervals=collect("results/coverage/{case}.csv", case=PLAN.covered),
        code=source_files("biogrip.tables.coverage"),
    output:
        csv="results/tables/coverage.csv",
        text=multiext("results/tables/coverage", ".md", ".tex"),
        html=report(
            "results/tables/coverage.html",
            caption="../report/coverage.rst",
            category="Tables",
            labels={"case": "all", "item": "coverage", "format": "table"},
        ),
    log:
        "results/logs/tables/coverage.log",
    conda:
        "../envs/biogrip.yaml"
    params:
        settings=PLAN.coverage_table(),
    message:
        "Holding estimates and intervals against truth and bound"
    shell:
        "biogrip table coverage --settings {params.settings:q} "
        "--inputs {input.targets:q} {input.intervals:q} --output {output.csv:q} 2> {log:q}"


# Outside tables/, for times are not the same on every machine.
rule timings_table:
    input:
        timings=collect("results/timings/{case}.csv", case=CASES),
        code=source_files("biogrip.tables.timings"),
    output:
        csv="results/timings.csv",
        text=multiext("results/timings", ".md", ".tex"),
        html=report(
            "results/timings.html",
            caption="../report/timings.rst",
            category="Tables",
            labels={"case": "all", "item": "processor times", "format": "table"},
        ),
    log:
        "results/logs/tables/timings.log",
    conda:
        "../envs/biogrip.yaml"
    message:
        "Writing what the methods cost on this machine"
    shell:
        "biogrip table timings --settings '{{}}' "
        "--inputs {input.timings:q} --output {output.csv:q} 2> {log:q}"


rule evidence_table:
    input:
        identifications=collect(
            "results/identifications/{case}.csv", case=PUBLISHED_CASES
        ),
        measurements=[
            file
            for case in PUBLISHED_CASES
            for file in PLAN.batch_files(
                "results/measurements/{case}/{batch}.parquet", case
            )
        ],
        code=source_files("biogrip.tables.evidence"),
    output:
        csv="results/tables/evidence.csv",
        text=multiext("results/tables/evidence", ".md", ".tex"),
        html=report(
            "results/tables/evidence.html",
            caption="../report/evidence.rst",
            category="Tables",
            labels={"case": "all", "item": "evidence", "format": "table"},
        ),
    log:
        "results/logs/tables/evidence.log",
    conda:
        "../envs/biogrip.yaml"
    params:
        settings=PLAN.evidence(),
    message:
        "Holding the paper's statements against the study"
    shell:
        "biogrip table evidence --settings {params.settings:q} "
        "--inputs {input.identifications:q} {input.measurements:q} "
        "--output {output.csv:q} 2> {log:q}"


rule printed_values_table:
    input:
        code=source_files("biogrip.tables.printed_values"),
    output:
        csv="results/tables/printed_values.csv",
        text=multiext("results/tables/printed_values", ".md", ".tex"),
        html=report(
            "results/tables/printed_values.html",
            caption="../report/printed_values.rst",
            category="Tables",
            labels={"case": "all", "item": "printed values", "format": "table"},
        ),
    log:
        "results/logs/tables/printed_values.log",
    conda:
        "../envs/biogrip.yaml"
    params:
        settings=PLAN.evidence(),
    message:
        "Checking the paper's printed values"
    shell:
        "biogrip table printed_values --settings {params.settings:q} "
        "--output {output.csv:q} 2> {log:q}"


rule linearisation:
    input:
        code=source_files("biogrip.stages.linearisation"),
    output:
        "results/linearisation.csv",
    log:
        "results/logs/linearisation.log",
    conda:
        "../envs/biogrip.yaml"
    params:
        settings=PLAN.linearisation(),
    message:
        "Comparing the linear and the nonlinear model"
    shell:
        "biogrip linearisation --settings {params.settings:q} --output {output:q} 2> {log:q}"


rule linearisation_table:
    input:
        comparison="results/linearisation.csv",
        code=source_files("biogrip.tables.linearisation"),
    output:
        csv="results/tables/linearisation.csv",
        text=multiext("results/tables/linearisation", ".md", ".tex"),
        html=report(
            "results/tables/linearisation.html",
            caption="../report/linearisation.rst",
            category="Tables",
            labels={"case": "all", "item": "linearisation", "format": "table"},
        ),
    log:
        "results/logs/tables/linearisation.log",
    conda:
        "../envs/biogrip.yaml"
    message:
        "Writing where the linearisation is good to 1 %"
    shell:
        "biogrip table linearisation --settings '{{}}' "
        "--inputs {input.comparison:q} --output {output.csv:q} 2> {log:q}"
