"""The problem that all benchmarks share: one noisy trace of the default study."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml

from biogrip.arrays import Array
from biogrip.experiment.noise import add_noise, rms
from biogrip.experiment.protocol import TorqueHistory, sample_times, torque_history
from biogrip.experiment.sample import Sample, SampleModel
from biogrip.identify.answer import Identification
from biogrip.identify.genetic import evolve_many
from biogrip.identify.genetic_settings import GeneticSettings
from biogrip.identify.genome import GeneRange, Genome, make_genome
from biogrip.identify.problem import Problem as Posed
from biogrip.identify.problem import make_problem
from biogrip.instrument.gripper import GRIPPER, Gripper
from biogrip.response.condensed import Condensed
from biogrip.response.linear import rotation, step_response
from biogrip.response.misfit import Misfit, combine_misfits, make_misfit
from biogrip.response.nuisance import nuisance_basis
from biogrip.response.residuals import Residuals
from biogrip.study.case_blocks import CaseBlock
from biogrip.study.load import load_study

CONFIG = Path(__file__).parents[1] / "config" / "config.yaml"
CASE = "endothelial_cell"
POPULATION = 500
NEAR_NOISE = 0.02
"""Misfits up to this share above the noise count as at its floor, as in the study."""


@dataclass(frozen=True)
class Problem:
    """One noisy trace, and what it takes to identify its sample.

    Parameters
    ----------
    gripper, model, steps
        What is simulated.
    truth : (n_parameters,)
        The sample that made the trace.
    time_s, trace_rad : (n_samples,)
        The trace.
    noise_rms_rad
        RMS of the noise in it.
    ranges, genome, genetic
        Where and how the study searches.
    settings
        Those of the study's methods.
    """

    gripper: Gripper
    model: SampleModel
    steps: TorqueHistory
    truth: Array
    time_s: Array
    trace_rad: Array
    noise_rms_rad: float
    ranges: dict[str, GeneRange]
    genome: Genome
    genetic: GeneticSettings
    settings: CaseBlock

    @property
    def interval_s(self) -> float:
        """Sampling interval."""
        return float(self.time_s[1])

    def misfit(self, *, nonlinear: bool = False) -> Callable[[Array], Array]:
        """Return the study's misfit of a population against the trace."""
        given = self.steps, self.time_s, self.trace_rad
        condensed = self.condensed(nonlinear=nonlinear)
        residuals = Residuals(self.gripper, self.model, *given, condensed, instrument=GRIPPER)
        return make_misfit(residuals, self.gripper, *given)

    def condensed(self, *, nonlinear: bool = False) -> Condensed:
        """What stands for the samples of all traces of the case."""
        none = nuisance_basis(self.time_s, offset=False, drift=False)
        return Condensed(self.steps, self.time_s, none, nonlinear=nonlinear)

    def case_problem(self, condensed: Condensed | None = None) -> Posed:
        """Pose the identification as the study does."""
        return make_problem(
            self.gripper,
            self.model,
            self.steps,
            self.time_s,
            self.trace_rad,
            self.ranges,
            condensed or self.condensed(),
            instrument=GRIPPER,
        )

    def population(self, count: int = POPULATION) -> Array:
        """Samples drawn uniformly from the search range, shape (count, n_parameters)."""
        return self.genome.decode(self.genome.draw(count, np.random.default_rng(1)))


def evolve(
    misfit: Misfit, genome: Genome, settings: GeneticSettings, rng: np.random.Generator
) -> Identification:
    """Run our genetic algorithm on any misfit of parameters of shape (n, n_parameters)."""
    return evolve_many(combine_misfits([misfit]), genome, settings, [rng])[0].identification


def problem(
    seed: int = 0, *, case: str = CASE, rate_Hz: float | None = None, branches: int = 1
) -> Problem:
    """Return a case of the default study with the noise of a seed.

    Parameters
    ----------
    seed
        Of the noise.
    case
        Which case.
    rate_Hz
        Sampling rate, if not the study's.
    branches
        Maxwell branches of the sample model that is identified; the sample
        itself keeps its own.
    """
    study = load_study(yaml.safe_load(CONFIG.read_text()), [CONFIG])
    chosen = study.cases[case]
    gripper, steps = chosen.gripper, torque_history(chosen.phases)
    time_s = sample_times(steps.end_s, rate_Hz or chosen.sampling.rate_Hz)
    own = chosen.sample.model
    truth = np.array([chosen.parameters[name] for name in own.names])
    clean = rotation(step_response(gripper, own.network(truth)), steps, time_s)[0]
    trace = add_noise(clean, chosen.noise, np.random.default_rng(seed))
    model = Sample(chosen.sample.name, branches).model
    ranges = chosen.ranges
    genetic = chosen.method("genetic")
    assert isinstance(genetic, GeneticSettings)
    return Problem(
        gripper,
        model,
        steps,
        truth,
        time_s,
        trace,
        rms(trace - clean),
        ranges,
        make_genome(model, ranges),
        genetic,
        chosen.block,
    )


def posed_together(problems: Sequence[Problem], condensed: Condensed | None = None) -> list[Posed]:
    """Pose the identification of traces of one case, condensed once for all as in the study."""
    condensed = condensed or problems[0].condensed()
    return [p.case_problem(condensed) for p in problems]
