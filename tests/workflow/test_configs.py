import re
from pathlib import Path

import pytest
import yaml

from tests.helpers.places import ROOT
from tests.helpers.runs import TINY, called, clone, jobs_of, snakemake

CASES = {
    "crept": {
        "instrument": "creep",
        "sample": {"model": "zener_maxwell", "k": 300.0, "k_p": 200.0, "c": 900.0},
        "protocol": {"phases": [{"duration_s": 30, "stress_Pa": 40}]},
    },
    "sized_in_volts": {
        "sample": {"model": "liquid_drop", "k": 1.0, "k_p": 0.1, "c": 10.0, "size_m": 60e-6},
        "protocol": {"phases": [{"duration_s": 50, "voltage_V": 12}]},
        "assumed_gripper": "calibrated",
    },
}
CONFIG = TINY | {"seeds": 1, "only": list(CASES), "cases": CASES}


@pytest.mark.nightly
def test_a_study_writes_in_its_folder_alone(tmp_path: Path) -> None:
    """Of every kind of case: overlays that are published identify such samples, nightly."""
    mine, here = tmp_path / "mine", tmp_path / "here"
    here.mkdir()
    (here / "my.yaml").write_text(yaml.safe_dump(CONFIG))
    given = ("-s", ROOT / "Snakefile", "-j1", "--configfile", "my.yaml", "--directory", mine)
    made = ["measurements/crept/seeds_0-0.npz", "calibrations/sized_in_volts.yaml"]
    made += ["targets/sized_in_volts.csv"]
    called(here, *given, "--", *(f"results/{file}" for file in made))
    assert [file.name for file in here.iterdir()] == ["my.yaml"]


def test_a_wrong_config_stops_with_one_message(tmp_path: Path) -> None:
    wrong = {"seedz": 3, "methods": ["gentic"]}
    run = snakemake(tmp_path, "-n", "--config", "onyl=x", "seeds=0", config=wrong, status=1)
    for said in (
        "overlay.yaml, line 3: seedz: unknown key. Did you mean 'seeds'?",
        "overlay.yaml, line 2: methods[0]: found 'gentic'. Did you mean 'genetic'?",
        "command line, --config: onyl: unknown key. Did you mean 'only'?",
        "command line, --config: seeds: found 0, allowed is",
    ):
        assert said in run
    assert "Traceback" not in run
    assert len(run.splitlines()) < 16


@pytest.mark.nightly
def test_another_clone_is_not_run_with_the_code_and_config_of_this_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its config has 7 seeds; a link to it is the same clone."""
    snakefile = clone(tmp_path / "second")
    file = tmp_path / "second" / "config" / "config.yaml"
    text, seeds = re.subn(r"(?m)^seeds: \d+", "seeds: 7", file.read_text())
    assert seeds == 1
    file.write_text(text)
    (tmp_path / "linked").symlink_to("second")
    refused = snakemake(tmp_path, "-n", snakefile=snakefile, status=1)
    assert f"The rules are those of {tmp_path / 'second'}, but the code" in refused
    assert f"{ROOT / 'src' / 'biogrip_study'}, from which biogrip is installed" in refused
    monkeypatch.setenv("PYTHONPATH", str(tmp_path / "linked" / "src"))
    planned = snakemake(tmp_path, "-n", snakefile=snakefile)
    assert {*re.findall(r"measurements/\w+/(\w+-\d+)", planned)} == {"seeds_0-6"}


def test_what_changes_no_result_is_no_other_study(tmp_path: Path) -> None:
    keys = "batch_size=9", "pdf=true"
    asked = "check", "results/figures/comb.pdf"
    run = snakemake(tmp_path, "-n", "--quiet", "rules", "--config", *keys, "--", *asked)
    assert jobs_of(run)["errors"] == jobs_of(run)["claims"] == jobs_of(run)["check"] == 1


def test_what_has_no_name_has_nothing_published(tmp_path: Path) -> None:
    snakemake(tmp_path, "-k", "--config", "seeds=2", "--", "check", "publish", status=1)
    for name, said in (("check", "no tables to compare"), ("publish", "nothing in whose place")):
        log = (tmp_path / "results" / "logs" / f"{name}.log").read_text()
        assert "published/unnamed" in log
        assert said in log
