"""One page per case."""


rule summary:
    input:
        verdicts="results/identifiability/{case}.json",
        figures=lambda wildcards: [
            f"results/figures/{figure}_{wildcards.case}.png"
            for figure in PLAN.summary_figures(wildcards.case)
        ],
        code=source_files("biogrip.summary"),
        template=Path(biogrip.__file__).with_name("summary.html.j2"),
    output:
        report(
            "results/summaries/{case}.html",
            caption="../report/summary.rst",
            category="Summaries",
            labels={"case": "{case}", "item": "summary", "format": "page"},
        ),
    log:
        "results/logs/summaries/{case}.log",
    conda:
        "../envs/biogrip.yaml"
    params:
        settings=lambda wildcards: PLAN.summary(wildcards.case),
    message:
        "Writing what a trace of {wildcards.case} tells on one page"
    shell:
        "biogrip summary --settings {params.settings:q} --verdicts {input.verdicts:q} "
        "--figures {input.figures:q} --output {output:q} 2> {log:q}"
