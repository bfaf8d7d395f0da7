"""The figures: of each case with its summary, and of the study."""


# Of a recorded trace nobody knows the target; a valley has who searches for c and c_p.
rule case_figures:
    input:
        identifications="results/identifications/{case}.csv",
        history="results/histories/{case}.parquet",
        measurements=all_batches("results/measurements/{case}/{batch}.parquet"),
        verdicts="results/identifiability/{case}.json",
        expected=expectation_of,
        target=target_of,
        calibrated=calibration_of,
    output:
        *case_figures(simulated=True, valley=True),
    log:
        "results/logs/case_figures/{case}.log",
    wildcard_constraints:
        case=names(case for case in STUDY.simulated if STUDY.case(case).has_valley),
    params:
        **settings_of(*CASE_FIGURES),
        software=SOFTWARE,
    message:
        "Drawing {wildcards.case}"
    script:
        "../scripts/case_figures.py"


use rule case_figures as case_figures_without_valley with:
    output:
        *case_figures(simulated=True, valley=False),
    wildcard_constraints:
        case=names(case for case in STUDY.simulated if not STUDY.case(case).has_valley),


use rule case_figures as recorded_case_figures with:
    output:
        *case_figures(simulated=False, valley=True),
    wildcard_constraints:
        case=names(case for case in STUDY.recorded if STUDY.case(case).has_valley),


use rule case_figures as recorded_case_figures_without_valley with:
    output:
        *case_figures(simulated=False, valley=False),
    wildcard_constraints:
        case=names(case for case in STUDY.recorded if not STUDY.case(case).has_valley),


rule figures:
    input:
        identifications=of_cases("results/identifications/{case}.csv", STUDY.simulated),
        targets=of_cases("results/targets/{case}.csv", STUDY.simulated),
        expected=of_cases("results/identifiability/expected/{case}.json", STUDY.simulated),
        measurements=of_all_batches("results/measurements/{case}/{batch}.parquet", STUDY.simulated[:1]),
        calibrated=of_cases("results/calibrations/{case}.yaml", CALIBRATED),
        differences="results/linearisation.csv" if STUDY.gripped else [],
    output:
        [file for name in FIGURES for file in figure(name, name)],
    log:
        "results/logs/figures.log",
    params:
        **settings_of(*WHOLE),
        software=SOFTWARE,
    message:
        "Drawing the figures of the study"
    script:
        "../scripts/figures.py"
