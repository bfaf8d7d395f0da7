"""What of the benchmarks can be checked without a clock."""

import math
import time
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
import pytest

from benchmarks.batch import in_batch
from benchmarks.limit import watched
from benchmarks.misfit import by_lsim, by_radau, misfit_50_digits, vectorised
from benchmarks.nonlinear import by_radau as nonlinear_by_radau
from benchmarks.section import number
from benchmarks.setup import Problem, problem
from benchmarks.timing import Timed, alternate, time_to_success
from biogrip.identify.genetic import evolve
from biogrip.identify.genome import Genome
from biogrip.response.nonlinear import nonlinear_rotation

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
    np.testing.assert_allclose(by_lsim(noisy, samples), exact, rtol=1e-5)
    np.testing.assert_allclose(by_radau(noisy, samples), exact, rtol=1e-6)


def test_radau_solves_the_nonlinear_model(noisy: Problem) -> None:
    sample = noisy.truth[None]
    (expected,) = nonlinear_by_radau(noisy, sample, rtol=1e-8)
    network = noisy.model.network(sample)
    (ours,) = nonlinear_rotation(noisy.gripper, network, noisy.steps, noisy.time_s)
    assert np.max(np.abs(ours - expected)) < 1e-7 * np.abs(ours).max()


def test_the_watched_misfit_is_the_misfit(noisy: Problem) -> None:
    misfit, samples = watched(noisy), noisy.population(50)
    rates, sums_s = misfit.rates, misfit.sums_s
    assert rates > 100
    assert sums_s > 0
    np.testing.assert_array_equal(misfit(samples), noisy.misfit()(samples))
    assert misfit.misfit_s > 0
    # The trace is summed over for the table alone.
    assert (misfit.rates, misfit.sums_s) == (rates, sums_s)


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
        evolve(p.misfit(), p.genome, settings, np.random.default_rng(seed)).identification
        for seed, p in enumerate(problems)
    ]
    assert in_batch(problems, settings) == [answer.misfit_rad for answer in alone]


@pytest.mark.parametrize(
    ("share", "expected"),
    [(0.0, math.inf), (0.5, 2 * math.log(0.01) / math.log(0.5)), (0.995, 2.0), (1.0, 2.0)],
)
def test_time_to_success(share: float, expected: float) -> None:
    assert time_to_success(2.0, share) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("value", "printed"),
    [(0.0, "0"), (1234.5, "1,234"), (12.345, "12.3"), (0.01234, "0.0123"), (1e-9, "1e-09")],
)
def test_numbers_are_printed_short(value: float, printed: str) -> None:
    assert number(value) == printed


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

    def test_methods_from_elsewhere_fit_better_than_the_truth(self, task: "Task") -> None:
        from benchmarks.optimum import METHODS

        p = problem(case="liquid_drop_1")
        misfit = p.misfit()
        for method in METHODS.values():
            found = method(p, np.random.default_rng(0))
            assert misfit(found[None])[0] < 1.001 * misfit(p.truth[None])[0]
