"""The stages, from the response of a case to what its traces tell."""


rule target:
    output:
        target="results/targets/{case}.csv",
    log:
        "results/logs/target/{case}.log",
    wildcard_constraints:
        case=names(SIMULATED),
    params:
        **settings_of(
            *("instrument", "gripper", "actuator", "protocol", "sample", "fixed", "contact"),
            *("measurement.rate_Hz", "measurement.times_s", "measurement.bursts", "models"),
        ),
        software=SOFTWARE,
    message:
        "Simulating the response of {wildcards.case}"
    script:
        "../scripts/target.py"


# A recorded trace takes the place of target and measurement (rule `recording`).
rule measurement:
    input:
        target="results/targets/{case}.csv",
    output:
        measurements="results/measurements/{case}/{batch}.parquet",
    log:
        "results/logs/measurement/{case}/{batch}.log",
    wildcard_constraints:
        case=names(SIMULATED),
    params:
        **settings_of("study_seed", "measurement.noise"),
        software=SOFTWARE,
    message:
        "Adding noise to {wildcards.case}, {wildcards.batch}"
    script:
        "../scripts/measurement.py"


rule identification:
    input:
        measurements="results/measurements/{case}/{batch}.parquet",
        calibrated=calibration_of,
    output:
        parameters="results/identifications/{case}/{method}/{batch}.csv",
        history="results/histories/{case}/{method}/{batch}.parquet",
        timing="results/timings/{case}/{method}/{batch}.csv",
    log:
        "results/logs/identification/{case}/{method}/{batch}.log",
    params:
        **settings_of("study_seed", *PROBLEM),
        method=method_settings,
        software=SOFTWARE,
    message:
        "Identifying {wildcards.case} by {wildcards.method}, {wildcards.batch}"
    script:
        "../scripts/identification.py"
