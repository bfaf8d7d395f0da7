"""Designs in config/designed.yaml: within their own limits, hardly anything is better."""

from functools import cache

import numpy as np
import pytest

from biogrip.design.neighbours import Train, neighbour, random_train, train_of
from biogrip.design.rating import Rater
from biogrip.design.schedule import presses
from biogrip.design.set_values import set_values
from biogrip.design.waveform import hold
from biogrip.study.design_inputs import make_design_inputs
from biogrip.study.load import load_study, read_configs
from biogrip.study.study import Study
from tests.helpers.places import CONFIG

# Neighbours and random trains of each; of thousands, some neighbours are better by a tenth of a
# percent, and readings of a list tell less than those of its cells by as much.
TRIED, BETTER = 40, 5e-3


@cache
def _study() -> Study:
    files = [CONFIG, *(CONFIG.parent / name for name in ("design.yaml", "designed.yaml"))]
    return load_study(read_configs(files), files)


@pytest.mark.parametrize("case_name", ["liquid_drop_1", "liquid_drop_2", "endothelial_cell"])
def test_no_train_beside_it_or_at_random_is_better(case_name: str) -> None:
    case = _study().cases[case_name]
    inputs = make_design_inputs(case)
    rater = Rater(inputs)
    durations_s, torques = np.array(
        [(phase.duration_s, phase.left.value_Nm) for phase in case.phases]
    ).T
    published = train_of(hold(durations_s, torques), inputs.limits)
    assert len(case.phases) <= inputs.limits.most_steps
    assert torques.max() <= inputs.largest_Nm
    history = inputs.history(case.phases)
    rows = inputs.sensitivities(history, case.sampling.over(history.end_s))
    promised = inputs.typical_bound(rows @ rows.swapaxes(1, 2))
    rng = np.random.default_rng(1)

    def logarithm(train: Train) -> float:
        return rater.rate(train.waveform(inputs.limits), gap=5e-4, most=100).logarithm

    others = [neighbour(published, inputs.limits, rng) for _ in range(TRIED)]
    trains = [other.train for other in others if other is not None]
    trains += [random_train(inputs.limits, rng) for _ in range(TRIED)]
    better = [train for train in trains if logarithm(train) < np.log(promised) - BETTER]
    torques_of = [rater.torque(train.waveform(inputs.limits)) for train in better]
    assert not any(presses(inputs, set_values(inputs, torque)) for torque in torques_of)
