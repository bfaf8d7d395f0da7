"""The paper's numerical study, from targets to tables and figures."""

from snakemake.utils import min_version

min_version("9.10")


report: "workflow/report/study.rst"


include: "workflow/rules/common.smk"
include: "workflow/rules/traces.smk"
include: "workflow/rules/identification.smk"
include: "workflow/rules/identifiability.smk"
include: "workflow/rules/tables.smk"
include: "workflow/rules/figures.smk"
include: "workflow/rules/summaries.smk"
include: "workflow/rules/robustness.smk"
include: "workflow/rules/check.smk"


# On a cluster these run where Snakemake does: each is less work than submitting it.
localrules:
    target,
    recording,
    export,
    input_table,
    input_figure,
    all_errors_table,
    printed_values_table,
    linearisation_table,
    linearisation_figure,
    methods_table,
    models_table,
    coverage_table,
    timings_table,
    joined,
    sampling_evidence_table,
    summary,


# Every file that is made on the way is asked for by itself: what is lost is made again.
ALL_FILES = [
    *collect("results/targets/{case}.csv", case=PLAN.simulated),
    *(
        file
        for case in CASES
        for stage in STAGES_IN_BATCHES
        for file in PLAN.stage_files(stage, case)
    ),
    *collect("results/identifications/{case}.csv", case=CASES),
    *collect("results/histories/{case}.parquet", case=CASES),
    *collect("results/timings/{case}.csv", case=CASES),
    *(
        f"results/{stage}/{case}.csv"
        for stage, cases in (("selection", CASES), ("coverage", PLAN.covered))
        if stage in STAGES_IN_BATCHES
        for case in cases
    ),
    *(
        file
        for case in CASES
        for yaml in calibrations_of(case)
        for file in (yaml, yaml.replace(".yaml", ".parquet"))
    ),
    *collect("results/identifiability/{case}.json", case=CASES),
    *(file for case in CASES for file in expectation_of(case)),
    *(["results/linearisation.csv"] if PLAN.simulated else []),
    *SWEPT_FILES,
    *collect("results/tables/{table}.{kind}", table=TABLES, kind=TABLE_KINDS),
    *collect("results/timings.{kind}", kind=TABLE_KINDS),
    *collect("results/figures/{figure}.{kind}", figure=FIGURES, kind=["png", "pdf"]),
    *collect("results/summaries/{case}.html", case=CASES),
]


rule all:
    default_target: True
    input:
        ALL_FILES,


rule all_tables:
    input:
        collect("results/tables/{table}.csv", table=TABLES),
