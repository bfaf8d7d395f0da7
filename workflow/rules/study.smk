"""The stages, from the response of a case to what its traces tell."""


rule target:
    output:
        target="results/targets/{case}.csv",
    log:
        "results/logs/target/{case}.log",
    wildcard_constraints:
        case=names(SIMULATED),
    params:
        **settings_of("actuator", "gripper", "contact", "models", *SAMPLE, *SAMPLING),
        stages=["biogrip_study.stages.targets.simulate_target"],
    message:
        "Simulating the response of {wildcards.case}"
    script:
        "../scripts/stage.py"


# A recorded trace takes the place of target and measurement (rule `recording`).
rule measurement:
    input:
        target="results/targets/{case}.csv",
    output:
        measurements="results/measurements/{case}/{batch}.npz",
    log:
        "results/logs/measurement/{case}/{batch}.log",
    wildcard_constraints:
        case=names(SIMULATED),
    params:
        **settings_of("study_seed", "actuator", NOISE, *SAMPLE, *SAMPLING),
        stages=["biogrip_study.stages.targets.measure"],
    message:
        "Adding noise to {wildcards.case}, {wildcards.batch}"
    script:
        "../scripts/stage.py"


rule recording:
    input:
        recorded=lambda wildcards: STUDY.case(wildcards.case).block.measurement.file,
    output:
        measurements="results/measurements/{case}/seeds_0-0.npz",
    log:
        "results/logs/recording/{case}.log",
    wildcard_constraints:
        case=names(STUDY.recorded),
    params:
        **settings_of("actuator", *FIT, *OF_FILE),
        # Dates do not tell that an older file has taken the place of this one.
        recorded=lambda wildcards: {
            "recorded": digest_of(Path(STUDY.case(wildcards.case).block.measurement.file))
        },
        stages=["biogrip_study.stages.targets.record"],
    message:
        "Reading the recorded trace of {wildcards.case}"
    script:
        "../scripts/stage.py"


rule calibration:
    output:
        gripper="results/calibrations/{case}.yaml",
    log:
        "results/logs/calibration/{case}.log",
    wildcard_constraints:
        case=names(CALIBRATED),
    params:
        **settings_of("study_seed", "actuator", "gripper", "calibration", *SAMPLE),
        stages=["biogrip_study.stages.targets.calibrate_gripper"],
    message:
        "Calibrating the gripper of {wildcards.case} without a sample"
    script:
        "../scripts/stage.py"


rule identification:
    input:
        measurements="results/measurements/{case}/{batch}.npz",
        calibrated=calibration_of,
    output:
        parameters="results/identifications/{case}/{method}/{batch}.csv",
        history="results/histories/{case}/{method}/{batch}.npz",
    log:
        "results/logs/identification/{case}/{method}/{batch}.log",
    benchmark:
        "results/benchmarks/identification/{case}/{method}/{batch}.tsv"
    resources:
        runtime=120,
    params:
        **settings_of("study_seed", "actuator", *FIT),
        method=lambda wildcards: settings(STUDY, [METHODS[wildcards.method].key], wildcards.case),
        stages=["biogrip_study.stages.identification.identify_seeds"],
    message:
        "Identifying {wildcards.case} by {wildcards.method}, {wildcards.batch}"
    script:
        "../scripts/stage.py"


rule judgement:
    input:
        measurements=lambda wildcards: first_traces([wildcards.case]),
        target=of_case("results/targets/{case}.csv", STUDY.simulated),
        calibrated=calibration_of,
    output:
        verdicts="results/identifiability/{case}.json",
        expected="results/identifiability/expected/{case}.json",
    log:
        "results/logs/judgement/{case}.log",
    benchmark:
        "results/benchmarks/judgement/{case}.tsv"
    wildcard_constraints:
        case=names(STUDY.simulated),
    resources:
        runtime=60,
    params:
        **settings_of(
            *("study_seed", "actuator", *FIT, *SAMPLING, NOISE),
            *("identifiability.confidence", "least_squares"),
        ),
        stages=["biogrip_study.stages.judgement.judge", "biogrip_study.stages.judgement.expect"],
    message:
        "Computing confidence limits for the first trace of {wildcards.case}"
    script:
        "../scripts/stage.py"


# Without a target nobody knows what to expect.
use rule judgement as recorded_judgement with:
    output:
        verdicts="results/identifiability/{case}.json",
    wildcard_constraints:
        case=names(STUDY.recorded),
    params:
        **settings_of("measurement.start_s", "model_selection"),
        stages=["biogrip_study.stages.judgement.judge"],


rule intervals:
    input:
        target="results/targets/{case}.csv",
        expected="results/identifiability/expected/{case}.json",
        calibrated=calibration_of,
    output:
        intervals="results/coverage/{case}/{batch}.csv",
    log:
        "results/logs/intervals/{case}/{batch}.log",
    benchmark:
        "results/benchmarks/intervals/{case}/{batch}.tsv"
    wildcard_constraints:
        case=names(STUDY.covered),
    resources:
        runtime=120,
    params:
        **settings_of(
            *("study_seed", "actuator", *FIT, *SAMPLING, NOISE, "least_squares"),
            *("identifiability.confidence", "identifiability.verdicts_every"),
        ),
        stages=["biogrip_study.stages.judgement.estimate_intervals"],
    message:
        "Estimating intervals of {wildcards.case}, {wildcards.batch}"
    script:
        "../scripts/stage.py"


rule model_fits:
    input:
        measurements="results/measurements/{case}/{batch}.npz",
        calibrated=calibration_of,
    output:
        fits="results/selection/{case}/{batch}.csv",
    log:
        "results/logs/model_fits/{case}/{batch}.log",
    benchmark:
        "results/benchmarks/model_fits/{case}/{batch}.tsv"
    resources:
        runtime=60,
    params:
        **settings_of("study_seed", "actuator", *FIT, "model_selection", "least_squares"),
        stages=["biogrip_study.stages.identification.fit"],
    message:
        "Fitting every sample model to {wildcards.case}, {wildcards.batch}"
    script:
        "../scripts/stage.py"
