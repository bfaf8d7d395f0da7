"""Recorded traces through the whole workflow."""

import json
from pathlib import Path

import pandas as pd

from tests.workflow.conftest import ROOT, snakemake

EXAMPLE = ROOT / "data" / "example_trace.csv"
RECORDED = f"""
methods: [least_squares]
model_selection: {{models: [damper, liquid_drop]}}
cases:
  endothelial_cell: null
  liquid_drop_1: null
  liquid_drop_2: null
  my_trace:
    sample: {{model: generalized_maxwell}}
    measurement: {{file: {EXAMPLE}, time: time_s, rotation: rotation_rad}}
"""


def test_a_recorded_trace_gets_what_a_simulated_one_gets(tmp_path: Path) -> None:
    run = snakemake(tmp_path, config=RECORDED)
    assert run.status == 0, run.output
    results = tmp_path / "results"
    errors = pd.read_csv(results / "tables" / "errors_my_trace.csv")
    assert errors["parameter"].tolist() == ["k", "k_p", "c", "c_p", "c + c_p"]
    assert errors["target"].isna().all()
    assert errors["best_error_percent"].isna().all()
    verdicts = pd.read_csv(results / "tables" / "verdicts_my_trace.csv")
    assert verdicts["verdict"].tolist()[:2] == ["determined", "determined"]
    for figure in ("fit", "profiles", "valley", "convergence", "evolution"):
        assert (results / "figures" / f"{figure}_my_trace.png").stat().st_size > 5000
    found = json.loads((results / "identifiability" / "my_trace.json").read_text())
    page = (results / "summaries" / "my_trace.html").read_text()
    for item in found["quantities"]:
        assert item["in_words"] in page
    assert page.count("data:image/png;base64,") == 3
    identified = pd.read_csv(results / "identifications" / "my_trace.csv")
    assert len(identified) == 1
    assert identified["noise_rms_rad"].isna().all()
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
    config = RECORDED.replace(str(EXAMPLE), str(bad))
    run = snakemake(tmp_path, "results/measurements/my_trace/seeds_0-0.parquet", config=config)
    assert run.status != 0
    assert "bad.csv, line 402, column 'rotation_rad': found" in run.output
    assert "Traceback" not in run.output
    missing = snakemake(tmp_path, config=config.replace("bad.csv", "bda.csv"))
    assert missing.status != 0
    assert "overlay.yaml, line 10: cases.my_trace.measurement.file: found" in missing.output
    assert "Did you mean" in missing.output
    known = snakemake(tmp_path, config=config.replace("maxwell}", "maxwell, k: 1.0}"))
    assert "is what a recorded trace is to tell; leave it out" in known.output
    simulated = config.replace("{file: " + str(bad) + ", ", "{")
    unknown = snakemake(tmp_path, config=simulated)
    assert "time: is only for a recorded trace" in unknown.output
