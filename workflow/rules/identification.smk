"""The sample's parameters from each noisy trace."""


rule identification:
    input:
        measurements="results/measurements/{case}/{batch}.parquet",
        calibrated=lambda wildcards: calibrations_of(wildcards.case),
    output:
        parameters="results/identifications/{case}/{method}/{batch}.csv",
        history="results/histories/{case}/{method}/{batch}.parquet",
        timing="results/timings/{case}/{method}/{batch}.csv",
    log:
        "results/logs/identification/{case}/{method}/{batch}.log",
    conda:
        "../envs/biogrip.yaml"
    params:
        settings=lambda wildcards: PLAN.identification(wildcards.case, wildcards.method),
        code=lambda wildcards: fingerprint(
            "biogrip.stages.identification", METHODS[wildcards.method].module
        ),
    message:
        "Identifying {wildcards.case} by {wildcards.method}, {wildcards.batch}"
    shell:
        "biogrip identification --settings {params.settings:q} --seeds {wildcards.batch} "
        "--measurements {input.measurements:q} --calibrated {input.calibrated:q} "
        "--output {output.parameters:q} --history {output.history:q} --timing {output.timing:q} 2> {log:q}"


# What every seed adds a row to, so that no table has thousands of inputs.
rule joined:
    input:
        batches=lambda wildcards: PLAN.stage_files(wildcards.stage, wildcards.case),
        code=source_files("biogrip.stages.joined"),
    output:
        "results/{stage}/{case}.csv",
    log:
        "results/logs/joined/{stage}_{case}.log",
    wildcard_constraints:
        stage="timings|coverage|selection",
        case="|".join(map(re.escape, CASES)),
    conda:
        "../envs/biogrip.yaml"
    params:
        settings=lambda wildcards: PLAN.joined(wildcards.stage, wildcards.case),
    message:
        "Putting together the {wildcards.stage} of {wildcards.case}"
    shell:
        "biogrip joined --settings {params.settings:q} --batches {input.batches:q} "
        "--output {output:q} 2> {log:q}"


rule collection:
    input:
        batches=lambda wildcards: PLAN.batch_files(
            "results/identifications/{case}/{method}/{batch}.csv", wildcards.case
        ),
        histories=lambda wildcards: PLAN.batch_files(
            "results/histories/{case}/{method}/{batch}.parquet", wildcards.case
        ),
        code=source_files("biogrip.stages.collection"),
    output:
        parameters="results/identifications/{case}.csv",
        history="results/histories/{case}.parquet",
    log:
        "results/logs/collection/{case}.log",
    conda:
        "../envs/biogrip.yaml"
    params:
        settings=lambda wildcards: PLAN.collection(wildcards.case),
    message:
        "Putting together the identifications of {wildcards.case}"
    shell:
        "biogrip collection --settings {params.settings:q} "
        "--batches {input.batches:q} --histories {input.histories:q} "
        "--output {output.parameters:q} --history {output.history:q} 2> {log:q}"
