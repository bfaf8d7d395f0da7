"""What of the comparison with the field's libraries needs none of them."""

import numpy as np
import pytest

from benchmarks.field.elements import Maxwell
from benchmarks.field.traces import GRIPPER, SAMPLES, Trace, as_compliance
from biogrip.arrays import Array


@pytest.mark.parametrize("branches", SAMPLES)
def test_the_force_on_the_sample_is_the_given_one(branches: int) -> None:
    trace = Trace(branches, 0)
    compliance = trace.sample.compliance(trace.time_s)
    error = as_compliance(trace.clean_rad)[1:] / compliance - 1
    # What the hinges take of the torque, and a little more for the arms' damping.
    assert np.max(np.abs(error)) < 1.1 * GRIPPER.jaw_stiffness_N_per_m * compliance.max()
    assert np.max(np.abs(error)) < 1e-6


def _creep_of(sample: Maxwell, time_s: Array) -> Array:
    """Solve the network's equation for the strain under unit force by fine steps."""
    strain, inner = 1 / (sample.k_p + sample.k.sum()), np.zeros_like(sample.k)
    steps = 20
    found = []
    for before, after in zip(np.r_[0.0, time_s[:-1]], time_s, strict=True):
        h = (after - before) / steps
        for _ in range(steps):
            # Midpoint rule: each damper follows its branch's spring.
            middle = inner + 0.5 * h * (strain - inner) / sample.tau
            strain_there = (1 + sample.k @ middle) / (sample.k_p + sample.k.sum())
            inner = inner + h * (strain_there - middle) / sample.tau
            strain = (1 + sample.k @ inner) / (sample.k_p + sample.k.sum())
        found.append(strain)
    return np.array(found)


@pytest.mark.parametrize("sample", SAMPLES.values())
def test_compliance_is_the_networks(sample: Maxwell) -> None:
    time_s = np.linspace(0.5, 60.0, 120)
    np.testing.assert_allclose(sample.compliance(time_s), _creep_of(sample, time_s), rtol=1e-4)


@pytest.mark.parametrize("sample", SAMPLES.values())
def test_both_forms_are_the_same_sample(sample: Maxwell) -> None:
    back = sample.kelvin().maxwell()
    assert back is not None
    assert back.named() == pytest.approx(sample.named(), rel=1e-9)


def test_seeds_and_numbers_of_branches_have_noise_of_their_own() -> None:
    traces = [Trace(1, 0), Trace(1, 1), Trace(2, 0)]
    noise = [(trace.rotation_rad - trace.clean_rad) / trace.clean_rad.max() for trace in traces]
    correlation = np.corrcoef(noise)
    assert np.max(np.abs(correlation - np.eye(3))) < 0.2
    np.testing.assert_array_equal(Trace(1, 0).rotation_rad, traces[0].rotation_rad)
