"""Figures, each as PNG and PDF."""

INPUT_FIGURES = {
    "torque": ("protocol", "actuator"),
    "linkage": ("gripper",),
    "comb": ("actuator", "protocol"),
}
FIGURES = [
    *INPUT_FIGURES,
    *(["overview", "linearisation"] if PLAN.simulated else []),
    *(
        f"{figure}_{case}"
        for case in CASES
        for figure in ("convergence", "fit", "evolution", "profiles")
    ),
    *(
        f"{figure}_{case}"
        for case in PLAN.simulated
        for figure in ("waterfall", "scatter")
    ),
    *(f"valley_{case}" for case in CASES if PLAN.has_valley(case)),
]


rule overview_figure:
    input:
        identifications=collect(
            "results/identifications/{case}.csv", case=PLAN.overviewed
        ),
        measurements=[
            file
            for case in PLAN.overviewed[:1]
            for file in PLAN.batch_files(
                "results/measurements/{case}/{batch}.parquet", case
            )
        ],
        calibrated=[
            file for case in PLAN.overviewed[:1] for file in calibrations_of(case)
        ],
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


rule waterfall_figure:
    input:
        identifications="results/identifications/{case}.csv",
        code=source_files("biogrip.figures.waterfall"),
    output:
        png=report(
            "results/figures/waterfall_{case}.png",
            caption="../report/waterfall.rst",
            category="Figures",
            labels={"case": "{case}", "item": "waterfall", "format": "figure"},
        ),
        pdf="results/figures/waterfall_{case}.pdf",
    log:
        "results/logs/figures/waterfall_{case}.log",
    conda:
        "../envs/biogrip.yaml"
    params:
        settings=lambda wildcards: PLAN.waterfall(wildcards.case),
    message:
        "Drawing the waterfall of {wildcards.case}"
    shell:
        "biogrip figure waterfall --settings {params.settings:q} "
        "--inputs {input.identifications:q} --output {output.png:q} 2> {log:q}"


rule scatter_figure:
    input:
        identifications="results/identifications/{case}.csv",
        target="results/targets/{case}.csv",
        code=source_files("biogrip.figures.scatter"),
    output:
        png=report(
            "results/figures/scatter_{case}.png",
            caption="../report/scatter.rst",
            category="Figures",
            labels={"case": "{case}", "item": "scatter", "format": "figure"},
        ),
        pdf="results/figures/scatter_{case}.pdf",
    log:
        "results/logs/figures/scatter_{case}.log",
    conda:
        "../envs/biogrip.yaml"
    params:
        settings=lambda wildcards: PLAN.scatter(wildcards.case),
    message:
        "Drawing the errors over seeds of {wildcards.case}"
    shell:
        "biogrip figure scatter --settings {params.settings:q} "
        "--inputs {input.identifications:q} {input.target:q} "
        "--output {output.png:q} 2> {log:q}"


rule profiles_figure:
    input:
        measured="results/identifiability/{case}.json",
        expected=lambda wildcards: expectation_of(wildcards.case),
        code=source_files("biogrip.figures.profiles"),
    output:
        png=report(
            "results/figures/profiles_{case}.png",
            caption="../report/profiles.rst",
            category="Figures",
            labels={"case": "{case}", "item": "profiles", "format": "figure"},
        ),
        pdf="results/figures/profiles_{case}.pdf",
    log:
        "results/logs/figures/profiles_{case}.log",
    conda:
        "../envs/biogrip.yaml"
    params:
        settings=lambda wildcards: PLAN.profiles(wildcards.case),
    message:
        "Drawing the profile likelihoods of {wildcards.case}"
    shell:
        "biogrip figure profiles --settings {params.settings:q} "
        "--inputs {input.measured:q} {input.expected:q} --output {output.png:q} 2> {log:q}"


rule valley_figure:
    input:
        measured="results/identifiability/{case}.json",
        identifications="results/identifications/{case}.csv",
        code=source_files("biogrip.figures.valley"),
    output:
        png=report(
            "results/figures/valley_{case}.png",
            caption="../report/valley.rst",
            category="Figures",
            labels={"case": "{case}", "item": "valley", "format": "figure"},
        ),
        pdf="results/figures/valley_{case}.pdf",
    log:
        "results/logs/figures/valley_{case}.log",
    conda:
        "../envs/biogrip.yaml"
    params:
        settings=lambda wildcards: PLAN.valley(wildcards.case),
    message:
        "Drawing the valley of {wildcards.case}"
    shell:
        "biogrip figure valley --settings {params.settings:q} "
        "--inputs {input.measured:q} {input.identifications:q} "
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
