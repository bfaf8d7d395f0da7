"""Put together the identifications of a case, and write its tables."""

from pathlib import Path

from biogrip.stages.identification import join
from biogrip.stages.job import job_case, logged, paths
from biogrip.tables.cases import errors_of_case, verdicts
from biogrip.tables.layout import write

with logged(snakemake):
    case, files, made = job_case(snakemake), snakemake.input, snakemake.output
    identifications = Path(made.identifications)
    join(
        case,
        *map(paths, (files.batches, files.histories, files.measurements, files.calibrated)),
        identifications,
        Path(made.history),
    )
    write(errors_of_case(case, identifications), Path(made.errors))
    judged = verdicts(case, Path(files.verdicts), paths(files.expected))
    write(judged, Path(made.verdicts))
