"""The five stages: target, measurement, identification, judgement and tables of errors.

A test holds these rules against what the products declare (`tests/workflow/test_rules.py`).
"""


rule target:
    output:
        "results/targets/{case}.csv",
    log:
        "results/logs/target/{case}.log",
    wildcard_constraints:
        case=cases_of("target"),
    localrule: True
    resources:
        runtime=lambda _, attempt: 5 * attempt,
        mem_mb=lambda _, attempt: 1000 * attempt,
    params:
        made_for=made_for("target"),
    message:
        "Simulating the response of {wildcards.case}"
    shell:
        "biogrip make target --case {wildcards.case} --made-for {params.made_for} 2> {log:q}"


# A recorded trace takes the place of target and measurement (rule `recording`).
rule measurement:
    input:
        target="results/targets/{case}.csv",
    output:
        "results/measurements/{case}/{batch}.parquet",
    log:
        "results/logs/measurement/{batch}/{case}.log",
    wildcard_constraints:
        case=cases_of("measurement"),
        batch=r"seeds_\d+-\d+",
    group:
        "batch"
    resources:
        runtime=lambda _, attempt: 10 * attempt,
        mem_mb=lambda _, attempt: 1000 * attempt,
    params:
        made_for=made_for("measurement"),
    message:
        "Adding noise to {wildcards.case}, {wildcards.batch}"
    shell:
        "biogrip make measurement --case {wildcards.case} --batch {wildcards.batch} "
        "--made-for {params.made_for} 2> {log:q}"


rule identification:
    input:
        calibration_of,
        measurements="results/measurements/{case}/{batch}.parquet",
    output:
        parameters="results/identifications/{case}/{method}/{batch}.csv",
        history="results/histories/{case}/{method}/{batch}.parquet",
        timing="results/timings/{case}/{method}/{batch}.csv",
    log:
        "results/logs/identification/{batch}/{case}/{method}.log",
    wildcard_constraints:
        case=cases_of("identification"),
        method="[a-z_]+",
        batch=r"seeds_\d+-\d+",
    group:
        "batch"
    resources:
        runtime=lambda _, attempt: 120 * attempt,
        mem_mb=lambda _, attempt: 1000 * attempt,
    params:
        made_for=made_for("identification"),
    message:
        "Identifying {wildcards.case} by {wildcards.method}, {wildcards.batch}"
    shell:
        "biogrip make identification --batch {wildcards.batch} --case {wildcards.case} "
        "--method {wildcards.method} --made-for {params.made_for} 2> {log:q}"


rule identifications:
    input:
        batches=batches_of("results/identifications/{case}/{method}/{batch}.csv"),
        histories=batches_of("results/histories/{case}/{method}/{batch}.parquet"),
    output:
        parameters="results/identifications/{case}.csv",
        history="results/histories/{case}.parquet",
    log:
        "results/logs/identifications/{case}.log",
    wildcard_constraints:
        case=cases_of("identifications"),
    group:
        "case"
    resources:
        runtime=lambda _, attempt: 10 * attempt,
        mem_mb=lambda _, attempt: 2000 * attempt,
    params:
        made_for=made_for("identifications"),
    message:
        "Putting together the identifications of {wildcards.case}"
    shell:
        "biogrip make identifications --case {wildcards.case} "
        "--made-for {params.made_for} 2> {log:q}"


rule judgement:
    input:
        calibration_of,
        first_trace=lambda wildcards: PLAN.batch_of_seed(
            "results/measurements/{case}/{batch}.parquet", wildcards.case, seed=0
        ),
    output:
        "results/identifiability/{case}.json",
    log:
        "results/logs/judgement/{case}.log",
    wildcard_constraints:
        case=cases_of("judgement"),
    group:
        "verdicts"
    resources:
        runtime=lambda _, attempt: 60 * attempt,
        mem_mb=lambda _, attempt: 1000 * attempt,
    params:
        made_for=made_for("judgement"),
    message:
        "Computing confidence limits for the first trace of {wildcards.case}"
    shell:
        "biogrip make judgement --case {wildcards.case} --made-for {params.made_for} 2> {log:q}"


rule errors_of_case:
    input:
        "results/identifications/{case}.csv",
    output:
        multiext("results/tables/errors_{case}", ".csv", ".md", ".tex"),
        report(
            "results/tables/errors_{case}.html",
            caption="../report/product.rst",
            category="Tables",
            labels={"case": "{case}", "item": "errors", "format": "table"},
        ),
    log:
        "results/logs/errors_of_case/{case}.log",
    wildcard_constraints:
        case=cases_of("errors_of_case"),
    group:
        "case"
    resources:
        runtime=lambda _, attempt: 10 * attempt,
        mem_mb=lambda _, attempt: 1000 * attempt,
    params:
        made_for=made_for("errors_of_case"),
    message:
        "Writing the table errors of {wildcards.case}"
    shell:
        "biogrip make errors_of_case --case {wildcards.case} --made-for {params.made_for} 2> {log:q}"


rule errors:
    input:
        expand("results/tables/errors_{case}.csv", case=list(STUDY.cases)),
    output:
        multiext("results/tables/errors", ".csv", ".md", ".tex"),
        report(
            "results/tables/errors.html",
            caption="../report/product.rst",
            category="Tables",
            labels={"case": "all", "item": "errors", "format": "table"},
        ),
    log:
        "results/logs/errors.log",
    localrule: True
    resources:
        runtime=lambda _, attempt: 5 * attempt,
        mem_mb=lambda _, attempt: 1000 * attempt,
    params:
        made_for=made_for("errors"),
    message:
        "Writing the table errors"
    shell:
        "biogrip make errors --made-for {params.made_for} 2> {log:q}"
