"""Noise-free targets, and the same traces with noise."""


rule target:
    input:
        code=source_files("biogrip.stages.target"),
    output:
        "results/targets/{case}.csv",
    log:
        "results/logs/target/{case}.log",
    conda:
        "../envs/biogrip.yaml"
    params:
        settings=lambda wildcards: PLAN.target(wildcards.case),
    message:
        "Simulating the response of {wildcards.case}"
    shell:
        "biogrip target --settings {params.settings:q} --output {output:q} 2> {log:q}"


rule measurement:
    input:
        target="results/targets/{case}.csv",
    output:
        "results/measurements/{case}/{batch}.parquet",
    log:
        "results/logs/measurement/{case}/{batch}.log",
    wildcard_constraints:
        case="|".join(map(re.escape, [*PLAN.simulated, *STUDY.points])) or NONE,
    conda:
        "../envs/biogrip.yaml"
    params:
        settings=lambda wildcards: PLAN.measurement(wildcards.case),
        code=fingerprint("biogrip.stages.measurement"),
    message:
        "Adding noise to {wildcards.case}, {wildcards.batch}"
    shell:
        "biogrip measurement --settings {params.settings:q} --seeds {wildcards.batch} "
        "--target {input.target:q} --output {output:q} 2> {log:q}"


rule recording:
    input:
        recorded=lambda wildcards: PLAN.recorded_file(wildcards.case),
        code=source_files("biogrip.stages.recording"),
    output:
        "results/measurements/{case}/seeds_0-0.parquet",
    log:
        "results/logs/recording/{case}.log",
    wildcard_constraints:
        case="|".join(map(re.escape, PLAN.recorded)) or NONE,
    conda:
        "../envs/biogrip.yaml"
    params:
        settings=lambda wildcards: PLAN.recording(wildcards.case),
    message:
        "Reading the recorded trace of {wildcards.case}"
    shell:
        "biogrip recording --settings {params.settings:q} --recorded {input.recorded:q} "
        "--output {output:q} 2> {log:q}"


rule export:
    input:
        measurements=lambda wildcards: PLAN.batch_of_seed(
            "results/measurements/{case}/{batch}.parquet",
            wildcards.case,
            int(wildcards.seed),
        ),
        code=source_files("biogrip.stages.export"),
    output:
        "results/traces/{case}/seed_{seed}.csv",
    log:
        "results/logs/export/{case}/seed_{seed}.log",
    wildcard_constraints:
        seed=r"\d+",
    conda:
        "../envs/biogrip.yaml"
    message:
        "Writing trace {wildcards.seed} of {wildcards.case} as CSV"
    shell:
        "biogrip export --seed {wildcards.seed} --measurements {input.measurements:q} "
        "--output {output:q} 2> {log:q}"


rule calibration:
    input:
        code=source_files("biogrip.stages.calibration"),
    output:
        gripper="results/calibrations/{case}.yaml",
        traces="results/calibrations/{case}.parquet",
    log:
        "results/logs/calibration/{case}.log",
    conda:
        "../envs/biogrip.yaml"
    params:
        settings=lambda wildcards: PLAN.calibration(wildcards.case),
    message:
        "Calibrating the gripper of {wildcards.case} without a sample"
    shell:
        "biogrip calibration --settings {params.settings:q} "
        "--output {output.gripper:q} --traces {output.traces:q} 2> {log:q}"
