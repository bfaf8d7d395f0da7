import numpy as np

from biogrip.physics.protocol import hold, sample_times, torque_at, torque_history

PAPER = (hold(200.0, 1.6e-9), hold(200.0, 0.32e-9))


def test_steps_add_up_to_the_torque() -> None:
    steps = torque_history(PAPER)
    np.testing.assert_array_equal(steps.time_s, [0.0, 200.0])
    np.testing.assert_allclose(np.cumsum(steps.left[:, 0]), [1.6e-9, 0.32e-9], rtol=1e-15)
    assert steps.symmetric


def test_torque_at_a_step_is_the_one_after_it() -> None:
    torque = torque_at(torque_history(PAPER), [-1.0, 0.0, 199.9, 200.0, 400.0])
    np.testing.assert_allclose(torque, [0.0, 1.6e-9, 1.6e-9, 0.32e-9, 0.32e-9], rtol=1e-12)


def test_the_paper_records_4001_samples() -> None:
    times = sample_times(torque_history(PAPER).end_s, 10.0)
    assert len(times) == 4001
    assert times[-1] == 400.0


def test_rounding_does_not_lose_the_last_sample() -> None:
    """0.3 s at 10 Hz: 0.3 * 10 is 2.9999999999999996 in doubles."""
    assert len(sample_times(0.1 + 0.2, 10.0)) == 4
    assert len(sample_times(0.3, 10.0)) == 4
