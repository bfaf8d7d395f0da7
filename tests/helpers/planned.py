"""What Snakemake would run, and what it has written."""

import re
from collections.abc import Mapping
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import Any

import yaml

from tests.helpers.runs import TINY, Run, snakemake

_PLAIN = ("--workflow-profile", "none")
_JOBS = re.compile(r"^(\w+) +(\d+) *$", re.MULTILINE)


def dry_run(folder: Path, *arguments: str, config: dict[str, Any] | None = None) -> Run:
    """Ask Snakemake what it would run, by its plain logger."""
    # Other workers ask in the same folder.
    with NamedTemporaryFile("w", suffix=".yaml") as overlay:
        yaml.safe_dump(TINY if config is None else config, overlay)
        overlay.flush()
        run = snakemake(folder, "--dry-run", "--configfile", overlay.name, *_PLAIN, *arguments)
    assert run.status == 0, run.output
    return run


def jobs_of(run: Run) -> dict[str, int]:
    """Return the number of jobs of each rule, from the last table of jobs."""
    found = {rule: int(jobs) for rule, jobs in _JOBS.findall(run.output)}
    return {rule: jobs for rule, jobs in found.items() if rule not in ("all", "study", "total")}


def planned(folder: Path, *targets: str, config: dict[str, Any] | None = None) -> dict[str, int]:
    """Return the number of jobs of each rule that Snakemake would run."""
    return jobs_of(dry_run(folder, "--quiet", "rules", "--", *targets, config=config))


def results_of(folder: Path) -> dict[str, bytes]:
    """Return every result by name, but for logs and what tells times."""
    results = folder / "results"
    found = (path.relative_to(results) for path in sorted(results.rglob("*.*")))
    return {
        str(name): (results / name).read_bytes()
        for name in found
        if (results / name).is_file()
        and name.parts[0] not in ("logs", "timings")
        # The processor times of the page's study.
        and not name.name.startswith("timings.")
    }


def changed(base: Mapping[str, Any], over: Mapping[str, Any]) -> dict[str, Any]:
    """Return a config with some keys changed."""
    merged = dict(base)
    for key, value in over.items():
        inner = merged.get(key)
        if isinstance(inner, dict) and isinstance(value, dict):
            value = changed(inner, value)
        merged[key] = value
    return merged
