"""What only the study of the paper has: its inputs, its gripper, evidence, readings, claims."""

from biogrip.physics.models import SINGLE_BRANCH

# Simulated cases whose model has the paper's parameters, and what is read of each.
OURS = {parameter.name for parameter in SINGLE_BRANCH}
GRIPPED = STUDY.of(STUDY.gripped)
OF_GRIPPED = ["mechanics", "contact_loss"] if STUDY.gripped else []
READ = [n for n in STUDY.published if set(STUDY.case(n).sample.model.names) <= OURS]
READINGS = [
    f"results/readings/{case}/{reading}.csv"
    for case in READ
    for reading in STUDY.config.readings
    if STUDY.shown_method.name == "genetic"
]


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
            *("gripper", "actuator", "protocol"), *keys_of_cases(STUDY, "gripper", *SAMPLE)
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
        gripped=expand("results/tables/{name}.csv", name=OF_GRIPPED),
        pages=[page_of_table(name) for name in ("contact", "left_out", *OF_GRIPPED)],
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
            *keys_of_cases(STUDY, *FIT, "title", "published"),
            *keys_of_cases(STUDY, "contact", "models", *SAMPLING, NOISE),
        ),
    message:
        "Holding the paper's numbers against each other"
    script:
        "../paper/evidence.py"


rule readings_of_case:
    input:
        target="results/targets/{case}.csv",
    output:
        rows="results/readings/{case}/{reading}.csv",
    log:
        "results/logs/readings_of_case/{case}/{reading}.log",
    benchmark:
        "results/benchmarks/readings_of_case/{case}/{reading}.tsv"
    resources:
        runtime=120,
    params:
        # Of the case all, for a reading may change any.
        **settings_of("study_seed", "seeds", "actuator", *CASE_KEYS),
        reading=lambda wildcards: {
            "readings": {wildcards.reading: STUDY.plain["readings"][wildcards.reading]}
        },
    message:
        "Identifying {wildcards.case} under the reading {wildcards.reading}"
    script:
        "../paper/readings_of_case.py"


rule readings:
    input:
        found=READINGS,
    output:
        readings="results/tables/readings.csv",
        found="results/tables/readings_found.csv",
        pages=[page_of_table(name) for name in ("readings", "readings_found")],
        figure=drawing("referee"),
    log:
        "results/logs/readings.log",
    params:
        **settings_of("readings", "seeds", "evaluation", *keys_of_cases(STUDY, *CASE_KEYS)),
    message:
        "Comparing the readings of the paper"
    script:
        "../paper/readings.py"


rule protocols:
    input:
        identifications=files(
            f"results/identifications/{{case}}/{STUDY.shown_method.name}/{{batch}}.csv",
            [*STUDY.published, *OTHERS],
        ),
    output:
        table="results/tables/protocols.csv",
        page=page_of_table("protocols"),
        figure=drawing("protocols"),
    log:
        "results/logs/protocols.log",
    params:
        **settings_of(
            *"methods actuator".split(),
            *keys_of_cases(STUDY, *FIT, "title", "published"),
            *keys_of_cases(STUDY, "contact", "models", *SAMPLING, NOISE),
        ),
    message:
        "Comparing the paper's protocol with others"
    script:
        "../paper/protocols.py"


# By what this study has: only some configs have sweeps and readings.
rule claims:
    input:
        claims=workflow.source_path("../paper/claims.yaml"),
        caption=workflow.source_path("../report/tables/claims.rst"),
        identifications=files("results/identifications/{case}.csv", STUDY.published),
        histories=files("results/histories/{case}.npz", STUDY.published),
        readings=READINGS,
        tables=[
            file
            for file in made("tables", ".csv")
            if Path(file).stem not in ("claims", "tables_5_to_7")
        ],
    output:
        table="results/tables/claims.csv",
        compared="results/tables/tables_5_to_7.csv",
        pages=[page_of_table(name) for name in ("claims", "tables_5_to_7")],
    log:
        "results/logs/claims.log",
    benchmark:
        "results/benchmarks/claims.tsv"
    params:
        **settings_of(
            *"study_seed methods seeds evaluation actuator gripper readings".split(),
            *keys_of_cases(STUDY, *FIT, "title", "published", "calibration"),
            *keys_of_cases(STUDY, "contact", "models", *SAMPLING, NOISE),
        ),
    message:
        "Judging the claims of the paper"
    script:
        "../paper/claims.py"
