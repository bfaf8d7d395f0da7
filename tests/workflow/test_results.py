"""What a study writes, and that it is always the same."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest
from biogrip.products.catalogue import products
from matplotlib.image import imread

from biogrip.experiment.maxwell_models import generalized_maxwell
from biogrip.experiment.protocol import hold, torque_history
from biogrip.figures.style import COLUMN_IN
from biogrip.instrument.gripper import Gripper
from biogrip.response.linear import rotation, step_response
from tests.helpers.default import plan_of, study_of
from tests.helpers.in_process import make_in_process
from tests.helpers.pictures import assert_drawn
from tests.helpers.places import ROOT
from tests.helpers.runs import SMALL, TINY, replaced, results_of, snakemake, tables

COLUMNS = (
    *("case", "method", "seed", "k_N_per_m", "k_p_N_per_m", "c_Ns_per_m", "c_p_Ns_per_m"),
    *("misfit", "noise_rms", "generations", "evaluations", "stop_reason"),
)
CASES = ("endothelial_cell", "liquid_drop_2")
METHODS = ("genetic", "least_squares", "differential_evolution")
QUANTITIES = ["k", "k_p", "c", "c_p", "c + c_p"]
PER_CASE = ("fit", "convergence", "evolution", "waterfall", "scatter", "profiles", "valley")


def test_results_have_the_names_and_columns_they_promise(finished: Path) -> None:
    results = finished / "results"
    for case in CASES:
        target = pd.read_csv(results / "targets" / f"{case}.csv")
        assert list(target.columns) == ["time_s", "torque_Nm", "rotation_rad", "jaw_force_N"]
        assert len(target) == 401
        assert target["rotation_rad"].max() > 0
        found = pd.read_csv(results / "identifications" / f"{case}.csv")
        assert tuple(found.columns) == COLUMNS
        assert found["method"].unique().tolist() == list(METHODS)
        assert found["seed"].tolist() == [0, 1, 2, 3] * len(METHODS)
        history = pd.read_parquet(results / "histories" / f"{case}.parquet")
        ends = history.groupby(["method", "seed"], sort=False)["best_misfit"].last()
        last = ends.to_numpy()
        np.testing.assert_allclose(last, found["misfit"], rtol=1e-6)
        for suffix in (".csv", ".md", ".tex", ".html"):
            table = (results / "tables" / f"errors_{case}{suffix}").read_text()
            shown = table.replace("\\_", "_")
            assert [name for name in QUANTITIES if name not in shown] == []
        told = json.loads((results / "identifiability" / f"{case}.json").read_text())
        assert [item["quantity"] for item in told["quantities"]] == QUANTITIES
        page = (results / "summaries" / f"{case}.html").read_text()
        said = [item["in_words"] for item in told["quantities"]]
        said += [trade["words"] for trade in told["trades"]]
        assert [words for words in said if words not in page] == []
        assert page.count("data:image/png;base64,") == 3
        verdicts = pd.read_csv(results / "tables" / f"verdicts_{case}.csv")
        assert verdicts["quantity"].tolist() == QUANTITIES
        for figure in PER_CASE:
            assert_drawn(results / "figures" / f"{figure}_{case}.png")
    for figure in ("overview", "torque", "linkage", "comb", "linearisation"):
        assert_drawn(results / "figures" / f"{figure}.png")
    errors = pd.read_csv(results / "tables" / "errors.csv")
    assert errors["parameter"].tolist() == QUANTITIES * 2
    methods = pd.read_csv(results / "tables" / "methods.csv")
    assert len(methods) == len(CASES) * len(METHODS)
    assert methods["optimum_share"].between(0, 1).all()
    coverage = pd.read_csv(results / "tables" / "coverage.csv")
    assert coverage["coverage_percent"].dropna().between(0, 100).all()
    models = pd.read_csv(results / "tables" / "models.csv")
    assert models.groupby("case")["chosen_by_aic"].sum().tolist() == [4, 4]
    assert len(pd.read_csv(results / "timings.csv")) == len(CASES) * len(METHODS)


def test_every_figure_comes_as_picture_and_for_print(tiny: Path) -> None:
    """In dots that are not seen on a page, and with fonts that publishers take."""
    pictures = sorted((tiny / "results" / "figures").glob("*.png"))
    plan = plan_of(TINY)
    figures = [one for one in products().values() if one.category == "Figures"]
    assert len(pictures) == len([job for figure in figures for job in figure.jobs(plan)])
    for path in pictures:
        assert imread(path).shape[1] >= 200 * COLUMN_IN
        content = path.with_suffix(".pdf").read_bytes()
        assert content.startswith(b"%PDF-")
        assert b"/CIDFontType2" in content
        assert b"/Type3" not in content


def test_measurements_are_target_and_noise_and_can_be_opened(finished: Path) -> None:
    traces = sorted((finished / "results" / "measurements" / CASES[0]).glob("*.parquet"))
    assert [path.stem for path in traces] == ["seeds_0-1", "seeds_2-3"]
    recorded = pq.read_table(traces[0]).to_pandas()
    assert list(recorded.columns) == ["time_s", "target", "seed_0", "seed_1"]
    noise = recorded[["seed_0", "seed_1"]].sub(recorded["target"], axis=0)
    level = noise.std() / recorded["target"].max()
    # 401 samples: 3.5 % of the standard deviation, four times that is allowed.
    assert np.all(np.abs(level / 0.1 - 1) < 0.14)


def test_last_row_is_the_identification_that_its_own_trace_gives(
    finished: Path, gripper: Gripper
) -> None:
    """Misfit and noise in the file, recomputed from the files alone."""
    results = finished / "results"
    steps = torque_history((hold(200.0, 1.6e-9), hold(200.0, 0.32e-9)))
    found = pd.read_csv(results / "identifications" / f"{CASES[0]}.csv").iloc[-1]
    trace = pq.read_table(results / "measurements" / CASES[0] / "seeds_2-3.parquet").to_pandas()
    sample = found[["k_N_per_m", "k_p_N_per_m", "c_Ns_per_m", "c_p_Ns_per_m"]].to_numpy(float)
    response = step_response(gripper, generalized_maxwell(sample))
    fitted = rotation(response, steps, trace["time_s"].to_numpy())[0]
    assert np.sqrt(np.mean((fitted - trace["seed_3"]) ** 2)) == pytest.approx(
        found["misfit"], rel=1e-6
    )
    noise = trace["seed_3"] - trace["target"]
    assert np.sqrt(np.mean(noise**2)) == pytest.approx(found["noise_rms"], rel=1e-6)


@pytest.mark.parametrize("batch_size", [1, 3])
@pytest.mark.nightly
def test_batches_change_no_byte(finished: Path, tmp_path: Path, batch_size: int) -> None:
    """Whatever is put together from batches, that is, not the verdicts on single traces."""
    together = ["errors", "methods"] + ["models", "coverage"] * (batch_size == 1)
    wanted = [f"results/tables/{name}.csv" for name in together]
    config = replaced(SMALL, "batch_size: 2", f"batch_size: {batch_size}")
    make_in_process(tmp_path, study_of(config), wanted)
    ours, theirs = tables(tmp_path), tables(finished)
    assert set(wanted) <= {f"results/{name}" for name in ours}
    assert [name for name in ours if ours[name] != theirs[name]] == []


def test_jobs_side_by_side_change_no_byte(tiny: Path, tmp_path: Path) -> None:
    """What Snakemake ran two at a time, and what is made one after the other in one process."""
    make_in_process(tmp_path, study_of(TINY))
    ours, theirs = results_of(tmp_path), results_of(tiny)
    assert len(ours) > 80
    # Snakemake puts a config together in another order.
    studies = [json.loads(results.pop("study.json")) for results in (ours, theirs)]
    assert studies[0] == studies[1]
    assert ours == theirs


def test_another_study_seed_changes_everything_random(finished: Path, tmp_path: Path) -> None:
    wanted = [f"results/tables/errors_{case}.csv" for case in CASES]
    make_in_process(tmp_path, study_of(SMALL + "study_seed: 2\n"), wanted)
    ours, theirs = tables(tmp_path), tables(finished)
    changed = {name for name in ours if ours[name] != theirs[name]}
    random = {f"identifications/{case}.csv" for case in CASES}
    assert changed >= random | {f"tables/errors_{case}.csv" for case in CASES}
    targets = {name for name in ours if name.startswith("targets/")}
    assert len(targets) == len(CASES)
    assert not targets & changed


def test_report_shows_every_table_and_figure_with_its_labels(
    tiny_copy: Path, tmp_path: Path
) -> None:
    report = tmp_path / "report.html"
    opening = ("--report-metadata", str(ROOT / "workflow" / "report" / "results.yaml"))
    run = snakemake(tiny_copy, "--report", str(report), *opening, config=TINY)
    assert run.status == 0, run.output
    page = report.read_text()
    # It opens on what is described, with the errors, only if there are such data beside it.
    assert '{"Traces identified of each sample": 2}' in page
    errors = (tiny_copy / "results" / "tables" / "errors.csv").read_text().splitlines()
    described = page[page.index("workflow_desc") :]
    assert all(f"<td>{cell}</td>" in described for cell in errors[1].split(",")[:5] if cell)
    plan = plan_of(TINY)
    shown = [product for product in products().values() if product.category and product.jobs(plan)]
    assert len(shown) > 25
    assert [product.name for product in shown if f'"{product.item}"' not in page] == []
    # Tables and pages are shown as they are, not as links to files.
    for kind in ("data:text/html", "data:image/png"):
        assert kind in page
    for label in ("case", "item", "format"):
        assert f'"{label}"' in page
