"""How often verdicts are right, on simulated traces: a page of the documentation."""

from biogrip.stages.levels import INSTRUMENTS_JUDGED, READINGS


rule judged_cells:
    output:
        "results/levels/{instrument}_{readings}.csv",
    log:
        "results/logs/judged_cells/{instrument}_{readings}.log",
    wildcard_constraints:
        instrument="|".join(INSTRUMENTS_JUDGED),
        readings="|".join(map(str, READINGS)),
    resources:
        runtime=240,
    params:
        **settings_of(),
        traces=20,
    message:
        "Judging traces of {wildcards.instrument} with {wildcards.readings} readings"
    script:
        "../scripts/judged_cells.py"


rule levels:
    input:
        expand(rules.judged_cells.output, instrument=INSTRUMENTS_JUDGED, readings=READINGS),
    output:
        table="docs/levels.csv",
        page="docs/levels.md",
    log:
        "results/logs/levels.log",
    params:
        **settings_of(),
    message:
        "Counting verdicts"
    script:
        "../scripts/levels.py"
