"""The table of recorded traces that the config names: its rows in batches, and all in one table.

    traces: {table: cells.tsv, config: my_gripper.yaml, model: liquid_drop}

Batches have fixed rows, so that more rows redo the last at most.
"""

from biogrip.identify.many_traces import join_tables
from biogrip.identify.table_of_traces import read_table
from biogrip.products.source_files import fingerprint

TRACES = STUDY.traces

if TRACES is not None:
    with message_only():
        TABLE = read_table(Path(TRACES.table), for_workflow=True)
    ALL_FILES.append("results/tables/traces.csv")


if TRACES is not None:

    # A trace that is not there or cannot be used is a row that says so.
    rule traces_batch:
        input:
            lambda wildcards: [
                row.file for row in rows_of(wildcards) if row.file.is_file()
            ],
            config=TRACES.config or [],
            table=ancient(TRACES.table),
        output:
            "results/traces/batches/{rows}.csv",
        log:
            "results/logs/traces_batch/{rows}.log",
        wildcard_constraints:
            rows=r"\d+-\d+",
        resources:
            runtime=lambda _, attempt: 120 * attempt,
            mem_mb=lambda _, attempt: 1000 * attempt,
        params:
            model=TRACES.model,
            config=f"--config {shlex.quote(TRACES.config)}" if TRACES.config else "",
            rows=lambda wildcards: [
                [str(row.file), row.settings, row.copied] for row in rows_of(wildcards)
            ],
            code=fingerprint("biogrip.identify.identify"),
        message:
            "Identifying the traces in rows {wildcards.rows} of {input.table}"
        shell:
            "biogrip identify {input.table:q} --rows {wildcards.rows} --model {params.model} "
            "{params.config} --csv {output:q} > {log:q} 2>&1 || test -e {output:q}"

    rule traces:
        input:
            batches_of_traces,
        output:
            "results/tables/traces.csv",
        log:
            "results/logs/traces.log",
        localrule: True
        resources:
            runtime=lambda _, attempt: 5 * attempt,
            mem_mb=lambda _, attempt: 1000 * attempt,
        message:
            "Putting together the tables of all traces"
        run:
            join_tables([Path(file) for file in input], Path(output[0]))
