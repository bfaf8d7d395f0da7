import os
import shutil
import sys
from pathlib import Path

import pytest
import yaml

from tests.helpers.places import ROOT
from tests.helpers.runs import ONE_CASE, called, ran

CONFIG = ONE_CASE | {"seeds": 1}
ERRORS = "results/tables/errors_liquid_drop_2.csv"
MODULE = f"""
module biogrip:
    snakefile: {str(ROOT / "workflow" / "Snakefile")!r}
"""


def host(folder: Path, text: str, *arguments: str) -> str:
    (folder / "Snakefile").write_text(text)
    return called(folder, "-j2", "--workflow-profile", "none", *arguments)


@pytest.mark.nightly
def test_rules_are_changed_under_a_prefix_and_the_host_is_as_it_was(tmp_path: Path) -> None:
    (tmp_path / "host.yaml").write_text("samples: {1: a, 2: b}\n")
    text = f"""
configfile: "host.yaml"
config["lab"] = {{"seeds": 1}}
BEFORE = dict(config)
{MODULE}
    config: {CONFIG!r}
    prefix: "sub"

use rule * from biogrip as biogrip_*

use rule measurement from biogrip as biogrip_measurement with:
    resources: mem_mb=4321
    message: "Measuring with {{resources.mem_mb}} MB"
    output: measurements="elsewhere/{{case}}/{{batch}}.npz"

assert config == BEFORE

rule mine:
    output: "mine.txt"
    shell: "command -v python > {{output}}"
"""
    run = host(tmp_path, text, "--", "elsewhere/liquid_drop_2/seeds_0-0.npz", "mine.txt")
    assert "Measuring with 4321 MB" in run
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        *(".snakemake", "Snakefile", "elsewhere", "host.yaml", "mine.txt", "sub")
    ]
    assert (tmp_path / "sub/results/targets/liquid_drop_2.csv").is_file()
    assert (tmp_path / "mine.txt").read_text().strip() == shutil.which(
        "python", path=f"{Path(sys.executable).parent}:{os.environ['PATH']}"
    )


@pytest.mark.nightly
def test_it_is_deployed_from_a_clone_and_runs_a_case(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("snakedeploy")
    clone, place = tmp_path / "clone", tmp_path / "place"
    ran(tmp_path, "git", "clone", "-q", ROOT, clone)
    branch = ran(clone, "git", "branch", "--show-current").strip()
    ran(tmp_path, "snakedeploy", "deploy-workflow", clone, place, "--branch", branch)
    (place / "config" / "config.yaml").write_text(yaml.safe_dump(CONFIG))
    # Of a clone it names the Snakefile without the folder; of a server it names the server, too.
    text = (place / "workflow" / "Snakefile").read_text()
    assert '"workflow/Snakefile"' in text
    text = text.replace('"workflow/Snakefile"', f'"{clone}/workflow/Snakefile"')
    monkeypatch.setenv("PYTHONPATH", str(clone / "src"))
    for arguments in (("-n",), ("--", ERRORS)):
        host(place, text, *arguments)
    assert (place / ERRORS).is_file()
