"""From a recording and an experiment to a diagnosis: the same by every way."""

import json
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from biogrip.config.source import overlaid
from biogrip.identify.identify import identify
from biogrip.library import INSTRUMENTS, BiogripError, Sample, hold, set_up
from biogrip.traces.reader import recording_of_arrays
from biogrip_study.stages.judgement import judge
from biogrip_study.stages.targets import record
from tests.helpers.columns import columns_of
from tests.helpers.default import study_of
from tests.helpers.identified import identified, write_trace
from tests.helpers.places import ROOT
from tests.helpers.runs import ran

TRUTH = {"k_s": 5e4, "k_v": 2e4, "c_v": 2e6, "tau_v": 100.0}
SECONDS = np.arange(4.0, 600.0, 4.0)
SCATTER = 5e-5 * np.random.default_rng(3).standard_normal(len(SECONDS))
# A soft tissue under 100 Pa: as its own equation has it, J = 1/k_s + (1 - exp(-t k_v/c_v))/k_v.
STRAIN = 100 * (1 / 5e4 + (1 - np.exp(-SECONDS / 100)) / 2e4) + SCATTER
FEW = {
    "model_selection": {"models": ["maxwell"]},
    "least_squares": {"candidates": 100, "starts": 4},
}
HERTZ = np.geomspace(0.02, 20.0, 25)
# A Zener solid of 3000 and 500 Pa, and 0.25 Hz.
MODULI = (500 + 3000 / (1 - 0.25j / HERTZ)) * (1 + 100 * SCATTER[:25])
# What is held, the model, and the columns of what is read.
CREPT = {"stress_Pa": 100.0}, "zener_kelvin", {"time": "time_s", "strain": "strain"}
SWEPT = {"strain": 1.0}, "zener", {"frequency": "f_Hz", "storage": "a_Pa", "loss": "b_Pa"}
# A fitted start takes half a minute.
ALSO: list[dict[str, Any]] = [{"offset": True, "noise_share": 0.02}, {"fit_start": True}]


@pytest.mark.parametrize(
    ("held", "model", "columns", "terms"),
    [
        *((*CREPT, {}), (*SWEPT, {})),
        *(pytest.param(*CREPT, each, marks=pytest.mark.nightly) for each in ALSO),
    ],
)
def test_a_study_gives_the_answer_of_the_command(
    tmp_path: Path,
    held: dict[str, float],
    model: str,
    columns: dict[str, str],
    terms: dict[str, Any],
) -> None:
    """To the last bit, of one name, which random starts go by; far from the usual search ranges."""
    rows = (SECONDS, STRAIN) if "time" in columns else (HERTZ, MODULI.real, MODULI.imag)
    file = write_trace(tmp_path / "mine.csv", *rows, header=",".join(columns.values()))
    lab: dict[str, Any] = {"measurement": columns | terms}
    lab["instrument"] = "creep" if "time" in columns else "oscillation"
    lab["protocol"] = {"phases": [{"duration_s": 600.0, **held}]}
    mine = overlaid(lab, {"sample": {"model": model}, "measurement": {"file": str(file)}})
    study = study_of(yaml.safe_dump({**FEW, "only": ["mine"], "cases": {"mine": mine}}))
    case = study.case("mine")
    record(case, file, tmp_path / "trace.npz")
    judge(case, tmp_path / "trace.npz", tmp_path / "judged.json")
    of_study = json.loads((tmp_path / "judged.json").read_text())
    of_command = identified(tmp_path, file, "--model", model, config=yaml.safe_dump(FEW | lab))
    for key in ("fit", "reasons", "samples", "threshold", "certainty", "quantities", "notes"):
        assert of_study[key] == of_command[key], key
    (misfit,) = (value for key, value in of_command.items() if key.startswith("misfit"))
    assert of_study["misfit"] == misfit
    if model == "zener_kelvin" and not terms:
        for found in of_command["quantities"]:
            # Of four intervals at 95 % one may miss, but none by its width.
            truth, width = TRUTH[found["quantity"]], found["high"] - found["low"]
            assert found["low"] - width < truth < found["high"] + width
            assert width < 0.1 * truth


def test_a_message_names_array_and_index() -> None:
    for given, said in (
        ({"strain": np.where(SECONDS == 20, np.inf, STRAIN)}, r"strain\[4\]: found inf, allowed"),
        ({"time_s": SECONDS[::-1]}, r"time_s\[1\]: found 592 after 596, allowed are"),
        ({"strain": -STRAIN}, r"strain\[0\] to \[148\]: found a strain that goes against the st"),
        ({"time_s": 10 * SECONDS}, r"time_s\[15\]: found 640 s, allowed is the protocol's time"),
        ({"strain": np.where(SECONDS < 584, np.nan, STRAIN)}, "the trace: found 4 rows with a nu"),
        ({"rows": {"step": 1}}, "measurement.rows: is only for a file, not for arrays."),
    ):
        creep = set_up(INSTRUMENTS["strain"], (hold(600.0, 100.0),), Sample("zener_kelvin"))
        own: dict[str, Any] = {"time_s": SECONDS, "strain": STRAIN, **given}
        time_s, strain = own.pop("time_s"), own.pop("strain")
        columns = columns_of("time_s", "strain", "strain", **own)
        with pytest.raises(BiogripError, match=said):
            identify(recording_of_arrays(columns, time_s, strain), creep)


PLANNED = """
only: [mine]
cases: {mine: {sample: {model: damper, c_p: 80.0}}}
measurement: {rate_Hz: 0.5}
design: {steps: 1}
"""
TYPED = (
    ("identify", "data/example_trace.csv", "--no-compare", "--report", "page.html"),
    (
        "identify",
        "data/dishes/cells.tsv",
        "--model",
        "damper",
        "--no-compare",
        "--csv",
        "found.csv",
    ),
    ("groups", "found.csv", "--by", "treatment", "--unit", "dish", "--plot", "cells.png"),
    ("design", "mine.yaml"),
)


@pytest.mark.nightly
def test_the_method_needs_neither_the_study_nor_snakemake(tmp_path: Path) -> None:
    """Of every command, in a process in which importing either is an error."""
    shutil.copytree(ROOT / "data", tmp_path / "data")
    (tmp_path / "mine.yaml").write_text(PLANNED)
    cells = tmp_path / "data" / "dishes" / "cells.tsv"
    header, *rows = cells.read_text().splitlines(keepends=True)
    cells.write_text("".join([header, rows[0], rows[-1]]))
    without = "sys.modules |= {'biogrip_study.config.study': None, 'snakemake': None}"
    code = f"import sys; {without}; from biogrip.cli import main; sys.exit(main(sys.argv[1:]))"
    for command in TYPED:
        ran(tmp_path, sys.executable, "-c", code, *command)


def test_neither_study_nor_figures_are_loaded_for_a_trace() -> None:
    code = "import sys, biogrip.identify.identify; print(*sys.modules)"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    ours = [name.split(".") for name in run.stdout.split() if name.split(".")[0] == "biogrip"]
    rooms = {name[1] for name in ours if len(name) == 3}
    assert rooms == {"identify", "judging", "fit", "traces", "physics"}
    # Packages have no code of their own.
    assert len([name for name in ours if name[-1] not in {"biogrip", *rooms} or name[2:]]) <= 50
