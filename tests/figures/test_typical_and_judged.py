"""Which run a figure shows: the typical one, or the very one that is judged."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from biogrip.errors import BiogripError
from biogrip.figures import evolution, fit, judged_fit
from biogrip.figures.results import SHOWN_SEEDS, read_history
from biogrip.figures.style import styled
from biogrip.physics.simulation import simulated_rotation
from biogrip.records.traces import Measurements, write_measurements
from tests.helpers.default import STUDY

CASE = "liquid_drop_2"
TRUTH = [1.0, 1e-4, 10.0, 1e-3]
TIME_S = np.arange(0.0, 400.5, 1.0)


def response(values: list[float]) -> np.ndarray:
    problem = STUDY.cases[CASE].problem
    network = problem.model.network(np.array([values]))
    found: np.ndarray = simulated_rotation(
        problem.gripper, network, problem.torque, TIME_S, nonlinear=False
    )[0]
    return found


def test_histories_of_the_seeds_that_are_drawn_are_read(tmp_path: Path) -> None:
    """By one method, wherever in the file they are; Arrow's own filter is the independent one."""
    path = tmp_path / "histories.parquet"
    seeds = np.repeat([0, 1, SHOWN_SEEDS, SHOWN_SEEDS + 1], 3)
    tables = [
        pa.table({"method": [method] * 12, "seed": seeds, "generation": seeds, "k": seeds * 0.5})
        for method in ("genetic", "least_squares")
    ]
    with pq.ParquetWriter(path, tables[0].schema) as writer:
        for table in tables:
            for start in range(0, 12, 4):
                writer.write_table(table.slice(start, 4))
    found = read_history(path, "least_squares", SHOWN_SEEDS + 1, ["k"])
    kept = [("method", "==", "least_squares"), ("seed", "!=", SHOWN_SEEDS)]
    columns = ["seed", "generation", "k"]
    pd.testing.assert_frame_equal(found, pd.read_parquet(path, columns=columns, filters=kept))
    with pytest.raises(BiogripError, match=r"histories.parquet: cannot be read: No match"):
        read_history(path, "genetic", 0, ["no such column"])


@pytest.fixture
def measurements(tmp_path: Path) -> Path:
    """Three traces whose noise falls from seed to seed."""
    path = tmp_path / "seeds_0-2.parquet"
    target = response(TRUTH)
    rng = np.random.default_rng(0)
    noise = {seed: 1e-4 / (1 + seed) * rng.standard_normal(len(TIME_S)) for seed in range(3)}
    traces = {seed: target + each for seed, each in noise.items()}
    write_measurements(path, Measurements(TIME_S, target, traces))
    return path


@pytest.fixture
def identifications(tmp_path: Path) -> Path:
    """Of seed 1 the excess over the noise is the middle one, of seed 2 the misfit is lowest."""
    rows = []
    for seed, k, misfit, noise in (
        (0, 0.5, 1.3e-4, 1e-4),
        (1, 0.7, 6e-5, 5e-5),
        (2, 1, 3e-5, 3e-5),
    ):
        rows.append([CASE, "genetic", seed, k, 1e-4, 10.0, 1e-3, misfit, noise, 7, 100, "stalled"])
    path = tmp_path / f"{CASE}.csv"
    names = ["k_N_per_m", "k_p_N_per_m", "c_Ns_per_m", "c_p_Ns_per_m"]
    leading = ["case", "method", "seed", *names, "misfit", "noise_rms", "generations"]
    pd.DataFrame(rows, columns=[*leading, "evaluations", "stop_reason"]).to_csv(path, index=False)
    return path


def line(figure: Any, label: str) -> np.ndarray:
    (found,) = (each for each in figure.axes[0].lines if label in str(each.get_label()))
    data: np.ndarray = np.asarray(found.get_ydata())
    return data


def test_the_typical_run_is_drawn(identifications: Path, measurements: Path) -> None:
    with styled():
        figure = fit.draw(STUDY.cases[CASE], identifications, [measurements], [])
    expected = 1e3 * response([0.7, *TRUTH[1:]])
    np.testing.assert_allclose(line(figure, "typical fit (seed 1"), expected, rtol=1e-9)
    # The paper's axis is on it, and all that was measured.
    low, high = figure.axes[0].get_ylim()
    assert low <= -0.6
    assert high >= 4.2


def test_the_page_of_a_trace_shows_the_fit_that_it_judges(
    tmp_path: Path, measurements: Path
) -> None:
    names = STUDY.cases[CASE].problem.model.names
    items = [{"quantity": n, "value": v} for n, v in zip(names, [0.9, *TRUTH[1:]], strict=True)]
    verdicts = tmp_path / "verdicts.json"
    verdicts.write_text(json.dumps({"quantities": items, "trades": [], "notes": []}))
    with styled():
        figure = judged_fit.draw(STUDY.cases[CASE], verdicts, measurements, [])
    expected = 1e3 * response([0.9, *TRUTH[1:]])
    np.testing.assert_allclose(line(figure, "best fit (seed 0)"), expected, rtol=1e-9)


def test_how_far_from_its_target_a_run_ends_is_named(identifications: Path, tmp_path: Path) -> None:
    columns = ["k_N_per_m", "k_p_N_per_m", "c_Ns_per_m", "c_p_Ns_per_m"]
    history = pd.DataFrame({"seed": [0, 0, 1, 1, 2, 2], "generation": [0, 1] * 3})
    for column, value in zip(columns, TRUTH, strict=True):
        history[column] = [value, value * 0.9, value, value * 1.024, value, value]
    history.assign(method="genetic").to_parquet(tmp_path / "history.parquet")
    with styled():
        figure = evolution.draw(STUDY.cases[CASE], identifications, tmp_path / "history.parquet")
    titles = [axes.get_title(loc="right") for axes in figure.axes]
    assert titles == ["seed 1 ends 2.4 % above the target"] * 4
