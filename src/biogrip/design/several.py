"""Several experiments with each cell of a population, designed at once, at a price.

Experiments to choose from are designed for some durations, numbers of steps and of readings; then
anew, beside the one of the cheapest set that tells most, for the cells that it tells least of.
"""

import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from itertools import product

import numpy as np

from biogrip.arrays import Array, BoolArray, IntArray
from biogrip.design.criteria import inverted
from biogrip.design.experiment import NO_BOUND, DesignInputs, compute_information
from biogrip.design.price import PriceSettings
from biogrip.design.schedule import Plan, planned, presses_each, sampled
from biogrip.design.search import best_torques
from biogrip.design.sets import ExperimentSet, SetProblem, enough, front, nothing_beats, repeated
from biogrip.design.waveform import Limits
from biogrip.errors import BiogripError
from biogrip.identify.answer import silent
from biogrip.worker_processes import worker_processes

# Shares of the longest duration, of the most steps and of the readings.
_DURATIONS, _STEPS, _READINGS = (1.0, 0.25, 0.0625), (1.0, 0.25), (1.0, 0.25, 0.0625)
# Fewest steps and readings of an experiment.
_FEWEST_STEPS, _FEWEST_READINGS = 4, 10
# Shares of cells for which cheap sets are found, beside the one asked for.
_SHARES = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)
# Cells whose responses are computed at once.
_AT_ONCE = 16


@dataclass(frozen=True, eq=False)
class Offer:
    """An experiment to choose."""

    plan: Plan
    """Protocol and sampling."""
    cost: float
    """What it costs."""
    information: Array
    """Information on the log-parameters of each cell that sets are chosen for, none where the jaws
    would not press it throughout, (n_cells, n_parameters, n_parameters)."""
    of_others: Array
    """The same of each cell that sets are judged by, (n_others, n_parameters, n_parameters)."""


@dataclass(frozen=True)
class Round:
    """Experiments with cells of which each next one is chosen after those before."""

    cost: float
    """Mean of what they cost so far."""
    share: float
    """Share of cells that are known; a cell has no further ones once its estimate would be."""


@dataclass(frozen=True, eq=False)
class Several:
    """Experiments at a price, chosen in three ways."""

    settings: PriceSettings
    """What was asked for."""
    targets: tuple[int, ...]
    """Indices of the parameters that it was asked for."""
    offers: list[Offer]
    """Experiments to choose from."""
    at_once: list[ExperimentSet]
    """Sets that are cheap for more and more cells, up to the share asked for and beyond; known are
    cells that judge them."""
    chosen: ExperimentSet | None
    """The cheapest of them with which enough cells are known; none if all are too few."""
    repeated: list[ExperimentSet]
    """The cheapest sets of one experiment again and again, likewise."""
    one_by_one: list[Round]
    """Experiments one after the other, after each number of them."""

    @property
    def cells(self) -> int:
        """Number of cells that sets are chosen for."""
        return len(self.offers[0].information)

    @property
    def others(self) -> int:
        """Number of cells that they are judged by."""
        return len(self.offers[0].of_others)

    def plans_of(self, chosen: ExperimentSet) -> list[Plan]:
        """Return the different experiments of a set."""
        return [self.offers[index].plan for index in np.flatnonzero(chosen.counts)]


def choose_several(
    inputs: DesignInputs,
    settings: PriceSettings,
    cells: Array,
    others: Array,
    ends: tuple[Array, Array],
    largest: float,
    tried: int,
    rng: np.random.Generator,
    progress: Callable[[int, int], None],
) -> Several:
    """Design experiments, and choose sets of them.

    Parameters
    ----------
    inputs
        The design problem, whose samples experiments are designed for.
    settings
        Costs, and what is asked for.
    cells : (n_cells, n_parameters)
        Parameters of cells of the population, which sets are chosen for.
    others : (n_others, n_parameters)
        Parameters of other cells of it, which sets are judged by.
    ends
        Least and largest logarithms of the parameters, (n_parameters,) each.
    largest
        Largest standard deviation of a logarithm, with which it counts as known.
    tried
        Torques that are tried for each duration and number of steps.
    rng
        Random generator of searches, and of estimates in between.
    progress
        Called with the numbers of experiments designed and to be designed.

    Raises
    ------
    BiogripError
        If no experiment is found with which the jaws press.
    """
    population = replace(inputs, parameters=cells)

    def problem_of(offers: list[Offer], information: list[Array]) -> SetProblem:
        return SetProblem(
            np.stack(information),
            np.array([each.cost for each in offers]),
            inputs.criterion.targets,
            largest,
            settings.experiments,
            inputs.before,
        )

    def choice(offers: list[Offer]) -> SetProblem:
        return problem_of(offers, [each.information for each in offers])

    grid = list(_grid(inputs))
    searches, between = rng.spawn(2 * len(grid)), rng.spawn(1)[0]

    def groups(inputs: DesignInputs, rngs: list[np.random.Generator]) -> list[_Group]:
        return [
            _Group(replace(inputs, limits=limits), population, others, settings, tried, one)
            for limits, one in zip(grid, rngs, strict=True)
        ]

    offers = _designed(
        groups(inputs, searches[: len(grid)]), lambda done: progress(done, 2 * len(grid))
    )
    if not offers:
        raise BiogripError(
            "design.price: found no experiment with which the jaws press; allowed are more torques "
            "to be tried (`candidates`)."
        )
    problem = choice(offers)
    chosen = problem.cheapest(enough(settings.share, len(cells)))
    first = _first(problem, chosen or _most(problem))
    hardest = _hardest(problem, first)[: len(inputs.parameters)]
    beside = replace(
        inputs,
        parameters=cells[hardest],
        before=inputs.before + problem.information[first, hardest],
    )
    offers += _designed(
        groups(beside, searches[len(grid) :]),
        lambda done: progress(len(grid) + done, 2 * len(grid)),
    )
    problem, judged = choice(offers), problem_of(offers, [each.of_others for each in offers])
    alone = nothing_beats([judged.made(one.counts) for one in repeated(problem)])
    shares = sorted({*_SHARES, settings.share})
    # One repeated is a set, too.
    at_once = nothing_beats([*front(problem, judged, shares), *alone])
    chosen = next((one for one in at_once if one.share >= settings.share), None)
    first = _first(problem, chosen or _most(problem))
    # As many of the others, for this takes long.
    some = slice(len(cells))
    rounds = _one_by_one(
        replace(judged, information=judged.information[:, some]),
        replace(inputs, parameters=others[some]),
        offers,
        first,
        ends,
        between,
    )
    return Several(settings, inputs.criterion.targets, offers, at_once, chosen, alone, rounds)


def _grid(inputs: DesignInputs) -> Iterator[Limits]:
    """Yield limits with shorter durations and fewer steps."""
    limits = inputs.limits
    lasting = {
        limits.shortest_s * max(_FEWEST_STEPS, round(share * limits.longest_s / limits.shortest_s))
        for share in _DURATIONS
    }
    steps = {max(_FEWEST_STEPS, round(share * limits.most_steps)) for share in _STEPS}
    for longest_s, most in product(sorted(lasting), sorted(steps)):
        shorter = min(longest_s, limits.longest_s)
        yield replace(limits, longest_s=shorter, most_steps=min(most, limits.most_steps))


@dataclass(frozen=True, eq=False)
class _Group:
    """Experiments of one duration and number of steps to be designed."""

    inputs: DesignInputs
    population: DesignInputs
    others: Array
    settings: PriceSettings
    tried: int
    rng: np.random.Generator


_given: list[list[_Group]] = []


def _designed(groups: list[_Group], progress: Callable[[int], None]) -> list[Offer]:
    """Design experiments of each duration, number of steps and number of readings."""
    offers: list[Offer] = []
    count = min(len(os.sched_getaffinity(0)), len(groups))
    with worker_processes(count, partial(_given.append, groups)) as processes:
        for done, found in enumerate(processes.map(_offers, range(len(groups))), 1):
            offers += found
            progress(done)
    return offers


def _offers(index: int) -> list[Offer]:
    """Design an experiment with all readings, and with fewer; none if the jaws do not press."""
    group = _given[-1][index]
    inputs = group.inputs
    try:
        plan = planned(inputs, best_torques(inputs, group.tried, group.rng, silent))
    except BiogripError:
        return []
    counts = {max(_FEWEST_READINGS, round(share * inputs.samples)) for share in _READINGS}
    fewer = sorted(counts - {inputs.samples}, reverse=True)
    plans = [plan, *(sampled(replace(inputs, samples=count), plan.phases) for count in fewer)]
    several = [
        replace(group.population, parameters=some)
        for some in (group.population.parameters, group.others)
    ]
    pressed = [_pressed(some, plan)[:, None, None] for some in several]
    return [
        Offer(
            each,
            group.settings.cost(each.torque.end_s, len(each.time_s), len(each.phases)),
            *(_information(some, each) * here for some, here in zip(several, pressed, strict=True)),
        )
        for each in plans
    ]


def _information(population: DesignInputs, plan: Plan) -> Array:
    """Compute the information of an experiment, (n_cells, n_parameters, n_parameters)."""
    history, time_s = population.averaged(plan.phases), plan.time_s
    read = [
        some.noise.whiten(time_s, some.sensitivities(history, time_s))
        for some in _in_parts(population)
    ]
    return np.concatenate([compute_information(each) for each in read])


def _pressed(population: DesignInputs, plan: Plan) -> BoolArray:
    """Return True for cells that the jaws press throughout an experiment, (n_cells,)."""
    return np.concatenate([presses_each(some, plan.phases) for some in _in_parts(population)])


def _in_parts(population: DesignInputs) -> Iterator[DesignInputs]:
    """Yield a population in parts, for memory."""
    for begin in range(0, len(population.parameters), _AT_ONCE):
        yield replace(population, parameters=population.parameters[begin : begin + _AT_ONCE])


def _most(problem: SetProblem) -> ExperimentSet:
    """Return the repetition of one experiment with which most cells are known."""
    every = [problem.made(problem.repeat(one, problem.most)) for one in range(len(problem.costs))]
    return min(every, key=lambda each: (-each.share, each.cost))


def _first(problem: SetProblem, chosen: ExperimentSet) -> int:
    """Return the experiment of a set that tells most by itself."""
    return _best(problem, np.flatnonzero(chosen.counts))


def _best(problem: SetProblem, offers: IntArray) -> int:
    """Return the experiment after which cells are known best, on a mean."""
    return int(min(offers, key=lambda index: _unknown(problem, problem.repeat(index))))


def _hardest(problem: SetProblem, offer: int) -> IntArray:
    """Return the cells in the order of what an experiment leaves unknown, the worst first."""
    return np.argsort(-_worst(problem, problem.repeat(offer)), kind="stable")


def _unknown(problem: SetProblem, counts: IntArray) -> float:
    """Return the mean over cells of the logarithm of the worst variance."""
    return round(float(_worst(problem, counts).mean()), 9)


def _worst(problem: SetProblem, counts: IntArray) -> Array:
    """Return the logarithm of the worst variance of each cell, (n_cells,)."""
    variances = np.diagonal(problem.covariances(counts), axis1=1, axis2=2)[:, problem.targets]
    return np.round(np.log(variances.max(axis=1)), 9)


def _one_by_one(
    problem: SetProblem,
    population: DesignInputs,
    offers: list[Offer],
    first: int,
    ends: tuple[Array, Array],
    rng: np.random.Generator,
) -> list[Round]:
    """Choose experiments one after the other, each for the cell as those before show it.

    Estimates scatter as information says, within the ranges. The first experiment is given;
    the next is the one that tells most of the cheapest set that would be enough for the estimate. A
    cell has no more experiments once it would be known if it were as estimated.
    """
    truth = np.log(population.parameters)
    # Whether the jaws press is seen, whatever the estimate.
    pressed: BoolArray = np.any(problem.information != 0, axis=(2, 3))
    counts = np.zeros((len(truth), len(offers)), dtype=np.intp)
    counts[:, first] = 1
    unknown = np.arange(len(truth))
    rounds: list[Round] = []
    for done in range(1, problem.most + 1):
        so_far = np.einsum("ce,ecpq->cpq", counts, problem.information) + problem.before
        cost = float((counts @ problem.costs).mean())
        rounds.append(Round(cost, float(problem.are_known(inverted(so_far)).mean())))
        if done == problem.most:
            break
        estimates = _estimates(truth[unknown], so_far[unknown], ends, rng)
        own = replace(population, parameters=np.exp(estimates))
        information = np.stack([_information(own, each.plan) for each in offers])
        information *= pressed[:, unknown, None, None]
        there = np.einsum("ce,ecpq->cpq", counts[unknown], information) + problem.before
        going = np.flatnonzero(~problem.are_known(inverted(there)))
        if not len(going):
            break
        for row in going:
            further = replace(
                problem,
                information=information[:, [row]],
                most=problem.most - done,
                before=there[[row]],
            )
            best = further.cheapest(1)
            some = np.flatnonzero(best.counts) if best else np.arange(len(offers))
            counts[unknown[row], _best(further, some)] += 1
        unknown = unknown[going]
    return rounds


def _estimates(
    truth: Array, information: Array, ends: tuple[Array, Array], rng: np.random.Generator
) -> Array:
    """Draw estimates of log-parameters, (n, n_parameters), within the ranges."""
    # Where nothing is told, anything within the ranges may be estimated.
    least = NO_BOUND**-2 * np.eye(truth.shape[1])
    roots = np.linalg.cholesky(information + least).swapaxes(1, 2)
    scatter = np.linalg.solve(roots, rng.standard_normal((*truth.shape, 1)))
    return np.clip(truth + scatter[..., 0], *ends)
