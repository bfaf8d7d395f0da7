"""What only the study of the paper has: its inputs, its gripper, evidence, interpretations, claims."""

from biogrip.physics.models import SINGLE_BRANCH

# Simulated cases whose model has the paper's parameters, and what is read of each.
OURS = {parameter.name for parameter in SINGLE_BRANCH}
GRIPPED = STUDY.of(STUDY.gripped)
INTERPRETED = [n for n in STUDY.simulated if set(STUDY.case(n).sample.model.names) <= OURS]


rule gripper_figures:
    output:
        comb=drawing("comb"),
        torque=drawing("torque"),
        linkage=drawing("linkage"),
    log:
        "results/logs/gripper_figures.log",
    benchmark:
        "results/benchmarks/gripper_figures.tsv"
    params:
        **settings_of(
            *("gripper", "actuator", "protocol"),
            *keys_of_cases(
                STUDY,
                *("gripper", *SAMPLE),
            ),
        ),
    message:
        "Drawing the gripper"
    script:
        "../paper/gripper.py"


rule inputs:
    output:
        tables=expand("results/tables/{name}.csv", name=INPUTS),
        pages=[page_of_table(name) for name in INPUTS],
    log:
        "results/logs/inputs.log",
    params:
        **settings_of("gripper", "actuator", "search_range", "reconstructed"),
    message:
        "Writing the paper's Tables 1 to 4"
    script:
        "../paper/inputs.py"


rule mechanics:
    output:
        contact="results/tables/contact.csv",
        left_out="results/tables/left_out.csv",
        pages=[page_of_table(name) for name in ("contact", "left_out")],
        gripped=(
            ["results/tables/mechanics.csv", "results/tables/contact_loss.csv"]
            + [page_of_table(name) for name in ("mechanics", "contact_loss")]
            if STUDY.gripped
            else []
        ),
    log:
        "results/logs/mechanics.log",
    benchmark:
        "results/benchmarks/mechanics.tsv"
    params:
        **settings_of(
            *"study_seed seeds actuator gripper protocol".split(),
            *keys_of_cases(GRIPPED, *FIT, "title", "models", *SAMPLING, NOISE, "least_squares"),
        ),
    message:
        "Computing what the gripper does to its samples, and what its model leaves out"
    script:
        "../paper/mechanics.py"


rule linearisation:
    output:
        differences="results/linearisation.csv",
        table="results/tables/linearisation.csv",
        page=page_of_table("linearisation"),
        figure=drawing("linearisation"),
    log:
        "results/logs/linearisation.log",
    benchmark:
        "results/benchmarks/linearisation.tsv"
    params:
        **settings_of("actuator", *keys_of_cases(GRIPPED, "gripper", "title", *SAMPLE)),
    message:
        "Comparing the linear model with the nonlinear one"
    script:
        "../paper/linearisation.py"


# Of the cases whose axis the paper shows, the traces.
rule evidence:
    input:
        identifications=files("results/identifications/{case}.csv", STUDY.published),
        measurements=files(
            "results/measurements/{case}/{batch}.npz",
            [name for name in STUDY.published if STUDY.case(name).published.axis_rad],
        ),
    output:
        evidence="results/tables/evidence.csv",
        printed_values="results/tables/printed_values.csv",
        sampling_evidence="results/tables/sampling_evidence.csv",
        pages=[page_of_table(name) for name in EVIDENCE],
    log:
        "results/logs/evidence.log",
    benchmark:
        "results/benchmarks/evidence.tsv"
    params:
        **settings_of(
            *"methods seeds evaluation actuator gripper search_range".split(),
            *keys_of_cases(STUDY, *FIT, "title", "published", "models", *SAMPLING, NOISE),
        ),
    message:
        "Holding the paper's numbers against each other"
    script:
        "../paper/evidence.py"


rule interpretations_of_case:
    input:
        target="results/targets/{case}.csv",
    output:
        rows="results/interpretations/{case}.csv",
    log:
        "results/logs/interpretations_of_case/{case}.log",
    benchmark:
        "results/benchmarks/interpretations_of_case/{case}.tsv"
    resources:
        runtime=120,
    params:
        **settings_of(
            # Of the case all, for an interpretation may change any.
            *("study_seed", "seeds", "actuator", "interpretations", *CASE_KEYS),
        ),
    message:
        "Identifying {wildcards.case} under every interpretation of the paper"
    script:
        "../scripts/interpretations_of_case.py"


rule interpretations:
    input:
        found=files("results/interpretations/{case}.csv", INTERPRETED),
    output:
        apart="results/tables/interpretations.csv",
        apart_page=page_of_table("interpretations"),
        jointly="results/tables/interpretations_jointly.csv",
        jointly_page=page_of_table("interpretations_jointly"),
    log:
        "results/logs/interpretations.log",
    params:
        **settings_of(
            *("interpretations", "seeds", "evaluation"),
            *keys_of_cases(STUDY, "published", *SAMPLE),
        ),
    message:
        "Comparing the interpretations of the paper"
    script:
        "../paper/interpretations.py"


# By what this study has: only some configs have sweeps and interpretations.
rule claims:
    input:
        claims=workflow.source_path("../paper/claims.yaml"),
        caption=workflow.source_path("../report/tables/claims.rst"),
        identifications=files("results/identifications/{case}.csv", STUDY.published),
        histories=files("results/histories/{case}.npz", STUDY.published),
        tables=[file for file in made("tables", ".csv") if not file.endswith("/claims.csv")],
    output:
        table="results/tables/claims.csv",
        page=page_of_table("claims"),
    log:
        "results/logs/claims.log",
    benchmark:
        "results/benchmarks/claims.tsv"
    params:
        **settings_of(
            *"study_seed methods seeds evaluation actuator gripper".split(),
            *keys_of_cases(STUDY, "title", "published", "gripper", "calibration", *SAMPLE, NOISE),
        ),
    message:
        "Judging the claims of the paper"
    script:
        "../paper/claims.py"
