import json
import subprocess
import sys
from itertools import product
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from biogrip.errors import BiogripError
from biogrip_study.records.rows import seeds_of
from biogrip_study.stages import job
from tests.helpers.default import STUDY, study_of

NAME = "liquid_drop_2"
SWEPT = """
seeds: 7
gripper: {uncertainty: {torque_percent: 1.0}}
cases:
  power: {sample: {model: springpot, k_alpha: 3.0, alpha: 0.4}, measurement: {rate_Hz: 2.0}}
sweeps:
  level:
    cases: [liquid_drop_2]
    rows: {label: level, key: measurement.noise.level, values: [0, 0.2]}
    columns: {label: rate, key: measurement.rate_Hz, values: [1, 10]}
"""


def told(given: dict[str, Any]) -> dict[str, Any]:
    return json.loads(json.dumps(given))


@pytest.mark.parametrize("key", ["times_s", "experiment", "gripper", "seeds", "title"])
def test_what_the_rule_does_not_name_cannot_be_read(key: str) -> None:
    case = job.case_with_keys(
        NAME, told(job.settings(STUDY, ["sample", "measurement.noise"], NAME))
    )
    assert case.block.sample == STUDY.cases[NAME].block.sample
    assert case.noise == STUDY.cases[NAME].noise
    with pytest.raises(AttributeError, match="not among the keys that the rule names"):
        getattr(case, key)


def test_all_keys_give_the_study_and_its_cases_back() -> None:
    study = study_of(SWEPT)
    whole = [key for key in job.STUDY_KEYS if key != "cases"]
    whole += job.keys_of_cases(study, *job.CASE_KEYS)
    again = job.study_of(told(job.settings(study, whole)))
    assert again.plain == study.plain
    assert (list(again.cases), list(again.points)) == (list(study.cases), list(study.points))
    keys = [*job.CASE_KEYS, "study_seed", "seeds", "methods", "actuator"]
    for name in (*study.cases, *study.points):
        was, case = (
            study.case(name),
            job.case_with_keys(name, told(job.settings(study, keys, name))),
        )
        for known in ("title", "sample", "noise", "experiment", "parameters", "seeds"):
            assert getattr(case, known) == getattr(was, known)
        np.testing.assert_array_equal(case.times_s, was.times_s)
        assert case.study.config.study_seed == study.config.study_seed
        for method in study.config.methods:
            assert case.block.method(method) == was.block.method(method)


def test_the_log_has_what_a_user_can_correct_alone_and_else_a_traceback(tmp_path: Path) -> None:
    log = tmp_path / "job.log"
    ran = SimpleNamespace(log=[str(log)])
    with pytest.raises(SystemExit) as ended, job.logged(ran):
        raise BiogripError("a.csv: cannot be read.")
    assert ended.value.code == 1
    assert log.read_text() == "biogrip: a.csv: cannot be read.\n"
    with pytest.raises(ZeroDivisionError), job.logged(ran):
        print(1 // 0)
    said = log.read_text()
    assert said.startswith("Traceback (most recent call last):")
    assert "print(1 // 0)" in said
    assert said.endswith("ZeroDivisionError: integer division or modulo by zero\n")


def test_a_default_of_a_case_goes_before_what_the_study_has() -> None:
    own = "instrument: gripper, protocol: {phases: [{duration_s: 9, torque_Nm: 1.0e-9}]}"
    shared = "instrument: creep\nprotocol: {phases: [{duration_s: 9, stress_Pa: 4}]}"
    study = study_of(f"{shared}\nonly: [{NAME}]\ncases: {{{NAME}: {{{own}}}}}")
    told_of = job.settings(study, ["instrument"], NAME)
    assert job.case_with_keys(NAME, told_of).block.instrument == study.case(NAME).block.instrument


def test_every_seed_is_in_one_batch_and_full_ones_stay() -> None:
    for seeds, size in product((1, 7, 24, 25, 60), (1, 3, 25, 1000)):
        plan = job.batch_names(seeds, size)
        assert [seed for batch in plan for seed in seeds_of(batch)] == list(range(seeds))
        assert set(plan[: seeds // size]) <= set(job.batch_names(seeds + 1, size))


@pytest.mark.parametrize(
    ("module", "unused"),
    [
        ("stages.targets", {"scipy", "pandas", "matplotlib", "biogrip.judging"}),
        ("stages.identification", {"scipy", "pandas", "matplotlib", "biogrip.judging"}),
        ("stages.judgement", {"scipy.optimize", "pandas", "matplotlib", "biogrip_study.tables"}),
        ("tables.cases", {"scipy", "matplotlib", "biogrip.judging.diagnosis"}),
        ("tables.study", {"scipy.stats", "matplotlib", "biogrip.judging.diagnosis"}),
        ("figures.course", {"scipy.stats", "biogrip.command"}),
        ("page.page", {"scipy.stats", "biogrip.command"}),
    ],
)
def test_a_job_loads_nothing_large_that_it_does_not_use(module: str, unused: set[str]) -> None:
    """Loading pandas, `scipy.special` or `scipy.stats` takes longer than many a job."""
    code = f"import sys, biogrip_study.{module}; print(*sys.modules)"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert not unused & set(run.stdout.split())
