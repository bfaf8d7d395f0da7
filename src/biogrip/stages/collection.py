"""Stage 4: the batches of a case put together, a row per method and seed."""

import csv
from pathlib import Path
from typing import Any

import pyarrow.compute as pc
import pyarrow.parquet as pq

from biogrip.errors import BiogripError
from biogrip.files import written_whole
from biogrip.identify.records import columns
from biogrip.study import build


def run(
    settings: dict[str, Any],
    batches: list[Path],
    histories: list[Path],
    output: Path,
    history: Path,
) -> None:
    """Join batches in the order of their methods and seeds.

    Parameters
    ----------
    settings
        ``seeds``: how many seeds the study has; batches may hold more, left
        from a larger study. ``methods``: the methods in their order. ``model``,
        ``branches``: what the columns are.
    batches, histories
        Files of the identification stage, in the order of methods and seeds.
    output, history
        The same for the whole case.

    Raises
    ------
    BiogripError
        If a seed is missing or comes twice.
    """
    header = columns(build.sample_model(settings))
    rows = [row for batch in batches for row in _rows(batch, header)]
    rows = [row for row in rows if int(row[2]) < settings["seeds"]]
    seeds = range(settings["seeds"])
    wanted = [(method, seed) for method in settings["methods"] for seed in seeds]
    if [(row[1], int(row[2])) for row in rows] != wanted:
        names = ", ".join(str(batch) for batch in batches)
        raise BiogripError(
            f"{names}: do not hold each of the seeds 0 to {seeds[-1]} once for each of "
            f"{', '.join(settings['methods'])}. Delete them and run again."
        )
    with written_whole(output) as scratch, scratch.open("w", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(header)
        writer.writerows(rows)
    with written_whole(history) as scratch:
        schema = pq.read_schema(histories[0])
        with pq.ParquetWriter(scratch, schema) as joined:
            for batch in histories:
                table = pq.read_table(batch)
                joined.write_table(table.filter(pc.less(table["seed"], settings["seeds"])))


def _rows(batch: Path, wanted: tuple[str, ...]) -> list[list[str]]:
    try:
        with batch.open(newline="") as stream:
            header, *rows = csv.reader(stream)
    except (OSError, ValueError) as error:
        raise BiogripError(f"{batch}: cannot be read: {error}.") from error
    if tuple(header) != wanted:
        raise BiogripError(
            f"{batch}, line 1: found {', '.join(header)}; wanted {', '.join(wanted)}."
        )
    return rows
