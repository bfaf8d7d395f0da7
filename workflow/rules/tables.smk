"""The tables: of each case with the identifications they are of, and of the study."""


rule case_tables:
    input:
        batches=of_case("results/identifications/{case}/{method}/{batch}.csv"),
        histories=of_case("results/histories/{case}/{method}/{batch}.npz"),
        measurements=of_case("results/measurements/{case}/{batch}.npz", STUDY.simulated),
        calibrated=calibration_of,
    output:
        identifications="results/identifications/{case}.csv",
        history="results/histories/{case}.npz",
        table="results/tables/errors_{case}.csv",
        page=page_of_table("errors", "{case}"),
    log:
        "results/logs/case_tables/{case}.log",
    benchmark:
        "results/benchmarks/case_tables/{case}.tsv"
    wildcard_constraints:
        case=names(STUDY.cases),
    params:
        **settings_of("actuator", "methods", "seeds", "evaluation", "title", "published", *FIT),
        stages=[
            "biogrip_study.stages.identification.join",
            "biogrip_study.tables.cases.errors_of_case",
        ],
    message:
        "Joining the identifications of {wildcards.case}"
    script:
        "../scripts/stage.py"


rule case_verdicts:
    input:
        verdicts="results/identifiability/{case}.json",
        expected=of_case("results/identifiability/expected/{case}.json", STUDY.simulated),
    output:
        table="results/tables/verdicts_{case}.csv",
        page=page_of_table("verdicts", "{case}"),
    log:
        "results/logs/case_verdicts/{case}.log",
    wildcard_constraints:
        case=names(STUDY.cases),
    params:
        **settings_of("title", *SAMPLE),
        stages=["biogrip_study.tables.cases.verdicts_of_case"],
    message:
        "Listing the verdicts on {wildcards.case}"
    script:
        "../scripts/stage.py"


rule errors:
    input:
        identifications=files("results/identifications/{case}.csv", STUDY.cases),
    output:
        table="results/tables/errors.csv",
        page=page_of_table("errors"),
    log:
        "results/logs/errors.log",
    params:
        **settings_of(
            *("methods", "seeds", "evaluation"),
            *keys_of_cases(STUDY, *SAMPLE, "title", "published"),
        ),
        stages=["biogrip_study.tables.cases.errors"],
    message:
        "Writing the errors of all cases"
    script:
        "../scripts/stage.py"


rule methods:
    input:
        identifications=files("results/identifications/{case}.csv", STUDY.simulated),
    output:
        table="results/tables/methods.csv",
        page=page_of_table("methods"),
    log:
        "results/logs/methods.log",
    params:
        **settings_of(
            *("methods", "seeds", "evaluation", "actuator"),
            *keys_of_cases(STUDY.of(STUDY.simulated), *SAMPLE, *SAMPLING),
        ),
        stages=["biogrip_study.tables.study.methods"],
    message:
        "Comparing the methods"
    script:
        "../scripts/stage.py"


rule models:
    input:
        fits=files("results/selection/{case}/{batch}.csv", SELECTING),
    output:
        table="results/tables/models.csv",
        page=page_of_table("models"),
    log:
        "results/logs/models.log",
    params:
        **settings_of("model_selection", *keys_of_cases(STUDY, *SAMPLE)),
        stages=["biogrip_study.tables.study.models"],
    message:
        "Comparing the sample models"
    script:
        "../scripts/stage.py"


rule coverage:
    input:
        intervals=files("results/coverage/{case}/{batch}.csv", STUDY.covered),
        calibrated=files(
            "results/calibrations/{case}.yaml",
            [name for name in STUDY.covered if name in CALIBRATED],
        ),
    output:
        table="results/tables/coverage.csv",
        page=page_of_table("coverage"),
    log:
        "results/logs/coverage.log",
    params:
        **settings_of(
            "actuator",
            *keys_of_cases(STUDY.of(STUDY.covered), *FIT, *SAMPLING, NOISE, "identifiability"),
            *keys_of_cases(STUDY.of(STUDY.covered), "contact", "models"),
        ),
        stages=["biogrip_study.tables.study.coverage"],
    message:
        "Counting how often intervals hold the truth"
    script:
        "../scripts/stage.py"


rule verdict_counts:
    input:
        intervals=files("results/coverage/{case}/{batch}.csv", STUDY.covered),
    output:
        table="results/tables/verdict_counts.csv",
        page=page_of_table("verdict_counts"),
    log:
        "results/logs/verdict_counts.log",
    params:
        **settings_of("actuator", *keys_of_cases(STUDY.of(STUDY.covered), *FIT, "identifiability")),
        stages=["biogrip_study.tables.study.verdict_counts"],
    message:
        "Counting verdicts"
    script:
        "../scripts/stage.py"


rule markdown_table:
    input:
        page="results/tables/{name}.html",
    output:
        markdown="results/tables/{name}.md",
    log:
        "results/logs/markdown_table/{name}.log",
    localrule: True
    params:
        **settings_of(),
        stages=["biogrip_study.tables.layout.write_markdown"],
    message:
        "Writing the table {wildcards.name} as Markdown"
    script:
        "../scripts/stage.py"


# Every table in a format that forges read.
rule markdown_tables:
    input:
        made("tables", ".md"),
