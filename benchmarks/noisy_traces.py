"""The problem that all benchmarks share: noisy traces of the default study's cell."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import yaml

from biogrip.arrays import Array
from biogrip.fit.experiment import Experiment
from biogrip.fit.problem import TraceProblem
from biogrip.physics.condensed import Condensed
from biogrip.physics.gripper import Gripper
from biogrip.physics.instruments import GRIPPER
from biogrip.physics.noise import add_noise, nuisance_basis, rms
from biogrip.physics.protocol import Course, join_phases
from biogrip.physics.residuals import CondensedTrace, Residuals
from biogrip.physics.response import step_response, superpose
from biogrip.physics.sample_model import SampleModel
from biogrip_study.config.study import Case, load_study
from biogrip_study.methods.genetic import GeneticSettings
from biogrip_study.methods.genome import Genome
from biogrip_study.methods.misfit import series_of

CONFIG = Path(__file__).parents[1] / "config" / "config.yaml"
BATCH = 25
"""Traces that are identified side by side."""
OURS, SIDE_BY_SIDE = "biogrip", f"biogrip, {BATCH} traces side by side"
"""In the tables."""


@cache
def case() -> Case:
    """Return the endothelial cell of the default study."""
    return load_study(yaml.safe_load(CONFIG.read_text()), [CONFIG]).cases["endothelial_cell"]


@cache
def _posed() -> Experiment:
    return case().experiment.to_identify()


@cache
def _clean() -> tuple[Course, Array, Array]:
    steps = join_phases(case().phases)
    time_s = case().times_s
    model = case().sample.model
    truth = np.array([case().parameters[name] for name in model.names])
    response = step_response(case().gripper, model.network(truth))
    return steps, time_s, superpose(response, steps, time_s)[0]


@cache
def _condensed() -> Condensed:
    steps, time_s, _ = _clean()
    return Condensed(steps, time_s, nuisance_basis(time_s, offset=False, drift=False))


@dataclass(frozen=True)
class NoisyTrace:
    """One noisy trace, (n_samples,), and what it takes to identify its sample."""

    gripper: Gripper
    model: SampleModel
    steps: Course
    time_s: Array
    trace_rad: Array
    noise_rms_rad: float
    genome: Genome
    genetic: GeneticSettings

    def misfit(self) -> Callable[[Array], Array]:
        """Return the study's misfit of a population against the trace."""
        trace = CondensedTrace(self.trace_rad, _condensed())
        residuals = Residuals(self.gripper, self.model, self.steps, trace, instrument=GRIPPER)
        return series_of([residuals]) or residuals.misfit

    def problem(self) -> TraceProblem:
        """Pose the identification as the study does."""
        return _posed().of(self.time_s, self.trace_rad, condensed=_condensed())


def noisy_trace(seed: int = 0) -> NoisyTrace:
    """Return the cell's trace with the noise of a seed."""
    steps, time_s, clean = _clean()
    trace_rad = add_noise(clean, case().noise, np.random.default_rng(seed))
    model, genetic = case().sample.model, case().block.method("genetic")
    return NoisyTrace(
        case().gripper,
        model,
        steps,
        time_s,
        trace_rad,
        rms(trace_rad - clean),
        Genome(tuple(case().experiment.ranges[p.range_name] for p in model.parameters)),
        genetic,
    )
