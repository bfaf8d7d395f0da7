import os
import re
from pathlib import Path
from typing import Any

import pytest

from biogrip.config.source import overlaid
from tests.helpers.runs import SMALL, TINY, clone, dry_run, jobs_of, planned, results_of, snakemake

# What puts all cases together, whatever changed, and what compares their identifications.
TOLD = {"claims": 1, "page": 1}
COMPARED = TOLD | dict.fromkeys(("errors", "methods", "overview"), 1)
# Of a simulated case, from its traces to their judgement, with one batch of them; and what of the
# study reads these.
TRACES = {"measurement": 1, "identification": 2, "model_fits": 1, "intervals": 1, "judgement": 1}
TRACES |= dict.fromkeys(("evidence", "readings_of_case", "models", "coverage", "verdict_counts"), 1)
# Figures of a simulated case and of a recorded trace.
DRAWN = {"case_figures": 1, "recorded_case_figures": 1, "summary": 2}
CELL = {"sample": {"model": "liquid_drop", "k": 20.0, "k_p": 5.0, "c": 80.0}}
LEVELS = {
    "cases": ["liquid_drop_2"],
    "rows": {"label": "level", "key": "measurement.noise.level", "values": [0.0, 0.2]},
    "columns": {"label": "rate", "key": "measurement.rate_Hz", "values": [1]},
}
CHANGES: dict[str, tuple[dict[str, Any], dict[str, int]]] = {
    "noise": (
        {"measurement": {"noise": {"level": 0.2}}},
        TRACES
        | {"recorded_judgement": 1, "mechanics": 1, "case_tables": 1, "case_verdicts": 2}
        | DRAWN
        | COMPARED,
    ),
    "models to compare": (
        {"model_selection": {"models": ["maxwell"]}},
        {"model_fits": 2, "models": 1, "recorded_judgement": 1, "case_verdicts": 1}
        | {"recorded_case_figures": 1, "summary": 1}
        | TOLD,
    ),
    "a case, and the title of another": (
        {"cases": {"new": CELL, "liquid_drop_2": {"title": "A drop"}}},
        {"target": 1, "mechanics": 1, "linearisation": 1, "gripper_figures": 1}
        | {"case_tables": 2, "case_verdicts": 2, "case_figures": 2, "summary": 2}
        | TRACES
        | COMPARED,
    ),
    "seeds": (
        {"seeds": 7},
        {"measurement": 3, "identification": 6, "model_fits": 3, "models": 1, "mechanics": 1}
        | {"evidence": 1, "readings_of_case": 1}
        | {"case_tables": 1, "case_figures": 1, "summary": 1}
        | COMPARED,
    ),
    "what is read of a recorded trace": (
        {"cases": {"mine": {"measurement": {"until_s": 300.0}}}},
        {"recording": 1, "identification": 2, "model_fits": 1, "models": 1}
        | {"recorded_judgement": 1, "case_tables": 1, "case_verdicts": 1, "errors": 1}
        | {"recorded_case_figures": 1, "summary": 1}
        | TOLD,
    ),
    # Whose points have no figures of their own.
    "budget of a method, and a sweep": (
        {"genetic_algorithm": {"max_generations": 5}, "sweeps": {"levels": LEVELS}},
        {"identification": 6, "target": 2, "measurement": 2, "sweep": 1, "case_tables": 2}
        | {"readings_of_case": 1}
        | DRAWN
        | COMPARED,
    ),
}


@pytest.mark.parametrize("name", CHANGES)
def test_what_uses_a_setting_runs_again_and_nothing_else(tiny: Path, name: str) -> None:
    change, expected = CHANGES[name]
    assert planned(tiny, config=overlaid(TINY, change)) == expected


def test_a_table_and_a_figure_take_the_jobs_whose_files_they_need(tmp_path: Path) -> None:
    """Of one sample and two methods: no intervals, no models, no verdicts."""
    identified = {"target": 1, "measurement": 1, "identification": 2, "case_tables": 1}
    config = SMALL | {"only": ["liquid_drop_2"]}
    for target, rule in (("tables/errors.csv", "errors"), ("tables/methods.csv", "methods")):
        assert planned(tmp_path, f"results/{target}", config=config) == {**identified, rule: 1}


def test_a_dry_run_says_which_setting_changed_from_what_to_what(tiny: Path) -> None:
    """Of the command line, from which a number in a block comes as text."""
    block = "evaluation={near_noise_tolerance: 0.03}"
    told = dry_run(tiny, "--config", block, config=TINY)
    assert jobs_of(told) == {"case_tables": 2, "evidence": 1} | DRAWN | COMPARED
    for when, value in (("before", 0.02), ("now", 0.03)):
        evaluation = f"'evaluation': {{'optimum_tolerance': 1.0, 'near_noise_tolerance': {value}}}"
        assert re.search(rf"{when}: {{[^:]*{evaluation}", told)


@pytest.mark.nightly
def test_an_edited_or_older_trace_in_the_place_of_another_is_read(tiny_copy: Path) -> None:
    """As by `mv`, `cp -p`, or an archive: the date alone says that nothing has changed."""
    trace = tiny_copy / "mine.csv"
    first, *lines = trace.read_text().splitlines(keepends=True)
    trace.write_text("".join([first, *lines, "400.5,1e-3\n"]))
    again = {"recording": 1, "identification": 2, "case_tables": 1}
    assert planned(tiny_copy, "results/identifications/mine.csv", config=TINY) == again
    for kept, jobs in ((lines[::2], {"recording": 1}), (lines, {})):
        trace.write_text("".join([first, *kept]))
        os.utime(trace, (1.5e9, 1.5e9))
        told = dry_run(tiny_copy, "--", "results/measurements/mine/seeds_0-0.npz", config=TINY)
        assert jobs_of(told) == jobs
        said = re.search(r"before: \{'recorded': '\w+'\} now: \{'recorded': '\w+'\}", told)
        assert bool(said) == bool(jobs)


@pytest.mark.nightly
def test_an_edit_of_the_library_runs_everything_again_and_is_named(
    tiny: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    clone(tmp_path)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path / "src"))
    with (tmp_path / "src" / "biogrip" / "arrays.py").open("a") as module:
        module.write("# An edit.\n")
    told = dry_run(tiny, config=TINY, snakefile=tmp_path / "Snakefile")
    assert jobs_of(told)["target"] == jobs_of(told)["recording"] == 1
    assert re.search(r"before: .*'source': '\w+'.* now: .*'source': '\w+'", told)


@pytest.mark.nightly
def test_a_second_run_changes_no_byte(tiny: Path, tiny_copy: Path) -> None:
    snakemake(tiny_copy, "--forceall", "-j1", "--", "results/report.html", config=TINY)
    ours, theirs = results_of(tiny_copy), results_of(tiny)
    assert len(ours) > 80
    assert [name for name in ours if ours[name] != theirs[name]] == []
