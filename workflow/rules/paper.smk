"""What only the study of the paper has: verdicts on its claims."""


# By what this study has: only some configs have sweeps and interpretations.
rule claims:
    input:
        claims=workflow.source_path("../paper/claims.yaml"),
        caption=workflow.source_path("../report/tables/claims.rst"),
        identifications=files("results/identifications/{case}.csv", STUDY.published),
        histories=files("results/histories/{case}.npz", STUDY.published),
        tables=[file for file in made("tables", ".csv") if file != "results/tables/claims.csv"],
    output:
        *table("claims"),
    log:
        "results/logs/claims.log",
    params:
        **settings_of(*WHOLE),
    message:
        "Judging the claims of the paper"
    script:
        "../paper/claims.py"
