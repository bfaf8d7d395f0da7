"""What only some configs have: sweeps, and tables of recorded traces."""


def points(sweep):
    """The names of the points of a sweep, cases of their own which the study identifies."""
    block = STUDY.config.sweeps[sweep]
    return [point.name for case in block.cases for point in block.points(sweep, case)]


rule sweep:
    input:
        identifications=lambda wildcards: files(
            "results/identifications/{case}/{method}/{batch}.csv", points(wildcards.sweep)
        ),
        calibrated=lambda wildcards: files(
            "results/calibrations/{case}.yaml",
            [name for name in points(wildcards.sweep) if name in CALIBRATED],
        ),
    output:
        table="results/tables/robustness_{sweep}.csv",
        page=page_of_table("robustness", "{sweep}"),
    log:
        "results/logs/sweep/{sweep}.log",
    benchmark:
        "results/benchmarks/sweep/{sweep}.tsv"
    params:
        **settings_of(
            *"sweeps methods evaluation reconstructed actuator".split(),
            # All, for points are cases with some keys changed.
            *keys_of_cases(STUDY, *CASE_KEYS),
        ),
        stages=["biogrip_study.tables.sweeps.robustness"],
    message:
        "Judging the sweep {wildcards.sweep}"
    script:
        "../scripts/stage.py"


if STUDY.config.traces:
    # Imported here, for it loads much that a study without a table needs not.
    from biogrip.command.options import Setting
    from biogrip.command.settings import check_settings
    from biogrip.command.sheet import by_sample, read_table
    from biogrip.config.loading import trace_defaults

    MODEL = Setting("traces.model", ("sample", "model"), STUDY.config.traces.model)
    CONFIG = Path(STUDY.config.traces.config) if STUDY.config.traces.config else None
    TRACES = usable(read_table, Path(STUDY.config.traces.table), CONFIG, [MODEL])
    ROWS = [*by_sample(TRACES)]
    THERE = [row for row in ROWS if all(trace.trace.is_file() for trace in row.traces)]
    usable(check_settings, THERE)

    def rows_of(wildcards):
        """The samples of the table that a batch has, of a trace or several each."""
        first, last = map(int, wildcards.rows.split("-"))
        return ROWS[first : last + 1]

    # Batches have fixed rows, so that more rows redo the last at most.
    rule traces_batch:
        input:
            lambda wildcards: [
                str(trace.trace)
                for row in rows_of(wildcards)
                for trace in row.traces
                if trace.trace.is_file()
            ],
            config=STUDY.config.traces.config or [],
            default=str(trace_defaults()),
            table=ancient(STUDY.config.traces.table),
        output:
            found="results/traces/batches/{rows}.csv",
        log:
            "results/logs/traces_batch/{rows}.log",
        benchmark:
            "results/benchmarks/traces_batch/{rows}.tsv"
        wildcard_constraints:
            rows=r"\d+-\d+",
        resources:
            runtime=120,
        params:
            **settings_of(),
            model=STUDY.config.traces.model,
            configs=[digest_of(file) for file in (CONFIG, trace_defaults()) if file],
            rows=lambda wildcards: [
                [
                    *(str(trace.trace), digest_of(trace.trace)),
                    *([[s.path, s.value] for s in trace.settings], trace.copied),
                ]
                for row in rows_of(wildcards)
                for trace in row.traces
            ],
        message:
            "Identifying the traces in rows {wildcards.rows} of {input.table}"
        script:
            "../scripts/traces_batch.py"

    rule traces:
        input:
            parts=[
                f"results/traces/batches/{first}-{first + STUDY.config.traces.rows_a_batch - 1}.csv"
                for first in range(0, len(ROWS), STUDY.config.traces.rows_a_batch)
            ],
        output:
            table="results/tables/traces.csv",
        log:
            "results/logs/traces.log",
        params:
            rows=len(ROWS),
            stages=["biogrip.command.outputs.join_tables"],
        message:
            "Putting together the tables of all traces"
        script:
            "../scripts/stage.py"
