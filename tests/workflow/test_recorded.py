"""Recorded traces through the whole workflow."""

import json
from pathlib import Path

import pandas as pd
import pytest

from biogrip.errors import BiogripError
from biogrip.study.load import load_study
from biogrip.study.source import overlaid, read_config
from tests.helpers.pictures import assert_drawn
from tests.helpers.places import CONFIG, EXAMPLE, ROOT
from tests.helpers.runs import RECORDED, replaced, snakemake


def test_a_recorded_trace_gets_what_a_simulated_one_gets(recorded: Path) -> None:
    results = recorded / "results"
    errors = pd.read_csv(results / "tables" / "errors_my_trace.csv")
    assert errors["parameter"].tolist() == ["k", "k_p", "c", "c_p", "c + c_p"]
    assert errors["target"].isna().all()
    assert errors["typical_error_percent"].isna().all()
    verdicts = pd.read_csv(results / "tables" / "verdicts_my_trace.csv")
    assert verdicts["verdict"].tolist()[:2] == ["determined", "determined"]
    for figure in ("fit", "profiles", "valley", "convergence", "evolution"):
        assert_drawn(results / "figures" / f"{figure}_my_trace.png")
    found = json.loads((results / "identifiability" / "my_trace.json").read_text())
    page = (results / "summaries" / "my_trace.html").read_text()
    assert len(found["quantities"]) == 5
    for item in found["quantities"]:
        assert item["in_words"] in page
    assert page.count("data:image/png;base64,") == 3
    identified = pd.read_csv(results / "identifications" / "my_trace.csv")
    assert len(identified) == 1
    assert identified["noise_rms"].isna().all()
    k = next(item for item in found["quantities"] if item["quantity"] == "k")
    assert k["low"] < identified["k_N_per_m"][0] < k["high"]


def test_the_example_is_what_its_truth_makes(tmp_path: Path) -> None:
    config = (ROOT / "data" / "example_truth.yaml").read_text()
    trace = "results/traces/example/seed_0.csv"
    run = snakemake(tmp_path, trace, config=config)
    assert run.status == 0, run.output
    assert (tmp_path / trace).read_bytes() == EXAMPLE.read_bytes()


def test_a_bad_recording_stops_with_its_place(tmp_path: Path) -> None:
    bad = tmp_path / "bad.csv"
    bad.write_text("time_s,rotation_rad\n" + "".join(f"{t},{1e-3 * t}\n" for t in range(401)))
    config = replaced(RECORDED, "mine.csv", str(bad))
    run = snakemake(tmp_path, "--dry-run", config=config)
    assert run.status != 0
    assert "cases.my_trace: " in run.output
    assert "bad.csv, line 402, column 'rotation_rad': found" in run.output
    assert "Traceback" not in run.output
    assert len(run.output.splitlines()) < 8


@pytest.mark.parametrize(
    ("old", "new", "messages"),
    [
        (
            "example_trace.csv",
            "exmaple_trace.csv",
            ["line 8: cases.my_trace.measurement.file: found", "Did you mean"],
        ),
        (
            "maxwell}",
            "maxwell, k: 1.0}",
            ["is what a recorded trace is to tell; leave it out"],
        ),
        ("{file: " + str(EXAMPLE) + ", ", "{", ["time: is only for a recorded trace"]),
        (
            "{file: " + str(EXAMPLE) + ", ",
            "{file: " + str(EXAMPLE) + ", sd: sd, noise_rad: 1.0e-6, noise_model: coloured, ",
            [
                "noise_rad: does not go with sd, which says all of the noise.",
                "sd: is that of white noise; leave it out where noise_model is coloured.",
            ],
        ),
    ],
    ids=["missing", "known", "simulated", "weighted"],
)
def test_what_a_recording_cannot_be_is_named(
    tmp_path: Path, old: str, new: str, messages: list[str]
) -> None:
    file = tmp_path / "overlay.yaml"
    file.write_text(replaced(replaced(RECORDED, "mine.csv", str(EXAMPLE)), old, new))
    with pytest.raises(BiogripError) as error:
        load_study(overlaid(read_config(CONFIG), read_config(file)), [CONFIG, file])
    assert [message for message in messages if message not in str(error.value)] == []
