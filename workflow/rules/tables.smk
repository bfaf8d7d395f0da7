"""The tables: of each case with the identifications they are of, and of the study."""


rule case_tables:
    input:
        batches=of_methods("results/identifications/{case}/{method}/{batch}.csv"),
        histories=of_methods("results/histories/{case}/{method}/{batch}.parquet"),
        verdicts="results/identifiability/{case}.json",
        expected=expectation_of,
    output:
        identifications="results/identifications/{case}.csv",
        history="results/histories/{case}.parquet",
        errors=table("errors_{case}", "errors"),
        verdicts=table("verdicts_{case}", "verdicts"),
    log:
        "results/logs/case_tables/{case}.log",
    wildcard_constraints:
        case=names(STUDY.cases),
    params:
        **settings_of("title", "seeds", "methods", "published", *PROBLEM, "evaluation"),
        software=SOFTWARE,
    message:
        "Writing the tables of {wildcards.case}"
    script:
        "../scripts/case_tables.py"


rule tables:
    input:
        errors=of_cases("results/tables/errors_{case}.csv", STUDY.cases),
        times=of_all_batches("results/timings/{case}/{method}/{batch}.csv", STUDY.cases),
        fits=of_all_batches("results/selection/{case}/{batch}.csv", SELECTING),
        identifications=of_cases("results/identifications/{case}.csv", STUDY.cases),
        targets=of_cases("results/targets/{case}.csv", STUDY.simulated),
        intervals=of_all_batches("results/coverage/{case}/{batch}.csv", STUDY.covered),
        measurements=of_all_batches("results/measurements/{case}/{batch}.parquet", STUDY.cases),
        calibrated=of_cases("results/calibrations/{case}.yaml", CALIBRATED),
        differences="results/linearisation.csv" if STUDY.gripped else [],
    output:
        [file for name in TABLES for file in table(name)],
        # Not in tables/, since times are not reproducible.
        multiext("results/timings", ".csv", ".md", ".tex", ".html"),
    log:
        "results/logs/tables.log",
    params:
        **settings_of(*WHOLE),
        software=SOFTWARE,
    message:
        "Writing the tables of the study"
    script:
        "../scripts/tables.py"


rule linearisation:
    output:
        differences="results/linearisation.csv",
    log:
        "results/logs/linearisation.log",
    params:
        **settings_of("cases", "actuator"),
        software=SOFTWARE,
    message:
        "Comparing the linear and the nonlinear model"
    script:
        "../scripts/linearisation.py"


rule contact_loss:
    output:
        *table("contact_loss"),
    log:
        "results/logs/contact_loss.log",
    params:
        **settings_of("study_seed", "seeds", "cases", "actuator"),
        software=SOFTWARE,
    message:
        "Identifying samples whose jaws would have to pull"
    script:
        "../scripts/contact_loss.py"


rule claims:
    input:
        identifications=of_cases("results/identifications/{case}.csv", STUDY.published),
        histories=of_cases("results/histories/{case}.parquet", STUDY.published),
        tables=JUDGED_BY,
        sweeps=PUBLISHED_SWEEPS,
    output:
        *table("claims"),
    log:
        "results/logs/claims.log",
    params:
        **settings_of(*WHOLE),
        software=SOFTWARE,
    message:
        "Judging the claims of the paper"
    script:
        "../scripts/claims.py"
