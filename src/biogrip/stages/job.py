"""What a script of the workflow does around its work: it reads its params, and says what failed."""

import traceback
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr
from pathlib import Path
from typing import Any

from biogrip.errors import BiogripError
from biogrip.stages.batches import seeds_of
from biogrip.stages.settings import case_of, study_of
from biogrip.study.study import Case, Study


@contextmanager
def logged(job: Any) -> Iterator[None]:
    """Write what is said to the job's log; an error of ours ends it with its message alone."""
    log = Path(job.log[0])
    with log.open("w", encoding="utf-8") as stream, redirect_stderr(stream):
        try:
            yield
        except BiogripError as error:
            print(f"biogrip: {error}", file=stream)
            raise SystemExit(1) from error
        except Exception:
            traceback.print_exc(file=stream)
            raise


def job_case(job: Any) -> Case:
    """Return the case of a job, with the keys of the config that its rule names."""
    return case_of(job.wildcards.case, job_settings(job))


def job_study(job: Any) -> Study:
    """Return the study of a job, with the keys of the config that its rule names."""
    return study_of(job_settings(job))


def job_seeds(job: Any) -> list[int]:
    """Return the seeds of a job's batch."""
    return list(seeds_of(job.wildcards.batch))


def paths(files: Any) -> list[Path]:
    """Return files of Snakemake as paths; one file is a list of one."""
    return [Path(files)] if isinstance(files, str) else [Path(file) for file in files]


def job_settings(job: Any) -> dict[str, Any]:
    """Return the keys of the config that a job's rule names, as plain values."""
    given = {key: value for param in job.params for key, value in param.items()}
    del given["software"]
    return given
