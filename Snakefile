"""The paper's numerical study, from targets to tables and figures."""

from snakemake.utils import min_version

min_version("9.11")


report: "workflow/report/study.rst"


include: "workflow/rules/common.smk"
include: "workflow/rules/products.smk"
include: "workflow/rules/check.smk"


rule all:
    default_target: True
    input:
        ALL_FILES,
    message:
        "The whole study; results/report.html shows it"


rule all_maps:
    input:
        [file for file in ALL_FILES if Path(file).name.startswith("robustness_")],
    message:
        "All maps of robustness"


rule all_designs:
    input:
        [file for file in ALL_FILES if Path(file).name.startswith("designed")],
    message:
        "All designs"


rule all_sequences:
    input:
        [file for file in ALL_FILES if Path(file).name.startswith("sequential")],
    message:
        "All sequences of experiments"


rule all_posteriors:
    input:
        [file for file in ALL_FILES if Path(file).name.startswith("posterior")],
    message:
        "All posteriors"


rule all_tables:
    input:
        [file for file in ALL_FILES if file.startswith("results/tables/")],
    message:
        "All tables"
