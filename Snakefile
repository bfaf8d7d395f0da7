"""The paper's numerical study, from targets to tables and figures."""

from snakemake.utils import min_version

min_version("9.11")


report: "workflow/report/study.rst"


include: "workflow/rules/common.smk"
include: "workflow/rules/stages.smk"
include: "workflow/rules/products.smk"
include: "workflow/rules/traces.smk"
include: "workflow/rules/check.smk"


rule all:
    default_target: True
    input:
        ALL_FILES,
    message:
        "The whole study; results/report.html shows it"


for group, pattern in GROUPS.items():

    rule:
        name:
            f"all_{group}"
        input:
            [file for file in ALL_FILES if Path(file).match(pattern)],
        message:
            f"All {group}"
