"""The figures: of each case, and of the study; what its trace tells; and the page with all."""


# Of a recorded trace nobody knows the target.
rule case_figures:
    input:
        identifications="results/identifications/{case}.csv",
        history="results/histories/{case}.npz",
        measurements=of_case("results/measurements/{case}/{batch}.npz"),
        verdicts="results/identifiability/{case}.json",
        expected=of_case("results/identifiability/expected/{case}.json", STUDY.simulated),
        calibrated=calibration_of,
    output:
        **{name: drawing(name, "{case}") for name in [*OF_EVERY_CASE, *OF_SIMULATED]},
    log:
        "results/logs/case_figures/{case}.log",
    benchmark:
        "results/benchmarks/case_figures/{case}.tsv"
    wildcard_constraints:
        case=names(STUDY.simulated),
    params:
        **settings_of(
            *"actuator methods seeds evaluation title published".split(),
            *("genetic_algorithm", *FIT, *SAMPLING),
        ),
        stages=[*OF_EVERY_CASE.values(), *OF_SIMULATED.values()],
    message:
        "Drawing {wildcards.case}"
    script:
        "../scripts/figures.py"


use rule case_figures as recorded_case_figures with:
    output:
        **{name: drawing(name, "{case}") for name in OF_EVERY_CASE},
    wildcard_constraints:
        case=names(STUDY.recorded),
    params:
        stages=[*OF_EVERY_CASE.values()],


rule summary:
    input:
        verdicts="results/identifiability/{case}.json",
        judged_fit="results/figures/judged_fit_{case}.png",
        profiles="results/figures/profiles_{case}.png",
    output:
        summary=shown("results/summaries/{case}.html", "pages", "summary", "{case}"),
    log:
        "results/logs/summary/{case}.log",
    params:
        **settings_of("title", *SAMPLE),
        stages=["biogrip_study.page.page.write_summary"],
    message:
        "Summing up what the judged trace of {wildcards.case} tells"
    script:
        "../scripts/stage.py"


rule overview:
    input:
        identifications=files("results/identifications/{case}.csv", FIRST.cases),
        expected=files("results/identifiability/expected/{case}.json", FIRST.cases),
        measurements=files("results/measurements/{case}/{batch}.npz", STUDY.simulated[:1]),
        calibrated=files(
            "results/calibrations/{case}.yaml",
            [name for name in STUDY.simulated[:1] if name in CALIBRATED],
        ),
    output:
        overview=drawing("overview"),
    log:
        "results/logs/overview.log",
    params:
        **settings_of(
            *("methods", "seeds", "evaluation", "actuator"),
            *keys_of_cases(FIRST, *FIT, "title", "published"),
        ),
        stages=["biogrip_study.figures.overview.draw_overview"],
    message:
        "Drawing the study at a glance"
    script:
        "../scripts/figures.py"


rule page:
    input:
        captions=[
            workflow.source_path(f"../report/{kind}/{name}.rst")
            for kind, items in SHOWN.items()
            for name in dict.fromkeys(name for name, _ in items)
        ],
        figures=made("figures", ".png"),
        tables=made("tables", ".html"),
        downloads=made("tables", ".csv"),
        verdicts=files("results/identifiability/{case}.json", STUDY.cases),
        measurements=first_traces(STUDY.cases),
    output:
        page="results/report.html",
        # Of the front page of Snakemake's report, which has all else that the page has.
        front=shown("results/answers.html", "pages", "answers", ""),
    log:
        "results/logs/page.log",
    benchmark:
        "results/benchmarks/page.tsv"
    params:
        **settings_of(
            # All, for it shows the config.
            *(key for key in STUDY_KEYS if key != "cases"),
            *keys_of_cases(STUDY, *CASE_KEYS),
        ),
        shown=SHOWN,
        stages=["biogrip_study.page.page.write_report"],
    message:
        "Writing the page of the study"
    script:
        "../scripts/stage.py"
