"""Designs in config/designed.yaml: within their own limits, hardly anything is better."""

from functools import cache, partial

import numpy as np
import pytest

from biogrip.design.neighbours import drawn_neighbour, random_train, train_of
from biogrip.design.rating import Rater
from biogrip.design.schedule import presses
from biogrip.design.set_values import set_values
from biogrip.design.waveform import hold
from biogrip.study.design_inputs import make_design_inputs
from biogrip.study.load import load_study, read_configs
from biogrip.study.study import Study
from tests.helpers.places import CONFIG

# Neighbours and random trains of each. Ratings are known to 2e-4, and of 5,000 neighbours some are
# better by 1e-4.
TRIED, BETTER = 60, 3e-4
# Readings of a list are whole and in few bursts, and tell less than is rated by about 1e-3.
ROUNDED = 3e-3


@cache
def _study() -> Study:
    files = [CONFIG, *(CONFIG.parent / name for name in ("design.yaml", "designed.yaml"))]
    return load_study(read_configs(files), files)


@pytest.mark.parametrize("case_name", ["liquid_drop_1", "liquid_drop_2", "endothelial_cell"])
def test_no_train_beside_it_or_at_random_is_better(case_name: str) -> None:
    case = _study().cases[case_name]
    inputs = make_design_inputs(case)
    rater = Rater(inputs, margin=0.0)
    rate = partial(rater.rate, gap=2e-4, most=100)
    durations_s, torques = np.array(
        [(phase.duration_s, phase.left.value_Nm) for phase in case.phases]
    ).T
    published = train_of(hold(durations_s, torques), inputs.limits)
    assert len(case.phases) <= inputs.limits.most_steps
    assert torques.max() <= inputs.largest_Nm
    assert presses(inputs, case.phases)
    history = inputs.history(case.phases)
    rows = inputs.sensitivities(history, case.sampling.over(history.end_s))
    promised = inputs.typical_bound(rows @ rows.swapaxes(1, 2))
    rated = rate(published.waveform(inputs.limits))
    assert np.log(promised) == pytest.approx(rated.logarithm, abs=ROUNDED)
    rng = np.random.default_rng(1)
    waveforms = [random_train(inputs.limits, rng).waveform(inputs.limits) for _ in range(TRIED)]
    ratings = [(waveform, rate(waveform)) for waveform in waveforms]
    for _ in range(TRIED):
        other = drawn_neighbour(published, inputs.limits, rng)
        assert other is not None
        waveform = other.train.waveform(inputs.limits)
        ratings.append((waveform, rate(waveform, start=partial(rated.carried, other.origins))))
    better = [
        set_values(inputs, rater.torque(waveform))
        for waveform, found in ratings
        if found.logarithm < rated.logarithm - BETTER
    ]
    assert not any(presses(inputs, phases) for phases in better)
