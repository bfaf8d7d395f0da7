"""Our genetic algorithm on many traces side by side, as the study identifies."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from benchmarks.setup import Problem
from biogrip.identify.genetic import evolve_many
from biogrip.identify.genetic_settings import GeneticSettings
from biogrip.response.misfit import combine_misfits

BATCH = 25


def in_batch(problems: Sequence[Problem], settings: GeneticSettings) -> list[float]:
    """Identify from the traces to the answers, with generators of seeds 0, 1, ...; the misfits."""
    # As in the study, where they are traces of one case: what is not one is not taken together.
    first = problems[0]
    alike = [replace(p, model=first.model, steps=first.steps) for p in problems]
    misfits = combine_misfits([p.misfit() for p in alike])
    rngs = [np.random.default_rng(seed) for seed in range(len(problems))]
    found = evolve_many(misfits, problems[0].genome, settings, rngs)
    return [evolution.identification.misfit_rad for evolution in found]
