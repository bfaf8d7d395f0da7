"""Sweeps: how the identification stands up to noise, sampling and another gripper."""

SWEEPS = [f"robustness_{sweep}" for sweep in STUDY.sweeps]
TABLES += [*(["sampling_evidence"] if PUBLISHED_CASES else []), *SWEEPS]
FIGURES += SWEEPS
SWEPT_FILES = [
    *(
        f"results/robustness/{sweep}/{case}.csv"
        for sweep, block in STUDY.sweeps.items()
        for case in block.cases
    ),
    *(
        file
        for point in STUDY.points
        for stage in ("measurements", "identifications", "histories", "timings")
        for file in PLAN.stage_files(stage, point)
    ),
    *(
        file
        for point in STUDY.points
        for yaml in calibrations_of(point)
        for file in (yaml, yaml.replace(".yaml", ".parquet"))
    ),
    *collect("results/targets/{point}.csv", point=STUDY.points),
    *collect("results/identifications/{point}.csv", point=STUDY.points),
    *collect("results/histories/{point}.parquet", point=STUDY.points),
]


rule robustness:
    input:
        identifications=lambda wildcards: collect(
            "results/identifications/{point}.csv",
            point=PLAN.points(wildcards.sweep, wildcards.case),
        ),
        code=source_files("biogrip.stages.robustness"),
    output:
        "results/robustness/{sweep}/{case}.csv",
    log:
        "results/logs/robustness/{sweep}/{case}.log",
    conda:
        "../envs/biogrip.yaml"
    params:
        settings=lambda wildcards: PLAN.robustness(wildcards.sweep, wildcards.case),
    message:
        "Judging the sweep {wildcards.sweep} over {wildcards.case}"
    shell:
        "biogrip robustness --settings {params.settings:q} "
        "--identifications {input.identifications:q} --output {output:q} 2> {log:q}"


rule robustness_table:
    input:
        points=lambda wildcards: PLAN.sweep_files(
            "results/robustness/{sweep}/{case}.csv", wildcards.sweep
        ),
        code=source_files("biogrip.tables.robustness"),
    output:
        csv="results/tables/robustness_{sweep}.csv",
        text=multiext("results/tables/robustness_{sweep}", ".md", ".tex"),
        html=report(
            "results/tables/robustness_{sweep}.html",
            caption="../report/robustness.rst",
            category="Tables",
            labels={"case": "all", "item": "robustness: {sweep}", "format": "table"},
        ),
    log:
        "results/logs/tables/robustness_{sweep}.log",
    conda:
        "../envs/biogrip.yaml"
    params:
        settings=lambda wildcards: PLAN.heat_maps(wildcards.sweep),
    message:
        "Writing the table of the sweep {wildcards.sweep}"
    shell:
        "biogrip table robustness --settings {params.settings:q} "
        "--inputs {input.points:q} --output {output.csv:q} 2> {log:q}"


rule robustness_figure:
    input:
        points=lambda wildcards: PLAN.sweep_files(
            "results/robustness/{sweep}/{case}.csv", wildcards.sweep
        ),
        code=source_files("biogrip.figures.robustness"),
    output:
        png=report(
            "results/figures/robustness_{sweep}.png",
            caption="../report/robustness.rst",
            category="Figures",
            labels={"case": "all", "item": "robustness: {sweep}", "format": "figure"},
        ),
        pdf="results/figures/robustness_{sweep}.pdf",
    log:
        "results/logs/figures/robustness_{sweep}.log",
    conda:
        "../envs/biogrip.yaml"
    params:
        settings=lambda wildcards: PLAN.heat_maps(wildcards.sweep),
    message:
        "Drawing the heat maps of the sweep {wildcards.sweep}"
    shell:
        "biogrip figure robustness --settings {params.settings:q} "
        "--inputs {input.points:q} --output {output.png:q} 2> {log:q}"


rule sampling_evidence_table:
    input:
        code=source_files("biogrip.tables.sampling_evidence"),
    output:
        csv="results/tables/sampling_evidence.csv",
        text=multiext("results/tables/sampling_evidence", ".md", ".tex"),
        html=report(
            "results/tables/sampling_evidence.html",
            caption="../report/sampling_evidence.rst",
            category="Tables",
            labels={"case": "all", "item": "evidence: sampling", "format": "table"},
        ),
    log:
        "results/logs/tables/sampling_evidence.log",
    conda:
        "../envs/biogrip.yaml"
    params:
        settings=PLAN.sampling_evidence(),
    message:
        "Holding the paper's errors against what noise allows at several sampling rates"
    shell:
        "biogrip table sampling_evidence --settings {params.settings:q} "
        "--output {output.csv:q} 2> {log:q}"
