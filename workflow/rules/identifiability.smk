"""What a trace tells about its sample, and what it does not."""


rule identifiability:
    input:
        measurements=lambda wildcards: PLAN.batch_of_seed(
            "results/measurements/{case}/{batch}.parquet", wildcards.case, 0
        ),
        calibrated=lambda wildcards: calibrations_of(wildcards.case),
        code=source_files(
            "biogrip.stages.identifiability", METHODS["least_squares"].module
        ),
    output:
        "results/identifiability/{case}.json",
    log:
        "results/logs/identifiability/{case}.log",
    conda:
        "../envs/biogrip.yaml"
    params:
        settings=lambda wildcards: PLAN.identifiability(wildcards.case),
    message:
        "Judging what the first trace of {wildcards.case} tells"
    shell:
        "biogrip identifiability --settings {params.settings:q} "
        "--measurements {input.measurements:q} --calibrated {input.calibrated:q} "
        "--output {output:q} 2> {log:q}"


rule expected_identifiability:
    input:
        target="results/targets/{case}.csv",
        calibrated=lambda wildcards: calibrations_of(wildcards.case),
        code=source_files("biogrip.stages.identifiability"),
    output:
        "results/identifiability/expected/{case}.json",
    log:
        "results/logs/identifiability/expected_{case}.log",
    conda:
        "../envs/biogrip.yaml"
    params:
        settings=lambda wildcards: PLAN.expected(wildcards.case),
    message:
        "Judging what traces of {wildcards.case} should tell"
    shell:
        "biogrip expected --settings {params.settings:q} "
        "--target {input.target:q} --calibrated {input.calibrated:q} "
        "--output {output:q} 2> {log:q}"


rule coverage:
    input:
        target="results/targets/{case}.csv",
        expected="results/identifiability/expected/{case}.json",
        calibrated=lambda wildcards: calibrations_of(wildcards.case),
    output:
        "results/coverage/{case}/{batch}.csv",
    log:
        "results/logs/coverage/{case}/{batch}.log",
    conda:
        "../envs/biogrip.yaml"
    params:
        settings=lambda wildcards: PLAN.coverage(wildcards.case),
        code=fingerprint("biogrip.stages.coverage", METHODS["least_squares"].module),
    message:
        "Estimates and intervals of {wildcards.case}, {wildcards.batch}"
    shell:
        "biogrip coverage --settings {params.settings:q} --seeds {wildcards.batch} "
        "--target {input.target:q} --expected {input.expected:q} "
        "--calibrated {input.calibrated:q} --output {output:q} 2> {log:q}"


rule selection:
    input:
        measurements="results/measurements/{case}/{batch}.parquet",
        calibrated=lambda wildcards: calibrations_of(wildcards.case),
    output:
        "results/selection/{case}/{batch}.csv",
    log:
        "results/logs/selection/{case}/{batch}.log",
    conda:
        "../envs/biogrip.yaml"
    params:
        settings=lambda wildcards: PLAN.selection(wildcards.case),
        code=fingerprint("biogrip.stages.selection", METHODS["least_squares"].module),
    message:
        "Fitting every sample model to {wildcards.case}, {wildcards.batch}"
    shell:
        "biogrip selection --settings {params.settings:q} --seeds {wildcards.batch} "
        "--measurements {input.measurements:q} --calibrated {input.calibrated:q} "
        "--output {output:q} 2> {log:q}"
