import ast
import json
import re
from base64 import b64decode
from io import BytesIO
from math import gamma
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import PIL.Image
import pytest
import yaml
from matplotlib.figure import Figure

import biogrip
from biogrip import library
from biogrip.command.options import Setting
from biogrip.command.settings import Asked, case_of
from tests.helpers.default import STUDY
from tests.helpers.identified import by_quantity, identified, told
from tests.helpers.places import EXAMPLE, ROOT
from tests.helpers.problems import problem

DOCUMENT = ROOT / "docs" / "library.md"


def test_what_the_documentation_shows_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    # No sentence there is about the comparison with other models, which takes longest.
    none = '"model_selection": {"models": []}'
    text, names = DOCUMENT.read_text(encoding="utf-8"), dict[str, Any]()
    alone = text.replace('"zener_kelvin"\n)', f'"zener_kelvin", config={{{none}}}\n)')
    alone = alone.replace("config = {", f"config = {{{none},")
    codes = re.findall(r"```python\n(.*?)```", alone, re.DOTALL)
    for code in codes:
        if "import lmfit" not in code:
            exec(compile(code, "documentation", "exec"), names)
    _, creep, gripper = re.split(r"(?m)^(?=.*: fit )", capsys.readouterr().out)
    assert creep in text
    # A damper of 1e-3 cannot be told from none; the others stand out of 5 % of noise.
    assert "\n  k_p  determined: 5.0" in gripper
    assert "\n  c_p  only bounded above" in gripper
    k_p = names["told"].to_frame().loc["k_p"]
    assert k_p["low"] < 5.0 < k_p["high"]
    assert (tmp_path / "fit.png").read_bytes().startswith(b"\x89PNG")


# A strain of 5 Pa on a clock that starts at 85 s, with a tare.
TRUTH = {"k_s": 300.0, "k_v": 200.0, "c_v": 900.0}
CREEP = library.set_up(
    library.INSTRUMENTS["strain"], (library.hold(60.0, level=5.0),), library.Sample("zener_kelvin")
)
SECONDS = np.arange(-4.9, 60.0, 0.2)
SCATTER = 2e-4 * np.random.default_rng(0).standard_normal(len(SECONDS))
FRAME = pd.DataFrame(
    {"t": SECONDS + 85, "strain": library.simulate(CREEP, TRUTH, SECONDS) + SCATTER + 0.001},
    index=range(7, 7 + len(SECONDS)),
)


HELD: dict[str, Any] = {"reads": "strain", "hold": 5.0, "model": "zener_kelvin"}


def test_columns_of_pandas_are_identified_as_by_the_command(tmp_path: Path) -> None:
    own: dict[str, Any] = {"start": 85, "offset": True, "noise": 2e-4}
    config = {"model_selection": {"models": ["maxwell", "zener_kelvin"]}}
    result = library.identify_trace(FRAME["t"], FRAME[["strain"]], **HELD, **own, config=config)
    FRAME.to_csv(tmp_path / "trace.csv", index=False)
    options = "--time t --set measurement.time_unit=s --reading strain=strain --start 85"
    options += f" --model zener_kelvin --offset --noise 2e-4 --csv {tmp_path / 'found.csv'}"
    given = *options.split(), "--hold", "5e-3 kPa"
    found = identified(tmp_path, tmp_path / "trace.csv", *given, config=yaml.safe_dump(config))
    assert found["load"] == f"Held: 0.005 kPa from 85 s to {FRAME['t'].iloc[-1]:g} s."
    assert f"\nHeld: 5 Pa from 85 s to {FRAME['t'].iloc[-1]:g} s.\n" in str(result)
    frame = result.to_frame()
    assert list(frame.index) == [*TRUTH, "tau_v"]
    for quantity in found["quantities"]:
        row = frame.loc[quantity["quantity"]]
        assert [row[key] for key in ("unit", "verdict")] == [quantity["unit"], "determined"]
        assert row["low"] == pytest.approx(quantity["low"], rel=1e-4)
        assert abs(row["value"] - {**TRUTH, "tau_v": 4.5}[row.name]) < row["high"] - row["low"]
    assert all(quantity["in_words"] in str(result) for quantity in found["quantities"])
    assert len(repr(result).splitlines()) == 5
    assert list(result.to_frame("models")["model"]) == ["maxwell", "zener_kelvin"]
    # One panel a quantity; and a table as the command writes it, but for its digits.
    assert len(result.plot("profiles").axes) >= len(frame)
    words = {"one": {"dish": "d1"}, "two": {"dish": "d2"}}
    assert library.to_table([result])["trace"].tolist() == ["1"]
    table = library.to_table({"one": result, "two": result}, words)
    assert table[["trace", "dish"]].to_numpy().tolist() == [["one", "d1"], ["two", "d2"]]
    csv = pd.read_csv(tmp_path / "found.csv")
    assert set(table) - {"dish"} == set(csv)
    assert float(table["k_s low (Pa)"][0]) == pytest.approx(csv["k_s low (Pa)"][0], rel=1e-4)
    # J = 1/k_s + 1/(k_v + i omega c_v)
    omega, storage, loss = result.to_frame("moduli").to_numpy().T
    assert omega[[0, -1]] == pytest.approx([1 / np.ptp(SECONDS), 1 / 0.2])
    modulus = 1 / (1 / 300 + 1 / (200 + 900j * omega))
    np.testing.assert_allclose(storage + 1j * loss, modulus, rtol=0.03)
    assert found["moduli"]["loss_Pa"] == pytest.approx(loss, rel=1e-4)


def test_a_trace_is_identified_again_by_a_model_s_usual_name_and_drawn_by_its_clock() -> None:
    """A model with a spring and a damper is no model of a Zener solid."""
    found = told(FRAME["t"], FRAME["strain"], **HELD, start=85)
    other = found.refit(model="KV")
    assert (other.data["model"], other.status) == ("kelvin_voigt", "rejected")
    assert (found.data["model"], found.status) == ("zener_kelvin", "ok")
    assert other.data["load"] == found.data["load"]
    above, below = found.plot().axes
    assert below.get_xlim() == pytest.approx((80.1, 144.9))
    assert above.get_ylabel().startswith("strain")
    sample = library.identify_sample(CREEP, SECONDS, FRAME["strain"])
    assert len(repr(sample)) < 300


@pytest.mark.parametrize(("name", "branches"), [("Prony3", 3), ("prony_1", 1)])
def test_a_prony_series_has_no_damper_beside_its_branches(name: str, branches: int) -> None:
    case, _ = case_of(Asked(EXAMPLE, None, (Setting("--model", ("sample", "model"), name),)))
    assert (case.sample.name, case.sample.branches) == ("generalized_maxwell", branches)
    assert case.block.fixed == {"c_p": 0.0}


def test_what_cannot_be_used_is_said_by_the_name_of_the_argument() -> None:
    trace = {"time_s": FRAME["t"], "readings": FRAME["strain"]}
    for given, said in (
        ({"reads": "strian"}, "reads: found 'strian', allowed are rotation, displacement, strain,"),
        ({"reads": ["strain"]}, r"reads: found '\['strain'\]', allowed are rotation"),
        ({"hold": None}, "hold: is missing; allowed is the stress in Pa that was held"),
        ({"hold": 0.0}, "hold: protocol.phases: no phase has a stress"),
        ({"hold": "5,0"}, "hold: found '5,0', a decimal comma. Allowed is a point"),
        ({"hold": [1.0]}, r"hold: found '\[1.0\]', allowed is a number, or one with its unit"),
        ({"config": {"protocol": {}}}, "found --hold and protocol; allowed is one of them."),
        ({"config": {"protocl": {}}}, "protocl"),
        ({"config": [1]}, r"config: found \[1\], allowed are values by name"),
        ({"fixed": {1: 2.0}}, "fixed: found {1: 2.0}, allowed are values by name"),
        ({"model": "zener_k"}, "model: .*found 'zener_k'. Did you mean .*'zener_kelvin'"),
        ({"model": 5}, "model: .*found "),
        ({"start": "soon"}, "start: measurement.start_s: found 'soon', allowed is a number"),
        ({"start": np.array([1.0, 2.0])}, "start: measurement.start_s: found .*, allowed is a num"),
        ({"noise": "much"}, "noise: measurement.noise_rad: found 'much', allowed is a number"),
        ({"sd": [1.0]}, "found 325 of time_s and 325 of strain and 1 of sd; allowed are as many"),
        ({"sd": 0.1}, r"sd: found the shape \(\), allowed is one column"),
        ({"readings": [[0.1], [0.1, 0.2]]}, "strain.*: setting an array element .*; allowed are"),
        ({"readings": {"a": 1}}, "strain: .*; allowed are numbers"),
        ({"time_s": FRAME}, r"time_s: found the shape \(325, 2\), allowed is one column"),
        ({"time_s": ["a"]}, "time_s: could not convert .*; allowed are numbers"),
        ({"time_s": pd.to_datetime(["2026-01-01"])}, "time_s: found datetime64.*; allowed are num"),
    ):
        with pytest.raises(library.BiogripError, match=said):
            library.identify_trace(**(trace | HELD | given))


def test_times_of_pandas_are_seconds_and_masked_readings_are_gaps() -> None:
    """Three readings are ten times too large; another is at the instant of the step."""
    times = np.linspace(0.0, 10.0, 101)
    strain = 0.1 * (1 - np.exp(-2 * times)) + 1e-4 * np.random.default_rng(1).normal(size=101)
    clock = pd.to_timedelta(1e6 * times, unit="us").astype("timedelta64[us]")
    wrong = np.arange(101) % 30 == 20
    masked = np.ma.array(np.where(wrong, 10 * strain, strain), mask=wrong)
    found = told(pd.Series(clock), masked, reads="strain", hold=100.0, model="kelvin_voigt")
    assert (found.status, found.data["samples"]) == ("ok", 97)
    assert "they were taken: 1 reading, at " in str(found)
    limits = found.to_frame().loc[["k_p", "c_p"]]
    assert np.all((limits["low"] < [1000, 500]) & (limits["high"] > [1000, 500]))


@pytest.mark.parametrize("count", [5, 6, 7])
def test_a_few_readings_that_relax_are_a_response(count: int) -> None:
    """100 exp(-t/20 s) Pa, noise of 0.5 Pa."""
    times = np.linspace(60 / count, 60.0, count)
    readings = 100 * np.exp(-times / 20) + 0.5 * np.random.default_rng(2).normal(size=count)
    found = told(times, readings, reads="modulus", model="maxwell", start=0.0)
    limits = found.to_frame().loc[["k", "tau"]]
    assert np.all((limits["low"] < [100, 20]) & (limits["high"] > [100, 20]))


@pytest.mark.parametrize("unit_s", [1e-7, pytest.param(86_400.0, marks=pytest.mark.nightly)])
def test_a_power_law_has_no_time_of_its_own(unit_s: float) -> None:
    """t^alpha/(k Gamma(1 + alpha)) of 100 units of time, 700 Pa and 0.25 in that unit."""
    times = np.linspace(0.5, 100.0, 120)
    compliance = times**0.25 / (700 * gamma(1.25))
    noisy = compliance + 0.004 * compliance[-1] * np.random.default_rng(3).normal(size=120)
    found = told(times * unit_s, noisy, reads="compliance", model="springpot")
    frame = found.to_frame()
    assert found.status == "ok"
    low, high = frame.loc[["k_alpha", "alpha"], ["low", "high"]].to_numpy().T
    truth = np.array([700 * unit_s**0.25, 0.25])
    assert np.all((low < truth) & (truth < high))
    assert np.all(high / low < 1.05)


def test_all_of_the_library_can_be_had_from_the_package_and_is_as_the_default_study() -> None:
    assert all(getattr(biogrip, name) is getattr(library, name) for name in library.__all__)
    with pytest.raises(AttributeError, match="has no attribute 'nonsense'"):
        _ = biogrip.nonsense
    budgets = [case.block.least_squares for case in STUDY.cases.values()]
    assert all(budget == CREEP.least_squares for budget in budgets)


@pytest.mark.parametrize(
    ("case", "outlasts"), [("endothelial_cell", False), ("liquid_drop_1", True)]
)
def test_a_sum_has_a_condition_where_a_branch_may_outlast_the_trace(
    case: str, outlasts: bool
) -> None:
    posed = problem(case, 0).residuals.trace
    found = by_quantity(told(posed.time_s, posed.readings).data)
    high_s = found["tau"]["high"]
    assert (high_s is None or high_s > 400.0) == outlasts
    assert (found["c + c_p"]["provided"] is not None) == outlasts
    assert ("provided" in found["c + c_p"]["in_words"]) == outlasts


def test_a_notebook_shows_status_table_and_picture() -> None:
    posed = problem("endothelial_cell", 0).residuals.trace
    shown = told(posed.time_s, posed.readings)._repr_html_()
    (picture,) = re.findall('<img src="data:image/png;base64,([^"]+)"', shown)
    with PIL.Image.open(BytesIO(b64decode(picture))) as image:
        assert image.width > 600
    rows = re.findall("<th>([^<]+)</th>\n      <td>", shown)
    assert rows == ["k", "k_p", "c", "c_p", "c + c_p", "tau"]
    assert "model: fit ok</p>" in shown


def test_the_notebook_says_what_it_shows(capsys: pytest.CaptureFixture[str]) -> None:
    cells = json.loads((ROOT / "docs" / "notebook.ipynb").read_text(encoding="utf-8"))["cells"]
    names: dict[str, Any] = {}
    shown = 0
    for cell in (it for it in cells if it["cell_type"] == "code"):
        source = "".join(cell["source"])
        last = ast.parse(source).body[-1]
        exec(compile(source, "notebook", "exec"), names)
        said = capsys.readouterr().out
        for output in cell["outputs"]:
            if output["output_type"] == "execute_result":
                assert isinstance(last, ast.Expr)
                value = eval(ast.unparse(last), names)
                assert isinstance(value, Figure) or repr(value) == "".join(
                    output["data"]["text/plain"]
                )
            else:
                assert said == "".join(output["text"])
            shown += 1
    assert shown == 4
