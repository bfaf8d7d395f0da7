"""What of the benchmarks can be checked without a clock."""

import subprocess
import sys
import time
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
import yaml

from benchmarks.batch import in_batch
from benchmarks.budget import Search, Spent, evaluations_99
from benchmarks.limit import watch_writes, watched_fits, watched_identification
from benchmarks.misfit import by_lsim, by_radau, in_blocks, misfit_50_digits, vectorised
from benchmarks.nonlinear import by_radau as nonlinear_by_radau
from benchmarks.scale import watch_writes as watched_processes
from benchmarks.section import Section, number, renewed
from benchmarks.setup import CONFIG, Problem, evolve, problem
from benchmarks.starts import fitted, started
from benchmarks.study import by_rule, in_order, processor_s
from benchmarks.timing import Timed, alternate
from biogrip.arrays import Array, IntArray
from biogrip.identify.genome import Genome
from biogrip.response.misfit_series import SeriesMisfit
from biogrip.response.nonlinear import nonlinear_rotation
from biogrip.study.load import load_study
from biogrip.study.study import Study

if TYPE_CHECKING:
    from benchmarks.genetic_peers import Task

PEERS = ("by_deap", "by_pygad", "by_pymoo")


@pytest.fixture(scope="module")
def noisy() -> Problem:
    return problem()


def test_all_ways_to_the_misfit_agree(noisy: Problem) -> None:
    samples = np.vstack((noisy.truth, noisy.population(4)))
    exact = [misfit_50_digits(noisy, sample) for sample in samples]
    np.testing.assert_allclose(noisy.misfit()(samples), exact, rtol=1e-9)
    np.testing.assert_allclose(vectorised(noisy, samples), exact, rtol=1e-13)
    np.testing.assert_allclose(in_blocks(noisy, samples), exact, rtol=1e-13)
    np.testing.assert_allclose(by_lsim(noisy, samples), exact, rtol=1e-5)
    np.testing.assert_allclose(by_radau(noisy, samples), exact, rtol=1e-6)


def test_radau_solves_the_nonlinear_model(noisy: Problem) -> None:
    sample = noisy.truth[None]
    (expected,) = nonlinear_by_radau(noisy, sample, rtol=1e-8)
    network = noisy.model.network(sample)
    (ours,) = nonlinear_rotation(noisy.gripper, network, noisy.steps, noisy.time_s)
    assert np.max(np.abs(ours - expected)) < 1e-7 * np.abs(ours).max()


def test_the_watched_misfit_is_the_misfit(noisy: Problem) -> None:
    misfit, samples = watch_writes(noisy), noisy.population(50)
    rates, sums_s = misfit.rates, misfit.sums_s
    assert rates > 100
    assert sums_s > 0
    np.testing.assert_array_equal(misfit(samples), noisy.misfit()(samples))
    assert misfit.misfit_s > 0
    # The trace is summed over for the table alone.
    assert (misfit.rates, misfit.sums_s) == (rates, sums_s)


def test_traces_side_by_side_are_taken_together(monkeypatch: pytest.MonkeyPatch) -> None:
    """As in the study; else their misfits, though the same, would be computed one by one."""
    traces = [problem(seed, rate_Hz=1.0) for seed in range(3)]
    sizes: list[int] = []
    of_each = SeriesMisfit.of_each

    def watching(misfit: SeriesMisfit, parameters: Array, of: IntArray) -> Array:
        sizes.append(len(parameters))
        return of_each(misfit, parameters, of)

    monkeypatch.setattr(SeriesMisfit, "of_each", watching)
    in_batch(traces, replace(traces[0].genetic, max_generations=25))
    assert set(sizes) == {3}


def test_an_identification_is_watched(noisy: Problem) -> None:
    misfit = watched_identification(noisy, seed=0)
    assert misfit.misfit_s > misfit.sums_s > 0


def test_the_watched_fits_are_the_fits(noisy: Problem) -> None:
    rows, traces = watched_fits([noisy])
    rows.start()
    np.testing.assert_array_equal(fitted(traces), fitted(started([noisy])))
    assert rows.evaluations > len(traces[0].starts)
    # Two modes and four parameters: products of 5 x 12 with 12 x rows, and of 5 x rows with rows.
    some_rows = traces[0].case_problem.residuals.condensed_trace.size
    assert rows.operations == 2 * rows.evaluations * 5 * (12 + 5) * some_rows
    assert rows.spent_s > 0


@pytest.fixture(scope="module")
def study() -> Study:
    return load_study(yaml.safe_load(CONFIG.read_text()), [CONFIG])


def test_jobs_come_after_what_they_read(study: Study) -> None:
    made: set[str] = set()
    jobs = in_order(study)
    for job in jobs:
        needed = {
            file for files in job.rule.inputs(job.wildcards).values() for file in map(str, files)
        }
        assert needed <= made
        made |= set(job.outputs)
    assert len(jobs) > 50


def test_processor_time_of_jobs_is_added_up_by_rule(study: Study, tmp_path: Path) -> None:
    targets = [job for job in in_order(study) if job.rule.name == "target"][:2]
    target, total = by_rule(targets, study, tmp_path)
    assert (target["rule"], target["jobs"]) == ("target", 2)
    assert target["starting_s"] > 0
    assert total["processor_s"] == target["processor_s"] > 0
    assert all((tmp_path / file).exists() for job in targets for file in job.outputs)


def test_a_job_that_fails_is_no_measurement(tmp_path: Path) -> None:
    with pytest.raises(subprocess.CalledProcessError):
        processor_s([sys.executable, "-c", "raise SystemExit(1)"], tmp_path)


def test_processes_are_watched_by_what_they_make(tmp_path: Path) -> None:
    """Two children of a Snakemake, each with the name of what it makes; a shell is neither."""
    child = "import sys, time; kept = b'.' * 50_000_000; time.sleep(1)"
    start = (
        "import subprocess, sys\n"
        "for what in ('errors', 'methods'):\n"
        f"    subprocess.run([sys.executable, '-c', {child!r}, 'make', what], check=True)"
    )
    seen = watched_processes([sys.executable, "-c", start, "snakemake"], tmp_path)
    assert set(seen) == {"Snakemake", "errors", "methods"}
    assert seen["errors"].processes == 1
    assert seen["errors"].largest_MB > seen["Snakemake"].largest_MB + 25
    with pytest.raises(subprocess.CalledProcessError):
        watched_processes([sys.executable, "-c", "raise SystemExit(3)"], tmp_path)


def test_ratios_are_taken_turn_by_turn() -> None:
    timed = Timed({"ours": np.array([1.0, 2.0, 4.0]), "peer": np.array([3.0, 4.0, 20.0])})
    row = timed.against("peer", "ours", scale=10.0)
    assert row["times_ours"] == 30.0
    assert (row["times_ours_lowest"], row["times_ours_highest"]) == (20.0, 50.0)
    assert row["time_ms"] == 40_000.0


def test_calls_alternate() -> None:
    order: list[str] = []

    def call(name: str) -> None:
        order.append(name)
        time.sleep(0.05)

    timed = alternate({name: partial(call, name) for name in "ab"}, rounds=3)
    assert "".join(order) == "ab" + 3 * "ab"
    assert all(np.all(timed.seconds[name] >= 0.05) for name in "ab")


def test_traces_side_by_side_reach_what_they_reach_alone(noisy: Problem) -> None:
    settings = replace(noisy.genetic, population=40, survivors=20, max_generations=8)
    problems = [noisy, problem(1)]
    alone = [
        evolve(p.misfit(), p.genome, settings, np.random.default_rng(seed))
        for seed, p in enumerate(problems)
    ]
    assert in_batch(problems, settings) == [answer.misfit_rad for answer in alone]


def test_evaluations_until_99_percent_are_there() -> None:
    """The 99th of 100 if so many are; else as many budgets as leave 1 % without success."""
    assert evaluations_99(range(1, 100), 100, 200) == 99
    assert evaluations_99(range(1, 101), 100, 200) == 99
    half = evaluations_99([3] * 50, 100, 200)
    assert half is not None
    assert 0.5 ** (half / 200) == pytest.approx(0.01)
    assert evaluations_99([], 100, 200) is None


def test_a_search_knows_when_it_has_reached_what(noisy: Problem) -> None:
    """Within a batch, and not beyond the budget."""
    posed = noisy.case_problem()
    parameters = np.vstack((noisy.population(3), noisy.truth, noisy.population(1)))
    misfits = noisy.misfit()(parameters)
    aims = {"easy": float(misfits[:3].max()), "hard": 1.0001 * float(misfits[3])}
    search, late = (Search(posed, 1.0, budget, aims) for budget in (4, 3))
    for each in (search, late):
        with pytest.raises(Spent):
            each.misfit(np.log(parameters))
        assert each.evaluations == len(parameters)
    assert search.reached == {"easy": 1 + int(np.argmax(misfits <= aims["easy"])), "hard": 4}
    assert search.parameters == pytest.approx(noisy.truth)
    assert set(late.reached) == {"easy"}


@pytest.mark.parametrize(
    ("value", "printed"),
    [(0.0, "0"), (1234.5, "1,234"), (12.345, "12.3"), (0.01234, "0.0123"), (1e-9, "1e-09")],
)
def test_numbers_are_printed_short(value: float, printed: str) -> None:
    assert number(value) == printed


def test_a_section_takes_its_place_in_the_report() -> None:
    def section(name: str, value: str) -> Section:
        return Section(
            name, f"Of {name}", "How.", {"found": lambda row: row["found"]}, [{"found": value}]
        )

    there = "# Benchmarks\n\n## Of one\n\nold\n\n## Of two\n\nstays\n"
    first = renewed(there, {"cores": "2"}, [section("one", "new"), section("three", "more")])
    assert "old" not in first
    assert first.index("new") < first.index("stays") < first.index("more")
    again = renewed(first, {"cores": "2"}, [section("three", "other")])
    assert "more" not in again
    assert again.count("## Of ") == 3


class TestPeers:
    """Needs the extra `bench`."""

    @pytest.fixture
    def task(self, noisy: Problem) -> "Task":
        pytest.importorskip("deap")
        pytest.importorskip("pygad")
        pytest.importorskip("pymoo")
        from benchmarks.genetic_peers import Task

        settings = replace(
            noisy.genetic, population=40, survivors=20, mutation_start=3, max_generations=8
        )
        return Task(noisy.misfit(), noisy.genome, settings)

    @pytest.mark.parametrize("documented", [False, True])
    @pytest.mark.parametrize("name", PEERS)
    def test_reported_misfit_is_that_of_the_chromosome(
        self, task: "Task", name: str, documented: bool
    ) -> None:
        from benchmarks import genetic_peers

        best, misfit = getattr(genetic_peers, name)(task, 1, documented=documented)
        assert misfit == pytest.approx(task.of(best[None])[0], rel=1e-9)
        assert np.all((task.genome.low <= best) & (best <= task.genome.high))

    @pytest.mark.parametrize("documented", [False, True])
    @pytest.mark.parametrize("name", PEERS)
    def test_peers_do_the_work_of_ours(self, task: "Task", name: str, documented: bool) -> None:
        """As many evaluations; PyGAD leaves out children that equal a parent.

        As documented, pymoo's initial population is no larger than any other.
        """
        from benchmarks import genetic_peers
        from benchmarks.identification import Counted

        counted = Counted(task.misfit)
        getattr(genetic_peers, name)(replace(task, misfit=counted), 1, documented=documented)
        budget = (20 if name == "by_pymoo" and documented else 40) + 8 * 20
        assert counted.evaluations <= budget
        assert counted.evaluations > (0.4 * budget if name == "by_pygad" else budget - 1)

    @pytest.mark.parametrize("name", PEERS)
    def test_mutation_starts_when_it_should(self, task: "Task", name: str) -> None:
        """Before, all genes are of the initial population; there are too many to draw one twice."""
        from benchmarks import genetic_peers

        batches: list[np.ndarray] = []

        class Recording(genetic_peers.Task):
            def of(self, chromosomes: np.ndarray) -> np.ndarray:
                batches.append(np.array(chromosomes))
                return 1.0 + chromosomes.sum(axis=1)

        genome = Genome(np.zeros(12, dtype=np.int64), np.full(12, 10**9, dtype=np.int64), (3,) * 4)
        getattr(genetic_peers, name)(
            Recording(task.misfit, genome, task.settings), 1, documented=False
        )
        new = [not np.all(np.isin(batch, batches[0])) for batch in batches]
        assert len(new) == 1 + task.settings.max_generations
        assert not any(new[:3])
        assert new[3]

    def test_metaheuristics_have_one_budget(self) -> None:
        """Each counts as many evaluations as its misfit made, and stops with the budget."""
        pytest.importorskip("pymoo")
        pytest.importorskip("pypesto")
        from benchmarks.identification import Counted
        from benchmarks.metaheuristics import PEERS, default_study, methods_of, searches_of

        case, budget = default_study().cases["liquid_drop_2"], 1200
        (start,) = searches_of(case, [0], budget)
        for title, _, method in methods_of(case):
            search = start()
            counted = Counted(search.problem.misfit)
            search.problem = replace(search.problem, misfit=counted)
            method([search], [np.random.default_rng(0)])
            assert search.over
            assert all(reached <= budget for reached in search.reached.values())
            assert title not in PEERS or search.evaluations < 2 * budget
            if title in PEERS and "least squares" not in title:
                assert search.evaluations == counted.evaluations
            found = search.problem.misfit(search.parameters[None])[0]
            assert found == pytest.approx(search.lowest_rad, rel=1e-6)

    def test_metaheuristics_repeat_themselves(self) -> None:
        """The same runs from the same streams, and the study's traces."""
        pytest.importorskip("pymoo")
        pytest.importorskip("pypesto")
        from benchmarks.metaheuristics import runs_of, section_of

        first, again = (runs_of("liquid_drop_1", range(2), 1200) for _ in range(2))
        for run in (*first, *again):
            del run["seconds"]
        assert first == again
        rows = section_of([run | {"seconds": 1.0} for run in first]).rows
        assert {row["seeds"] for row in rows} == {2}
        assert len({row["method"] for row in rows}) == len(rows) == len(first) / 2

    def test_local_fits_reach_the_same_optima(self) -> None:
        pytest.importorskip("lmfit")
        pytest.importorskip("pypesto")
        from benchmarks.local_fits import OURS, PEERS, SIDE_BY_SIDE, compared

        traces = [
            replace(trace, starts=trace.starts[:4]) for trace in started([problem(0), problem(1)])
        ]
        rows = compared(traces, few=1, rounds=1)
        assert [row["library"] for row in rows] == [OURS, SIDE_BY_SIDE, *PEERS]
        assert all(row["largest_chi2_above_best"] < 0.1 for row in rows)
        assert rows[0]["times_ours"] == rows[1]["times_side_by_side"] == 1.0

    def test_limits_agree(self) -> None:
        pytest.importorskip("lmfit")
        pytest.importorskip("pypesto")
        from benchmarks.profiles import PYPESTO, compared

        rows = {row["library"]: row for row in compared([problem(0), problem(1)], rounds=1)}
        # Interpolated over steps as wide as the interval, or wider.
        assert rows.pop(PYPESTO)["largest_error_deviations"] > 1
        assert all(row["largest_error_deviations"] < 0.1 for row in rows.values())
