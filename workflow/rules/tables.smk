"""The tables: of each case with the identifications they are of, and of the study."""


rule case_tables:
    input:
        batches=of_case("results/identifications/{case}/{method}/{batch}.csv"),
        histories=of_case("results/histories/{case}/{method}/{batch}.npz"),
        measurements=of_case("results/measurements/{case}/{batch}.npz", STUDY.simulated),
        calibrated=calibration_of,
        judged="results/identifiability/{case}.json",
        expected=of_case("results/identifiability/expected/{case}.json", STUDY.simulated),
    output:
        identifications="results/identifications/{case}.csv",
        history="results/histories/{case}.npz",
        errors="results/tables/errors_{case}.csv",
        errors_page=page_of_table("errors", "{case}"),
        verdicts="results/tables/verdicts_{case}.csv",
        verdicts_page=page_of_table("verdicts", "{case}"),
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
            "biogrip_study.tables.cases.write_tables",
        ],
    message:
        "Writing the tables of {wildcards.case}"
    script:
        "../scripts/stage.py"


rule tables:
    input:
        fits=files("results/selection/{case}/{batch}.csv", SELECTING),
        identifications=files("results/identifications/{case}.csv", STUDY.cases),
        targets=files("results/targets/{case}.csv", STUDY.simulated),
        intervals=files("results/coverage/{case}/{batch}.csv", STUDY.covered),
        calibrated=files("results/calibrations/{case}.yaml", CALIBRATED),
    output:
        tables=expand("results/tables/{name}.csv", name=TABLES),
        pages=[page_of_table(name) for name in TABLES],
    log:
        "results/logs/tables.log",
    benchmark:
        "results/benchmarks/tables.tsv"
    params:
        **settings_of(
            *"methods seeds evaluation actuator model_selection".split(),
            *keys_of_cases(STUDY, *FIT, "title", "published", "models", *SAMPLING, NOISE),
            *keys_of_cases(STUDY, "identifiability"),
        ),
    message:
        "Writing the tables of the study"
    script:
        "../scripts/tables.py"


rule convert_table:
    input:
        page="results/tables/{name}.html",
    output:
        converted="results/tables/{name}.{format}",
    log:
        "results/logs/convert_table/{name}.{format}.log",
    wildcard_constraints:
        format="md|tex",
    localrule: True
    params:
        **settings_of(),
        stages=["biogrip_study.tables.layout.write_converted"],
    message:
        "Writing the table {wildcards.name} as {wildcards.format}"
    script:
        "../scripts/stage.py"


# Every table in a format that papers or forges read.
rule latex_tables:
    input:
        made("tables", ".tex"),


rule markdown_tables:
    input:
        made("tables", ".md"),
