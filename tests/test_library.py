import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import biogrip
from biogrip import library
from biogrip.judging.verdicts import DETERMINED
from tests.helpers.default import STUDY
from tests.helpers.places import ROOT
from tests.helpers.radau import equal_arms
from tests.physics.test_nonlinear import ARM, TIMES

DOCUMENT = Path(__file__).parents[1] / "docs" / "library.md"
POSTERIOR = DOCUMENT.parent / "howto" / "posterior.md"


def code_in(document: Path) -> str:
    (code,) = re.findall(r"```python\n(.*?)```", document.read_text(encoding="utf-8"), re.DOTALL)
    return str(code)


def run(code: str) -> dict[str, Any]:
    names: dict[str, Any] = {}
    exec(compile(code, "documentation", "exec"), names)
    return names


def test_what_the_documentation_shows_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    names = run(code_in(DOCUMENT))
    said = dict(line.split(" ", 1) for line in capsys.readouterr().out.splitlines()[:4])
    # A damper of 1e-3 cannot be told from none; the others stand out of 5 % of noise.
    assert said["k_p"].startswith("determined: 5.0")
    assert said["c_p"].startswith("only bounded above")
    (k_p,) = (f for f in names["told"].findings if f.quantity.label == "k_p")
    assert k_p.low < 5.0 < k_p.high
    assert (tmp_path / "fit.png").read_bytes().startswith(b"\x89PNG")


def test_a_sampled_posterior_agrees_with_the_profiles(monkeypatch: pytest.MonkeyPatch) -> None:
    """By the code of the how-to, with a chain a fifth as long."""
    monkeypatch.chdir(ROOT)
    names = run(code_in(POSTERIOR).replace("3000", "600").replace("1000", "200"))
    told = library.judge(*(names[each] for each in ("experiment", "time_s", "rotation", "found")))
    medians = np.median(names["chain"], axis=0)
    findings = {f.quantity.label: f for f in told.findings}
    for name, median in zip(names["experiment"].searched.names, medians, strict=True):
        if name != "c_p":
            assert findings[name].verdict == DETERMINED
            assert findings[name].low < median < findings[name].high


def test_what_is_simulated_by_the_nonlinear_model_is_not_what_the_linear_one_gives() -> None:
    """Against Radau without inertia; at ten times the paper's torque a cell shows 3e-4 of it."""
    gripper = library.Gripper(1.5e-3, 60.0, ARM, ARM)
    protocol = (library.hold(200.0, 1.6e-8), library.hold(200.0, 3.2e-9))
    sample = {"k": 35.0, "k_p": 12.3, "c": 299.9, "c_p": 1e-3}
    experiment = library.set_up(gripper, protocol, library.Sample("generalized_maxwell"))
    linear, nonlinear = (
        library.simulate(experiment, sample, TIMES, nonlinear=nonlinear)
        for nonlinear in (False, True)
    )
    ends = [(200.0, 1.6e-8), (400.0, 3.2e-9)]
    peak = float(nonlinear.max())
    expected = equal_arms(gripper, np.array(list(sample.values())), ends, TIMES, peak)[0]
    np.testing.assert_allclose(nonlinear, expected, rtol=0, atol=1e-6 * peak)
    assert np.max(np.abs(linear - expected)) > 1e-4 * peak


def test_all_of_the_library_can_be_had_from_the_package() -> None:
    assert set(library.__all__) == biogrip._LIBRARY
    assert all(getattr(biogrip, name) is getattr(library, name) for name in library.__all__)


def test_it_identifies_as_the_default_study() -> None:
    assert STUDY.ranges == library._RANGES
    assert all(case.method("least_squares") == library._BUDGET for case in STUDY.cases.values())


def test_what_is_not_there_is_said_as_everywhere() -> None:
    with pytest.raises(AttributeError, match="has no attribute 'nonsense'"):
        _ = biogrip.nonsense
