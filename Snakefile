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


rule all:
    default_target: True
    input:
        targets=collect("results/targets/{case}.csv", case=PLAN.simulated),
        batches=[
            file
            for case in CASES
            for stage in STAGES_IN_BATCHES
            for file in PLAN.stage_files(stage, case)
        ],
        identifications=collect("results/identifications/{case}.csv", case=CASES),
        tables=collect("results/tables/{table}.csv", table=TABLES),
        timings="results/timings.csv",
        summaries=collect("results/summaries/{case}.html", case=CASES),
        figures=collect("results/figures/{figure}.png", figure=FIGURES),


rule all_tables:
    input:
        collect("results/tables/{table}.csv", table=TABLES),
