"""Figures, each as PNG and PDF."""

INPUT_FIGURES = {
    "torque": ("protocol", "actuator"),
    "linkage": ("gripper",),
    "comb": ("actuator", "protocol"),
}
FIGURES = [
    "overview",
    *INPUT_FIGURES,
    "linearisation",
    *(
        f"{figure}_{case}"
        for case in CASES
        for figure in ("convergence", "fit", "evolution")
    ),
]


rule overview_figure:
    input:
        identifications=collect("results/identifications/{case}.csv", case=CASES),
        measurements=PLAN.batch_files(
            "results/measurements/{case}/{batch}.parquet", CASES[0]
        ),
        calibrated=calibrations_of(CASES[0]),
        code=source_files("biogrip.figures.overview"),
    output:
        png=report(
            "results/figures/overview.png",
            caption="../report/overview.rst",
            category="Figures",
            labels={"case": "all", "item": "overview", "format": "figure"},
        ),
        pdf="results/figures/overview.pdf",
    log:
        "results/logs/figures/overview.log",
    conda:
        "../envs/biogrip.yaml"
    params:
        settings=PLAN.overview(),
    message:
        "Drawing the overview"
    shell:
        "biogrip figure overview --settings {params.settings:q} "
        "--inputs {input.identifications:q} {input.measurements:q} {input.calibrated:q} "
        "--output {output.png:q} 2> {log:q}"


rule input_figure:
    input:
        code=lambda wildcards: source_files(f"biogrip.figures.{wildcards.figure}"),
    output:
        png=report(
            "results/figures/{figure}.png",
            caption="../report/input_figure.rst",
            category="Figures",
            labels={"case": "all", "item": "{figure}", "format": "figure"},
        ),
        pdf="results/figures/{figure}.pdf",
    log:
        "results/logs/figures/{figure}.log",
    wildcard_constraints:
        figure="|".join(INPUT_FIGURES),
    conda:
        "../envs/biogrip.yaml"
    params:
        settings=lambda wildcards: PLAN.blocks(*INPUT_FIGURES[wildcards.figure]),
    message:
        "Drawing the figure {wildcards.figure}"
    shell:
        "biogrip figure {wildcards.figure} --settings {params.settings:q} "
        "--output {output.png:q} 2> {log:q}"


rule convergence_figure:
    input:
        identifications="results/identifications/{case}.csv",
        history="results/histories/{case}.parquet",
        code=source_files("biogrip.figures.convergence"),
    output:
        png=report(
            "results/figures/convergence_{case}.png",
            caption="../report/convergence.rst",
            category="Figures",
            labels={"case": "{case}", "item": "convergence", "format": "figure"},
        ),
        pdf="results/figures/convergence_{case}.pdf",
    log:
        "results/logs/figures/convergence_{case}.log",
    conda:
        "../envs/biogrip.yaml"
    params:
        settings=lambda wildcards: PLAN.convergence(wildcards.case),
    message:
        "Drawing the convergence of {wildcards.case}"
    shell:
        "biogrip figure convergence --settings {params.settings:q} "
        "--inputs {input.identifications:q} {input.history:q} "
        "--output {output.png:q} 2> {log:q}"


rule fit_figure:
    input:
        identifications="results/identifications/{case}.csv",
        measurements=lambda wildcards: PLAN.batch_files(
            "results/measurements/{case}/{batch}.parquet", wildcards.case
        ),
        calibrated=lambda wildcards: calibrations_of(wildcards.case),
        code=source_files("biogrip.figures.fit"),
    output:
        png=report(
            "results/figures/fit_{case}.png",
            caption="../report/fit.rst",
            category="Figures",
            labels={"case": "{case}", "item": "fit", "format": "figure"},
        ),
        pdf="results/figures/fit_{case}.pdf",
    log:
        "results/logs/figures/fit_{case}.log",
    conda:
        "../envs/biogrip.yaml"
    params:
        settings=lambda wildcards: PLAN.fit(wildcards.case),
    message:
        "Drawing the best fit of {wildcards.case}"
    shell:
        "biogrip figure fit --settings {params.settings:q} "
        "--inputs {input.identifications:q} {input.measurements:q} {input.calibrated:q} "
        "--output {output.png:q} 2> {log:q}"


rule evolution_figure:
    input:
        identifications="results/identifications/{case}.csv",
        history="results/histories/{case}.parquet",
        code=source_files("biogrip.figures.evolution"),
    output:
        png=report(
            "results/figures/evolution_{case}.png",
            caption="../report/evolution.rst",
            category="Figures",
            labels={"case": "{case}", "item": "evolution", "format": "figure"},
        ),
        pdf="results/figures/evolution_{case}.pdf",
    log:
        "results/logs/figures/evolution_{case}.log",
    conda:
        "../envs/biogrip.yaml"
    params:
        settings=lambda wildcards: PLAN.evolution(wildcards.case),
    message:
        "Drawing the evolution of the parameters of {wildcards.case}"
    shell:
        "biogrip figure evolution --settings {params.settings:q} "
        "--inputs {input.identifications:q} {input.history:q} "
        "--output {output.png:q} 2> {log:q}"


rule linearisation_figure:
    input:
        comparison="results/linearisation.csv",
        code=source_files("biogrip.figures.linearisation"),
    output:
        png=report(
            "results/figures/linearisation.png",
            caption="../report/linearisation.rst",
            category="Figures",
            labels={"case": "all", "item": "linearisation", "format": "figure"},
        ),
        pdf="results/figures/linearisation.pdf",
    log:
        "results/logs/figures/linearisation.log",
    conda:
        "../envs/biogrip.yaml"
    params:
        settings=PLAN.linearisation(),
    message:
        "Drawing linear against nonlinear model"
    shell:
        "biogrip figure linearisation --settings {params.settings:q} "
        "--inputs {input.comparison:q} --output {output.png:q} 2> {log:q}"
