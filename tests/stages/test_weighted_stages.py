"""Weights of a recorded trace, from the config to what the workflow makes of it."""

import json
from pathlib import Path

import pandas as pd
import pytest

from biogrip.stages import identification, judgement, recording
from biogrip.study.load import load_study
from biogrip.study.source import overlaid, read_config
from tests.helpers.places import CONFIG, EXAMPLE

WEIGHTED = f"""
methods: [least_squares]
only: [mine]
cases:
  mine:
    sample: {{model: liquid_drop}}
    measurement: {{file: {EXAMPLE}, time: time_s, rotation: rotation_rad, noise_share: 0.1}}
"""


def test_all_stages_weight_the_readings(tmp_path: Path) -> None:
    """They find the same optimum, with the noise that is known."""
    config, traces, verdicts = (tmp_path / name for name in ("c.yaml", "t.parquet", "v.json"))
    config.write_text(WEIGHTED)
    case = load_study(overlaid(read_config(CONFIG), read_config(config)), [CONFIG, config]).cases[
        "mine"
    ]
    recording.record(case, EXAMPLE, traces)
    judgement.judge(case, traces, [], verdicts)
    judged = json.loads(verdicts.read_text())
    assert judged["threshold"] == pytest.approx(3.8415, abs=1e-4)
    outputs = [tmp_path / name for name in ("p.csv", "h.parquet", "t.csv")]
    identification.identify(case, "least_squares", range(1), traces, [], *outputs)
    (found,) = pd.read_csv(outputs[0]).itertuples()
    assert found.misfit == pytest.approx(judged["misfit"], rel=1e-4)
    assert found.k_N_per_m == pytest.approx(judged["quantities"][0]["value"], rel=1e-3)
