"""The study on one page."""


rule page:
    input:
        captions=[workflow.source_path(f"../report/{name}.rst") for name in CAPTIONS],
        figures=[f"results/figures/{name}.png" for name in PAGE_FIGURES],
        tables=[f"results/tables/{name}.html" for name in PAGE_TABLES],
        downloads=[f"results/tables/{name}.csv" for name in PAGE_TABLES],
        identifications=of_cases("results/identifications/{case}.csv", STUDY.cases),
        verdicts=of_cases("results/identifiability/{case}.json", STUDY.cases),
        measurements=first_batches("results/measurements/{case}/{batch}.parquet"),
        calibrated=of_cases("results/calibrations/{case}.yaml", CALIBRATED),
    output:
        page=report(
            "results/report.html",
            caption="../report/report.rst",
            category="Summaries",
            labels={"case": "all", "item": "report", "format": "page"},
        ),
    log:
        "results/logs/page.log",
    params:
        **settings_of(*StudyConfig.model_fields, *METHOD_BLOCKS),
        software=SOFTWARE,
    message:
        "Writing the page of the study"
    script:
        "../scripts/page.py"
