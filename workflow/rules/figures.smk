"""The figures: of each case with its summary, and of the study; and the page with all of them."""


def case_figures(simulated):
    """The files of the figures of a case, and its summary."""
    drawn = case_figure_names(simulated)
    summary = shown("results/summaries/{case}.html", "pages", "summary", "{case}")
    return [*(file for name in drawn for file in drawing(name, "{case}")), summary]


# Of a recorded trace nobody knows the target.
rule case_figures:
    input:
        identifications="results/identifications/{case}.csv",
        history="results/histories/{case}.npz",
        measurements=of_case("results/measurements/{case}/{batch}.npz"),
        verdicts="results/identifiability/{case}.json",
        expected=of_case("results/identifiability/expected/{case}.json", STUDY.simulated),
        target=of_case("results/targets/{case}.csv", STUDY.simulated),
        calibrated=calibration_of,
    output:
        *case_figures(simulated=True),
    log:
        "results/logs/case_figures/{case}.log",
    benchmark:
        "results/benchmarks/case_figures/{case}.tsv"
    wildcard_constraints:
        case=names(STUDY.simulated),
    params:
        **settings_of(
            *"actuator methods seeds evaluation title published contact models".split(),
            *("genetic_algorithm", "identifiability.confidence", *FIT, *SAMPLING, NOISE),
        ),
    message:
        "Drawing {wildcards.case}"
    script:
        "../scripts/case_figures.py"


use rule case_figures as recorded_case_figures with:
    output:
        *case_figures(simulated=False),
    wildcard_constraints:
        case=names(STUDY.recorded),


rule figures:
    input:
        identifications=files("results/identifications/{case}.csv", STUDY.simulated),
        targets=files("results/targets/{case}.csv", STUDY.simulated),
        expected=files("results/identifiability/expected/{case}.json", STUDY.simulated),
        measurements=files("results/measurements/{case}/{batch}.npz", STUDY.simulated[:1]),
        calibrated=files("results/calibrations/{case}.yaml", CALIBRATED),
        answered=[*files("results/identifiability/{case}.json", ANSWERED), *first_traces(ANSWERED)],
    output:
        **{name: drawing(name) for name in FIGURES},
    log:
        "results/logs/figures.log",
    benchmark:
        "results/benchmarks/figures.tsv"
    params:
        **settings_of(
            *"methods seeds evaluation actuator gripper protocol".split(),
            *keys_of_cases(STUDY, *FIT, "title", "published", *SAMPLING, NOISE),
        ),
    message:
        "Drawing the figures of the study"
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
        stages=["biogrip_study.page.page.write_report"],
    message:
        "Writing the page of the study"
    script:
        "../scripts/stage.py"
