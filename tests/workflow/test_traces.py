"""A table of traces in a study: batches of its rows, and all in one table."""

from pathlib import Path

import pytest

from tests.helpers.drops import write_trace
from tests.helpers.runs import TINY, biogrip, called, replaced, snakemake

TABLE = "results/tables/traces.csv"
BLOCK = "traces: {table: cells.tsv, config: lab.yaml, model: liquid_drop, rows_a_batch: 10}\n"
LAB = """measurement: {noise_rad: 1.0e-6}
least_squares: {candidates: 50, starts: 2}
model_selection: {models: []}
"""


@pytest.fixture
def lab(tmp_path: Path) -> Path:
    """Thirty traces, of which one is not there, and one cannot be read."""
    rows = ["file\tdish\tfixed.c"]
    for number in range(30):
        if number != 7:
            write_trace(tmp_path / f"{number}.csv", number)
        rows.append(f"{number}.csv\t{'AB'[number % 2]}\t{'300' if number == 25 else ''}")
    (tmp_path / "4.csv").write_text("time_s,rotation_rad\n0,1e-6\nten,2e-6\n")
    (tmp_path / "cells.tsv").write_text("\n".join(rows) + "\n")
    (tmp_path / "lab.yaml").write_text(LAB)
    return tmp_path


def identified(folder: Path) -> bytes:
    """The table that the command writes of all traces."""
    options = ("--config", "lab.yaml", "--model", "liquid_drop", "--csv", "found.csv")
    assert biogrip(folder, "identify", "cells.tsv", *options).returncode == 1
    return (folder / "found.csv").read_bytes()


@pytest.mark.nightly
def test_batches_give_the_table_of_the_command(lab: Path) -> None:
    """To the byte; what is changed, and only that, is identified again."""
    run = snakemake(lab, TABLE, config=BLOCK)
    assert run.status == 0, run.output
    assert run.all_jobs() == {"traces_batch": 3, "traces": 1}
    assert (lab / TABLE).read_bytes() == identified(lab)
    folder = lab / "results" / "traces"
    assert [file.name for file in sorted(folder.rglob("*.*"))] == [
        "0-9.csv",
        "10-19.csv",
        "20-29.csv",
    ]

    def jobs() -> dict[str, int]:
        return snakemake(lab, TABLE, "-n", config=BLOCK).all_jobs()

    assert jobs() == {}
    # A row more is in a batch of its own, a word or a trace in that of its row.
    table = (lab / "cells.tsv").read_text()
    (lab / "cells.tsv").write_text(f"{table}0_again.csv\tC\t\n")
    write_trace(lab / "0_again.csv", 0)
    assert jobs() == {"traces_batch": 1, "traces": 1}
    (lab / "cells.tsv").write_text(replaced(table, "3.csv\tB\t\n4", "3.csv\tC\t\n4"))
    assert jobs() == {"traces_batch": 1, "traces": 1}
    write_trace(lab / "12.csv", 99)
    assert jobs() == {"traces_batch": 2, "traces": 1}
    run = snakemake(lab, TABLE, config=BLOCK)
    assert run.status == 0, run.output
    assert (lab / TABLE).read_bytes() == identified(lab)
    assert jobs() == {}
    # A trace that was not there, and the config of all.
    write_trace(lab / "7.csv", 7)
    assert jobs() == {"traces_batch": 1, "traces": 1}
    (lab / "lab.yaml").write_text(LAB.replace("1.0e-6", "2.0e-6"))
    assert jobs() == {"traces_batch": 3, "traces": 1}


def test_a_run_makes_the_table_beside_its_cases(tiny_copy: Path) -> None:
    write_trace(tiny_copy / "a.csv", 1)
    (tiny_copy / "cells.tsv").write_text("file\na.csv\n")
    block = replaced(replaced(BLOCK, "config: lab.yaml, ", ""), "10", "100")
    run = snakemake(tiny_copy, config=TINY + block)
    assert run.status == 0, run.output
    assert (run.jobs("traces_batch"), run.jobs("traces"), run.jobs("identification")) == (1, 1, 0)
    assert (tiny_copy / TABLE).read_text().startswith("trace,fit,")
    assert called(tiny_copy, "verify").status == 0
    assert "Nothing to be done" in snakemake(tiny_copy, "-n", config=TINY + block).output


def test_a_table_that_cannot_be_used_stops_with_line_and_column(lab: Path) -> None:
    table = lab / "cells.tsv"
    text = table.read_text()
    for old, new, said in (
        ("fixed.c\n", "fixed.x\n", "line 1, column 'fixed.x': is no key that a row may set."),
        ("3.csv\tB\t\n", "3.csv\tB\tmuch\n", "line 5, column 'fixed.c': found 'much', allowed"),
        ("3.csv\tB", "{3}.csv\tB", "line 5, column 'file': found '{3}.csv', allowed is a name"),
    ):
        table.write_text(text.replace(old, new, 1))
        run = snakemake(lab, TABLE, "-n", config=BLOCK)
        assert run.status != 0
        assert f"biogrip: cells.tsv, {said}" in run.output
        assert "Traceback" not in run.output
    table.unlink()
    run = snakemake(lab, TABLE, "-n", config=BLOCK)
    assert "biogrip: cells.tsv: cannot be read as a table: " in run.output
