"""The tables: of each case with the identifications they are of, and of the study."""


rule case_tables:
    input:
        batches=of_case("results/identifications/{case}/{method}/{batch}.csv"),
        histories=of_case("results/histories/{case}/{method}/{batch}.npz"),
        measurements=of_case("results/measurements/{case}/{batch}.npz", STUDY.simulated),
        calibrated=calibration_of,
        verdicts="results/identifiability/{case}.json",
        expected=of_case("results/identifiability/expected/{case}.json", STUDY.simulated),
    output:
        identifications="results/identifications/{case}.csv",
        history="results/histories/{case}.npz",
        errors=table("errors", "{case}"),
        verdicts=table("verdicts", "{case}"),
    log:
        "results/logs/case_tables/{case}.log",
    benchmark:
        "results/benchmarks/case_tables/{case}.tsv"
    wildcard_constraints:
        case=names(STUDY.cases),
    params:
        **settings_of("actuator", "methods", "evaluation", "title", "published", *FIT),
    message:
        "Writing the tables of {wildcards.case}"
    script:
        "../scripts/case_tables.py"


rule model_errors:
    output:
        differences="results/linearisation.csv",
        contact_loss=table("contact_loss"),
    log:
        "results/logs/model_errors.log",
    benchmark:
        "results/benchmarks/model_errors.tsv"
    params:
        **settings_of(
            *("study_seed", "seeds", "actuator"),
            *keys_of_cases(STUDY, *FIT, "models", *SAMPLING, NOISE, "least_squares"),
        ),
    message:
        "Comparing the linear model with the nonlinear one, and with loss of contact"
    script:
        "../scripts/model_errors.py"


rule tables:
    input:
        fits=files("results/selection/{case}/{batch}.csv", SELECTING),
        identifications=files("results/identifications/{case}.csv", STUDY.cases),
        targets=files("results/targets/{case}.csv", STUDY.simulated),
        intervals=files("results/coverage/{case}/{batch}.csv", STUDY.covered),
        measurements=files("results/measurements/{case}/{batch}.npz", STUDY.cases),
        calibrated=files("results/calibrations/{case}.yaml", CALIBRATED),
        differences="results/linearisation.csv" if STUDY.gripped else [],
    output:
        [file for name in TABLES for file in table(name)],
    log:
        "results/logs/tables.log",
    benchmark:
        "results/benchmarks/tables.tsv"
    params:
        **settings_of(
            *"methods evaluation actuator gripper protocol search_range".split(),
            *("model_selection", "reconstructed"),
            *keys_of_cases(STUDY, *FIT, "title", "published", "models", *SAMPLING, NOISE),
            *keys_of_cases(STUDY, "identifiability"),
        ),
    message:
        "Writing the tables of the study"
    script:
        "../scripts/tables.py"


rule claims:
    input:
        identifications=files("results/identifications/{case}.csv", STUDY.published),
        histories=files("results/histories/{case}.npz", STUDY.published),
        tables=[f"results/tables/{name}.csv" for name in TABLES]
        + files("results/tables/verdicts_{case}.csv", STUDY.cases),
        # As published, since these sweeps take longer than the study.
        sweeps=[
            str(shipped(f"results/published/{sweep}.csv"))
            for sweep in (
                *(f"robustness/tables/robustness_{name}" for name in ("noise", "gripper")),
                "interpretations/tables/interpretations",
            )
        ],
    output:
        *table("claims"),
    log:
        "results/logs/claims.log",
    benchmark:
        "results/benchmarks/claims.tsv"
    params:
        **settings_of(
            *"study_seed methods evaluation actuator gripper".split(),
            *keys_of_cases(STUDY, "title", "published", "gripper", "calibration", *SAMPLE, NOISE),
        ),
    message:
        "Judging the claims of the paper"
    script:
        "../scripts/claims.py"
