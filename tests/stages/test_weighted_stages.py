"""Weights of a recorded trace, from the config to what the workflow makes of it."""

import json
from pathlib import Path

import pandas as pd
import pytest

from biogrip.stages import identification, judgement, recording
from tests.helpers.default import study_of
from tests.helpers.places import EXAMPLE


def test_all_stages_weight_the_readings(tmp_path: Path) -> None:
    """They find the same optimum, with the noise that is known."""
    file = f"{{file: {EXAMPLE}, time: time_s, rotation: rotation_rad, noise_share: 0.1}}"
    case = study_of(
        f"cases: {{mine: {{sample: {{model: liquid_drop}}, measurement: {file}}}}}"
    ).cases["mine"]
    traces, verdicts = tmp_path / "t.parquet", tmp_path / "v.json"
    recording.record(case, EXAMPLE, traces)
    judgement.judge(case, traces, [], verdicts)
    judged = json.loads(verdicts.read_text())
    assert judged["threshold"] == pytest.approx(3.8415, abs=1e-4)
    outputs = [tmp_path / name for name in ("p.csv", "h.parquet", "t.csv")]
    identification.identify(case, "least_squares", range(1), traces, [], *outputs)
    (found,) = pd.read_csv(outputs[0]).itertuples()
    assert found.misfit == pytest.approx(judged["misfit"], rel=1e-4)
    assert found.k_N_per_m == pytest.approx(judged["quantities"][0]["value"], rel=1e-3)
