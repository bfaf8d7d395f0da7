"""What a rating may not depend on: how a torque is divided into steps, and where bins begin."""

import numpy as np
import pytest

from biogrip.arrays import Array
from biogrip.design.cell_responses import compute_cell_responses
from biogrip.design.rating import Rater
from biogrip.design.schedule import sampled
from biogrip.design.time_bins import time_bins
from biogrip.design.views import Views
from biogrip.design.waveform import Waveform, hold
from biogrip.experiment.protocol import hold as hold_load
from biogrip.instrument.gripper import GRIPPER, Gripper
from tests.design.test_climb import SECOND
from tests.design.test_views import MODEL, SAMPLES, WAVEFORMS

FASTEST_HZ = 1e5
LEVELS = np.array([8.0, 5.4, 8.0, 7.7, 7.5])


def bound(durations_s: Array, levels: Array) -> float:
    rated = Rater(SECOND, margin=0.0).rate(hold(durations_s, levels), gap=2e-4, most=100)
    return float(np.exp(rated.logarithm))


@pytest.mark.parametrize("last_s", [111.85, 123.4, 150.0, 184.0])
def test_a_step_cut_in_two_is_rated_alike(last_s: float) -> None:
    durations_s = np.array([79.48, 0.01, 320.24 - last_s, 0.27, last_s])
    whole = bound(durations_s, LEVELS)
    for part in (0.1, 0.5, 0.93):
        cut_s = np.round(durations_s[-1] * part, 2)
        cut = bound(np.append(durations_s[:-1], [cut_s, last_s - cut_s]), LEVELS[[*range(5), 4]])
        assert cut == pytest.approx(whole, rel=3e-3)


@pytest.mark.parametrize("last_s", [111.85, 150.0, 184.0])
def test_a_list_of_readings_keeps_what_its_torque_is_rated_at(last_s: float) -> None:
    durations_s = np.array([79.48, 0.01, 320.24 - last_s, 0.27, last_s])
    phases = tuple(map(hold_load, durations_s.tolist(), (1e-9 * LEVELS).tolist()))
    listed = SECOND.typical_bound(sampled(SECOND, phases).information)
    assert listed == pytest.approx(bound(durations_s, LEVELS), rel=3e-3)


@pytest.mark.parametrize("name", ["steps", "ramps"])
def test_every_slot_is_in_one_bin(gripper: Gripper, name: str) -> None:
    """And the response in each bin is that at its middle."""
    waveform: Waveform = WAVEFORMS[name]
    bins = time_bins(round(30.0 * FASTEST_HZ), 1.2)
    views = Views(gripper, MODEL, SAMPLES, bins.middle / FASTEST_HZ, GRIPPER)
    found = compute_cell_responses(views, bins, waveform, FASTEST_HZ, 0.0)
    slots = np.rint(waveform.durations_s * FASTEST_HZ)
    starts_s = np.append(0.0, np.cumsum(waveform.durations_s))
    for step, count in enumerate(slots):
        here = found.steps == step
        # The slot of the step itself still shows what was before.
        assert found.capacity[here].sum() == count - 1
        assert len(set(found.places[here])) == here.sum()
        after_s = found.middle_s[here] - starts_s[step]
        assert 0 < after_s.min() <= after_s.max() < waveform.durations_s[step]
        alone = views.under(waveform).respond(np.array([step]), after_s)
        largest = np.abs(alone.sensitivity).max()
        np.testing.assert_allclose(
            found.sensitivity[:, :, here], alone.sensitivity[:, :, 0], atol=1e-10 * largest
        )
