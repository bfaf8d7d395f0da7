"""The published results: compared with the default study run afresh, or renewed from it."""

PUBLISHED = Path(workflow.basedir) / "results" / "published"

# The default study, whatever this run was configured with; nothing of it is kept.
RUN_AFRESH = (
    "scratch=$(mktemp -d); trap 'rm -rf \"$scratch\"' EXIT; "
    "snakemake -j {threads} --snakefile {params.snakefile:q} "
    '--directory "$scratch" --quiet all -- {params.targets} >> {log:q} 2>&1'
)


# Neither has an output, so that neither is ever taken for done.
rule check:
    input:
        published=PUBLISHED / "tables",
    log:
        "results/logs/check.log",
    threads: workflow.cores
    params:
        snakefile=workflow.main_snakefile,
        targets="all_tables",
    message:
        "Running the default study afresh and comparing its tables with the published ones"
    shell:
        f"{RUN_AFRESH}; "
        'biogrip compare {input.published:q} "$scratch/results/tables" 2>> {log:q} | tee -a {log:q}'


rule publish:
    log:
        "results/logs/publish.log",
    threads: workflow.cores
    params:
        snakefile=workflow.main_snakefile,
        targets="all",
        published=PUBLISHED,
    message:
        "Running the default study afresh and publishing its tables and figures"
    shell:
        f"{RUN_AFRESH}; "
        'biogrip publish "$scratch/results" {params.published:q} 2>> {log:q} | tee -a {log:q}'
