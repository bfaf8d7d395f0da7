"""Several traces of one sample by the command: a column `sample`, and `--together`."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from biogrip.cli import main
from biogrip.command.files import identify_files
from biogrip.command.options import Setting
from biogrip.command.outputs import join_tables
from biogrip.command.words import agreement_in_words, set_up_in_words

OPTIONS = ["--reading", "strain", "--model", "zener_kelvin", "--no-compare"]


def write(folder: Path, name: str, stress: float, gain: float) -> str:
    """Write creep of a Zener solid of 400 and 300 Pa and 20 s, times a gain."""
    time_s = np.arange(2.0, 60, 2.0)
    readings = stress / gain * (1 / 400 - np.expm1(-time_s / 20) / 300)
    rng = np.random.default_rng([*name.encode()])
    frame = {"time_s": time_s, "strain": readings + 2e-4 * rng.standard_normal(len(time_s))}
    pd.DataFrame(frame).to_csv(folder / name, index=False)
    return name


def identify(folder: Path, *rows: str, more: tuple[str, ...] = ()) -> int:
    """Identify the traces of a table, whose results are in `found.csv`."""
    (folder / "cells.csv").write_text("\n".join(rows) + "\n")
    command = ["identify", str(folder / "cells.csv"), "--csv", str(folder / "found.csv")]
    return main([*command, *OPTIONS, *more])


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four cells of two dishes and treatments, each under two loads, and one trace alone."""
    place = tmp_path_factory.mktemp("samples")
    rows = ["file,hold,sample,dish,treatment"]
    for dish in "ab":
        for treatment, gain in (("none", 1.0), ("drug", 1.5)):
            for load in (5, 10):
                file = write(place, f"{dish} {treatment} {load}.csv", load, gain)
                rows.append(f"{file},{load} Pa,{dish} {treatment},{dish},{treatment}")
    rows.append(f"{write(place, 'alone.csv', 5, 1.0)},5 Pa,,a,none")
    assert identify(place, *rows) == 0
    return place


def test_a_sample_is_a_row(folder: Path) -> None:
    found = pd.read_csv(folder / "found.csv").set_index("trace")
    assert len(found) == 5
    samples = found[found["traces"] == 2]
    assert sorted(samples.index) == ["a drug", "a none", "b drug", "b none"]
    assert set(samples["treatment"]) == {"none", "drug"}
    assert list(samples["samples"]) == 4 * [2 * 29]
    assert np.all(samples["one sample p"] > 0.01)
    true = np.where(samples["treatment"] == "drug", 450, 300)
    np.testing.assert_allclose(samples["k_v value (Pa)"], true, rtol=0.05)
    # Two traces tell more than one.
    alone = found.loc[str(folder / "alone.csv")]
    widths = samples["k_v high (Pa)"] - samples["k_v low (Pa)"]
    assert widths["a none"] < alone["k_v high (Pa)"] - alone["k_v low (Pa)"]


def test_its_json_has_its_traces(folder: Path) -> None:
    found: dict[str, Any] = json.loads((folder / "a drug.identified.json").read_text())
    assert found["trace"] == "a drug"
    assert [trace["samples"] for trace in found["traces"]] == [29, 29]
    # A strain has no unit, and so has its noise.
    assert all("noise" in trace and "noise_rad" not in trace for trace in found["traces"])
    assert found["agreement"]["degrees_of_freedom"] == 3
    assert found["fit"] == "doubtful"
    assert len(agreement_in_words(found)) == 1


def test_of_traces_that_agree_the_answer_is_said(folder: Path) -> None:
    found: dict[str, Any] = json.loads((folder / "a none.identified.json").read_text())
    (said,) = agreement_in_words(found)
    assert said.startswith("The 2 traces agree with one linear sample (p = ")
    low, high = map(float, re.findall(r"\((\S+) to (\S+)\) for .*a none 10.csv", said)[0])
    assert low < 1 < high
    assert "(1 likewise with other numbers)." in " ".join(set_up_in_words(found))
    assert {q["quantity"] for q in found["without_model"]["quantities"]} > {"J(10 s)"}


def test_groups_take_samples_as_cells(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["groups", str(folder / "found.csv"), "--by", "treatment", "--unit", "dish"]) == 0
    said = [line.split() for line in capsys.readouterr().out.split("\n")]
    row, *_ = [line for line in said if line[:3] == ["k_v", "(Pa)", "none"]]
    # Two samples and the trace alone, of two dishes.
    assert row[3:7] == ["3", "of", "3", "2"]


@pytest.mark.nightly
def test_its_page_has_one_figure_of_all_traces(folder: Path, tmp_path: Path) -> None:
    rows = (folder / "cells.csv").read_text().split("\n")
    for name in ("a none 5.csv", "a none 10.csv", "alone.csv"):
        (tmp_path / name).write_bytes((folder / name).read_bytes())
    page = tmp_path / "page.html"
    assert identify(tmp_path, *rows[:3], rows[-2], more=("--report", str(page))) == 0
    text = page.read_text()
    # A picture of both; of each the fit and the profiles, twice.
    assert text.count("data:image/png") == 1 + 2 * 3
    assert text.count("<h3>Each trace by itself</h3>") == 1


def test_a_sample_of_one_trace_is_that_trace(tmp_path: Path) -> None:
    """Byte for byte, but for what says from which settings it was made."""
    made = []
    for column in ("sample", "cell"):
        place = tmp_path / column
        place.mkdir()
        write(place, "alone.csv", 5, 1.0)
        assert identify(place, f"file,hold,{column}", "alone.csv,5 Pa,x") == 0
        data = json.loads((place / "alone.identified.json").read_text())
        text = (place / "found.csv").read_text() + json.dumps({**data, "digest": ""})
        made.append(text.replace(str(place), "").replace(f"trace,{column}", "trace"))
    assert made[0] == made[1]


def test_together_says_that_a_sample_stiffens(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    levels = {2: 1.0, 5: 1.12, 10: 1.35}
    files = [write(tmp_path, f"{load}.csv", load, gain) for load, gain in levels.items()]
    rows = [f"{file},{load} Pa" for file, load in zip(files, levels, strict=True)]
    assert identify(tmp_path, "file,hold", *rows, more=("--together",)) == 0
    said = capsys.readouterr().out
    assert said.startswith("together: fit rejected")
    assert "not of one linear sample" in said
    assert "It rises with the stress" in said
    assert "Each trace by itself:" in said
    assert (tmp_path / "together.identified.json").exists()


def test_a_trace_that_cannot_be_read_costs_its_sample_only(tmp_path: Path) -> None:
    (tmp_path / "broken.csv").write_text("time_s,strain\n0,x\n1,y\n")
    for name in ("1.csv", "2.csv", "3.csv"):
        write(tmp_path, name, 5, 1.0)
    rows = ["1.csv,one", "broken.csv,two", "2.csv,two", "3.csv,three", "gone.csv,three"]
    assert identify(tmp_path, "file,sample", *rows, more=("--hold", "5 Pa")) == 1
    found = pd.read_csv(tmp_path / "found.csv").set_index("trace")
    assert list(found["fit"]) == ["ok", "failed", "failed"]
    assert "broken.csv, line 2" in found.loc["two", "failed"]
    assert "gone.csv" in found.loc["three", "failed"]


def test_rows_one_by_one_give_the_table_of_all(folder: Path, tmp_path: Path) -> None:
    """One in which no trace was read alone tells no unit of the noise."""
    (tmp_path / "broken.csv").write_text("time_s,strain\n0,x\n1,y\n")
    names = ["broken.csv", "a none 5.csv", "alone.csv", "a none 10.csv"]
    for name in names[1:]:
        (tmp_path / name).write_bytes((folder / name).read_bytes())
    rows = [f"{name},5 Pa,strain,{'gel' * ('none' in name)}" for name in names]
    assert identify(tmp_path, "file,hold,reading,sample", *rows) == 1
    (tmp_path / "found.csv").rename(tmp_path / "whole.csv")
    parts = [tmp_path / f"{row}-{row}.csv" for row in range(3)]
    settings = [Setting("", ("sample", "model"), "zener_kelvin")]
    settings.append(Setting("", ("model_selection", "models"), []))
    for row, part in enumerate(parts):
        table = [tmp_path / "cells.csv"]
        identify_files(table, None, settings, table=part, rows=(row, row))
    join_tables(parts, tmp_path / "joined.csv", 3)
    assert (tmp_path / "joined.csv").read_text() == (tmp_path / "whole.csv").read_text()
