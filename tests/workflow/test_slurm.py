import importlib.util
import os
import re
import shlex
import shutil
import subprocess
import sys
import textwrap
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

from biogrip.cli import main
from tests.helpers.identified import FEW, write_drop
from tests.helpers.mixed_table import write_mixed
from tests.helpers.places import ROOT
from tests.helpers.required import cannot_run
from tests.helpers.runs import ONE_CASE, clone, ran, snakemake
from tests.helpers.slurm.cluster import missing_packages, one_node_slurm

pytestmark = pytest.mark.nightly

PLUGIN = "snakemake_executor_plugin_slurm"
REQUIRED = "BIOGRIP_REQUIRE_SLURM"
# Of the site, not of the study: no accounting to ask, and nobody else who would mind the asking.
SITE = ("--slurm-status-command", "squeue", "--slurm-init-seconds-before-status-checks", "1")
PROFILE = ("--profile", ROOT / "profiles" / "slurm", *SITE)


@pytest.fixture
def slurm(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, str]]:
    """Environment in which Snakemake reaches a Slurm; skips where there can be none."""
    if packages := missing_packages():
        cannot_run(REQUIRED, f"Slurm is not installed: apt-get install {' '.join(packages)}")
    plugin = _installed_plugin(tmp_path_factory.mktemp("plugin"))
    with ExitStack() as cluster:
        try:
            environment = cluster.enter_context(one_node_slurm())
        except TimeoutError as error:
            cannot_run(REQUIRED, f"Slurm does not start: {error}")
        yield {**environment, "PYTHONPATH": plugin}


def _installed_plugin(folder: Path) -> str:
    """Python path with Snakemake's executor for Slurm, as locked, beside this environment."""
    path = os.environ.get("PYTHONPATH", "")
    if importlib.util.find_spec(PLUGIN):
        return path
    install = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--require-hashes"]
    install += ["--target", str(folder), "-r", str(ROOT / "requirements-slurm.lock")]
    done = subprocess.run(install, capture_output=True, text=True)
    if done.returncode:
        cannot_run(REQUIRED, f"requirements-slurm.lock cannot be installed: {done.stderr.strip()}")
    return os.pathsep.join([str(folder), *filter(None, [path])])


# A Slurm job costs seconds whatever it does: one method, and no more judging than needed.
TRACES = {"table": "cells.tsv", "config": "few.yaml", "model": "liquid_drop", "rows_a_batch": 1}
FEW_JOBS: dict[str, Any] = ONE_CASE | {"seeds": 4, "traces": TRACES}
CELLS = "file\tmeasurement.noise_rad\nfirst.csv\t\nsecond.csv\t1e-6\n"
# Of a case, whose jobs are submitted in groups, and one that is submitted alone.
WANTED = ["errors_liquid_drop_2", "verdicts_liquid_drop_2", "contact_loss", "traces"]
TABLES = [f"results/tables/{name}.csv" for name in WANTED]


def test_slurm_gives_the_same_bytes(
    tmp_path: Path, slurm: dict[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    here, there = tmp_path / "here", tmp_path / "there"
    for folder in (here, there):
        folder.mkdir()
        (folder / "cells.tsv").write_text(CELLS)
        (folder / "few.yaml").write_text(FEW)
        for seed, name in enumerate(("first", "second")):
            write_drop(folder / f"{name}.csv", seed)
    snakemake(here, "--", *TABLES, config=FEW_JOBS)
    for name, value in slurm.items():
        monkeypatch.setenv(name, value)
    profile = (*PROFILE, "--config", "batch_size=2")
    with ThreadPoolExecutor() as pool:
        running = pool.submit(snakemake, there, *profile, "--", *TABLES, config=FEW_JOBS)
        while not running.done() and not _cancel_a_batch(slurm):
            time.sleep(0.2)
        run = running.result()
    for table in TABLES:
        assert (there / table).read_bytes() == (here / table).read_bytes()
    # Slurm's executor says so where a rule has no resources.
    for missing in ("No wall time information", "No job memory information"):
        assert missing not in run


TABLE = "results/tables/traces.csv"
BLOCK = re.compile(r"^ *```(\w+)(?: title=\"([^\"]+)\")?\n(.*?)^ *```$", re.DOTALL | re.MULTILINE)


def test_the_page_on_clusters_gives_one_table_thrice(
    tmp_path: Path, slurm: dict[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its files written and its commands typed as they stand, but for what a site needs."""
    for name, value in slurm.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path / "src"), prepend=os.pathsep)
    clone(tmp_path)
    for name in ("profiles", "data"):
        shutil.copytree(ROOT / name, tmp_path / name)
    tables = []
    for language, title, content in BLOCK.findall((ROOT / "docs" / "cluster.md").read_text()):
        if title:
            (tmp_path / title).write_text(textwrap.dedent(content))
        for line in content.splitlines() if language == "sh" and "traces.csv" in content else ():
            typed = shlex.split(line.replace(".venv/bin/", ""))
            more = SITE if "--profile" in typed else ()
            at = typed.index("--") if "--" in typed else len(typed)
            ran(tmp_path, *typed[:at], *more, *typed[at:])
            tables.append((tmp_path / (TABLE if "--" in typed else "found.csv")).read_bytes())
            shutil.rmtree(tmp_path / "results", ignore_errors=True)
    assert len(tables) == 3
    assert tables[0].count(b"\n") == 4
    assert tables == 3 * tables[:1]


def test_slurm_gives_the_table_of_many_instruments(
    tmp_path: Path, slurm: dict[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of two actuators and arms, and of samples of a creep, a relaxation and a sweep each."""
    assert write_mixed(tmp_path, gripped=48, samples=4) == 60
    for name, value in slurm.items():
        monkeypatch.setenv(name, value)
    traces = TRACES | {"config": "lab.yaml", "model": "maxwell", "rows_a_batch": 13}
    snakemake(tmp_path, *PROFILE, "--", TABLE, config={"traces": traces})
    monkeypatch.chdir(tmp_path)
    typed = ("--config", "lab.yaml", "--model", "maxwell", "--csv", "found.csv")
    assert main(["identify", "cells.tsv", *typed]) == 0
    assert (tmp_path / TABLE).read_bytes() == (tmp_path / "found.csv").read_bytes()


def _cancel_a_batch(slurm: dict[str, str]) -> bool:
    queue = ["squeue", "--noheader", "--states=RUNNING", "--format=%i %k"]
    for line in subprocess.check_output(queue, env=slurm, text=True).splitlines():
        number, comment = line.split(maxsplit=1)
        if comment.startswith("rule_batch"):
            subprocess.run(["scancel", number], env=slurm, check=True)
            return True
    return False
