"""The published results: compared with the default study run afresh, or renewed from it."""

PUBLISHED = Path(workflow.basedir) / "results" / "published"

# What is published beside the default study's results, by the name of its folder: its configs,
# the rule that makes it, and its names.
OVERLAYS = {
    "robustness": (["robustness"], "all_maps", "robustness_*"),
    "interpretations": (
        ["interpretations"],
        "interpretations interpretations_jointly",
        "interpretations*",
    ),
    "coverage": (["coverage"], "verdict_counts", "verdict_counts"),
    # Errors, verdicts and coverage.
    "calibration": (["calibration"], "all_tables", "[cev][eor][rv]*"),
    "measured": (["measured"], "all", "*"),
    "power_law": (["power_law"], "all_tables", "[cev][eor][rv]*"),
    "recorded": (["recorded"], "all_tables", "[cev][eor][rv]*"),
    # Errors, verdicts and robustness.
    "soft": (["soft"], "all_tables all_maps", "[erv][eor]*_soft*"),
}
CONFIGS = Path(workflow.basedir) / "config"

# The default study, whatever this run was configured with; nothing of it is kept.
RUN_AFRESH = (
    "scratch=$(mktemp -d); trap 'rm -rf \"$scratch\"' EXIT; "
    # Recorded traces are found from where Snakemake runs.
    f'cp -R "{workflow.basedir}/data" "$scratch/data"; '
    "snakemake -j {threads} --snakefile {params.snakefile:q} "
    '--directory "$scratch" --quiet rules progress host reason {params.config} -- {params.targets} >> {log:q} 2>&1'
)


# None of these has an output, so that none is ever taken for done.
rule check:
    input:
        published=PUBLISHED / "tables",
    log:
        "results/logs/check.log",
    threads: lambda _: workflow.cores
    params:
        snakefile=workflow.main_snakefile,
        config="",
        targets="all_tables",
    message:
        "Running the default study afresh and comparing its tables with the published ones"
    shell:
        f"{RUN_AFRESH}; "
        'biogrip compare {input.published:q} "$scratch/results/tables" 2>> {log:q} | tee -a {log:q}'


rule publish:
    log:
        "results/logs/publish.log",
    threads: lambda _: workflow.cores
    params:
        snakefile=workflow.main_snakefile,
        config="",
        targets="all",
        published=PUBLISHED,
    message:
        "Running the default study afresh and publishing its tables and figures"
    shell:
        f"{RUN_AFRESH}; "
        'biogrip publish "$scratch/results" {params.published:q} 2>> {log:q} | tee -a {log:q}'


for overlay, (configs, target, only) in OVERLAYS.items():

    rule:
        name:
            f"publish_{overlay}"
        log:
            f"results/logs/publish_{overlay}.log",
        threads: lambda _: workflow.cores
        params:
            snakefile=workflow.main_snakefile,
            config=f"--configfile {' '.join(f'{CONFIGS / name}.yaml' for name in configs)}",
            targets=target,
            published=PUBLISHED / overlay,
            only=only,
        message:
            f"Running {' and '.join(configs)} afresh and publishing its tables and figures"
        shell:
            f"{RUN_AFRESH}; "
            'biogrip publish "$scratch/results" {params.published:q} --only {params.only:q} '
            "2>> {log:q} | tee -a {log:q}"

    rule:
        name:
            f"check_{overlay}"
        input:
            published=PUBLISHED / overlay / "tables",
        log:
            f"results/logs/check_{overlay}.log",
        threads: lambda _: workflow.cores
        params:
            snakefile=workflow.main_snakefile,
            config=f"--configfile {' '.join(f'{CONFIGS / name}.yaml' for name in configs)}",
            targets=target,
            only=only,
        message:
            f"Running {' and '.join(configs)} afresh and comparing its tables with the published ones"
        shell:
            f"{RUN_AFRESH}; "
            'biogrip compare {input.published:q} "$scratch/results/tables" --only {params.only:q} '
            "2>> {log:q} | tee -a {log:q}"
