"""Sequences of experiments with a simulated cell, planned in four ways."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from math import sqrt
from pathlib import Path

import numpy as np

from biogrip.arrays import Array
from biogrip.design.earlier_traces import Earlier, estimate_from_traces
from biogrip.design.experiment import DesignInputs, Experiment
from biogrip.design.replicates import joint_problem
from biogrip.design.schedule import presses
from biogrip.design.within_reach import plan_within_reach
from biogrip.experiment.random_streams import stream
from biogrip.experiment.sampling import Sampling
from biogrip.identifiability.likelihood import MISSED, make_likelihood
from biogrip.identifiability.limits import find_limits
from biogrip.identifiability.quantities import parameters_and_sum
from biogrip.identify.answer import Identification, silent
from biogrip.identify.case_problem import CaseProblem
from biogrip.identify.identifier import best_fit
from biogrip.identify.methods import METHODS
from biogrip.identify.multi_start import fit_from
from biogrip.identify.problem import Problem
from biogrip.products.files.sequences import SEQUENCES
from biogrip.products.plan import Plan, Wildcards
from biogrip.products.product import Product, Weight
from biogrip.products.uses import using
from biogrip.progress import Progress
from biogrip.response.simulation import simulated_rotation
from biogrip.study.design_inputs import make_design_inputs, plausible_ends
from biogrip.study.study import Case, Study

REPEATED, AFTER, BEFOREHAND, TRUTH = WAYS = ("repeated", "after", "beforehand", "truth")
"""Ways: the config's experiment repeated; that once, then experiments each designed from all
earlier traces; one designed for the ranges, repeated; one designed for the cell, repeated."""


@dataclass(frozen=True)
class Sequences:
    """Sequences of experiments with the cells of one case."""

    case: Case
    """The case; its protocol and sampling are the first experiment, with known noise."""
    inputs: DesignInputs
    """Inputs of designs for the ranges."""
    low: Array
    """Lower log bounds between which cells are drawn."""
    high: Array
    """Upper ones."""
    within: tuple[Array, Array]
    """Log bounds of the prior."""
    experiments: int
    """Number of experiments in a sequence."""


def sequenced(study: Study) -> list[str]:
    """Return the simulated cases whose `design` block asks for sequences."""
    return [name for name in study.simulated if cells_of(study.cases[name])]


def cells_of(case: Case) -> int:
    """Return the number of cells whose sequences are simulated."""
    block = case.block.design
    return block.sequence.cells if block and block.sequence else 0


def _problem(case: Case) -> CaseProblem:
    return replace(case.problem, noise_rad=case.design.noise_level)


_CASE = using(
    "name sampling design.candidates design.plausible_samples least_squares confidence "
    "study.study_seed",
    problem=_problem,
)


def sequences(study: Study, job: Wildcards) -> Sequences:
    """Return the sequences of a job's case."""
    case = study.case(job["case"])
    ranges, block = case.design.ranges or {}, case.design.sequence
    assert block is not None
    low, high = plausible_ends(case)
    names = case.searched.names
    spread = np.array([name in ranges for name in names])
    as_in_config = np.log([case.parameters[name] for name in names])
    return Sequences(
        _CASE(case),
        make_design_inputs(case),
        np.where(spread, low, as_in_config),
        np.where(spread, high, as_in_config),
        (low, high),
        block.experiments,
    )


def sequence(planned: Sequences, seed: int, rows: Path) -> None:
    """Simulate sequences of experiments with one cell, in all four ways."""
    SEQUENCES.write(rows, _Cell(planned, seed).rows())


@dataclass(frozen=True)
class _Known:
    """Joint fit problem of all traces so far, its noise, and the best fit."""

    problem: Problem
    noise_rad: float
    best: Array
    misfit_rad: float


class _Cell:
    """A simulated cell, whose sequences of experiments are simulated in four ways."""

    def __init__(self, planned: Sequences, number: int) -> None:
        self._planned, self._case, self._number = planned, planned.case, number
        self._truth = self._stream("cell").uniform(planned.low, planned.high)

    def rows(self) -> Iterator[tuple[str | int, ...]]:
        case, inputs = self._case, self._planned.inputs
        first = case.problem.phases, case.sampling
        progress = Progress(f"{case.name}, cell {self._number}", len(WAYS))
        yield from self._rows_of(REPEATED, [first], self._repeated(REPEATED, first))
        progress.done()
        planned: list[Experiment] = [first]
        yield from self._rows_of(AFTER, planned, self._one_after_another(planned))
        progress.done()
        for way, samples in (
            (BEFOREHAND, inputs.parameters),
            (TRUTH, np.exp(self._truth)[None]),
        ):
            best = self._designed(way, replace(inputs, parameters=samples))
            yield from self._rows_of(way, [best], self._repeated(way, best))
            progress.done()

    def _repeated(self, way: str, experiment: Experiment) -> Iterator[_Known]:
        """Yield results of one experiment repeated; the mean trace has all the information."""
        total = np.zeros(())
        for count in range(1, self._planned.experiments + 1):
            problem, time_s, trace = self._trace(way, count, experiment)
            total = total + trace
            noise_rad = self._planned.inputs.noise_rad / sqrt(count)
            mean = problem.of(time_s, total / count, noise_rad=noise_rad)
            found = self._identify(way, count, mean)
            yield _Known(mean, noise_rad, np.log(found.parameters), found.misfit_rad)

    def _one_after_another(self, done: list[Experiment]) -> Iterator[_Known]:
        """Yield results of experiments each designed from all earlier ones, extending `done`."""
        planned, noise_rad = self._planned, self._planned.inputs.noise_rad
        problems: list[Problem] = []
        earlier: Earlier | None = None
        for count in range(1, self._planned.experiments + 1):
            if earlier is not None:
                inputs = replace(
                    planned.inputs, parameters=earlier.parameters, before=earlier.information
                )
                done.append(self._designed(f"{AFTER} {count}", inputs))
            case_problem, time_s, trace = self._trace(AFTER, count, done[-1])
            problems.append(case_problem.of(time_s, trace))
            joint = joint_problem(problems, count * [noise_rad])
            earlier = estimate_from_traces(
                joint,
                noise_rad,
                partial(self._identify, AFTER, count),
                planned.within,
                planned.case.design.plausible_samples,
                self._stream(f"{AFTER} {count}, drawn"),
                earlier,
            )
            yield _Known(joint, noise_rad, earlier.best, earlier.misfit_rad)

    def _trace(
        self, way: str, count: int, experiment: Experiment
    ) -> tuple[CaseProblem, Array, Array]:
        """Simulate a trace; return the fit problem's assumptions, times and rotation."""
        phases, sampling = experiment
        case_problem = replace(self._case.problem, phases=phases)
        time_s = sampling.over(case_problem.torque.end_s)
        network = case_problem.searched.network(np.exp(self._truth)[None])
        clean = simulated_rotation(
            case_problem.gripper, network, case_problem.torque, time_s, nonlinear=False
        )
        # The first trace is the same in all ways that start with the same experiment.
        rng = self._stream(f"{way if count > 1 else 'first'} {count}, noise")
        noise_rad = self._planned.inputs.noise_rad
        return case_problem, time_s, clean[0] + noise_rad * rng.standard_normal(len(time_s))

    def _designed(self, purpose: str, inputs: DesignInputs) -> Experiment:
        rng = self._stream(f"{purpose}, design")
        _, plan = plan_within_reach(inputs, self._case.design.candidates, rng, silent)
        return plan.phases, Sampling(bursts=plan.bursts)

    def _identify(self, way: str, count: int, problem: Problem) -> Identification:
        rng = self._stream(f"{way} {count}, starts")
        return best_fit(problem, self._case.least_squares, rng, silent)

    def _rows_of(
        self, way: str, done: list[Experiment], known: Iterator[_Known]
    ) -> Iterator[tuple[str | int, ...]]:
        case = self._case
        quantities = parameters_and_sum(case.problem.searched)[: len(self._truth)]
        for count, each in enumerate(known, 1):
            likelihood = make_likelihood(
                each.problem,
                each.best,
                each.misfit_rad,
                confidence=case.confidence,
                noise_rad=each.noise_rad,
            )
            limits = find_limits([likelihood], quantities)[0][0]
            better = fit_from([each.problem], self._truth)
            missed = int(likelihood.increase(float(better.misfit_rad[0])) < -MISSED)
            pressed = int(all(self._pressed(experiment) for experiment in done))
            head = case.name, self._number, way, count
            for quantity, ends in zip(quantities, limits, strict=True):
                logs = (quantity.log(self._truth), quantity.log(each.best), *ends)
                numbers = ["" if np.isnan(one) else f"{np.exp(one):.6g}" for one in logs]
                yield (*head, quantity.label, *numbers, missed, pressed)

    def _pressed(self, experiment: Experiment) -> bool:
        """Return True if the jaws press the cell throughout an experiment."""
        inputs = replace(self._planned.inputs, parameters=np.exp(self._truth)[None])
        return presses(inputs, experiment[0])

    def _stream(self, purpose: str) -> np.random.Generator:
        case = self._case
        return stream(case.study.study_seed, case.name, self._number, f"sequence, {purpose}")


def _jobs(plan: Plan) -> list[Wildcards]:
    return [
        {"case": name, "seed": str(cell)}
        for name in sequenced(plan.study)
        for cell in range(cells_of(plan.study.cases[name]))
    ]


SEQUENCE = Product(
    "sequence",
    {"rows": SEQUENCES.path},
    sequence,
    sequences,
    _jobs,
    message="Experiments one after another with cell {seed} of {case}",
    weight=Weight(20, 1000),
    modules=lambda _: (METHODS["least_squares"].module,),
)
