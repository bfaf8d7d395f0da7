import numpy as np
import pytest

from biogrip.experiment.noise import Noise, add_noise, rms

CLEAN = np.concatenate((np.zeros(100_000), np.full(100_000, 2.0)))


def noise_of(kind: str, reference: str) -> np.ndarray:
    rng = np.random.default_rng(0)
    return add_noise(CLEAN, Noise(kind, 0.1, reference), rng) - CLEAN


@pytest.mark.parametrize("kind", ["gaussian", "uniform"])
def test_level_is_the_standard_deviation_over_the_peak(kind: str) -> None:
    noise = noise_of(kind, "peak")
    # 2e5 samples: the standard deviation is known to 0.2 %, three times that is allowed.
    assert rms(noise) == pytest.approx(0.2, rel=6e-3)
    assert rms(noise[:100_000]) == pytest.approx(rms(noise[100_000:]), rel=2e-2)


def test_proportional_noise_vanishes_with_the_signal() -> None:
    noise = noise_of("gaussian", "signal")
    assert np.all(noise[:100_000] == 0)
    assert rms(noise[100_000:]) == pytest.approx(0.2, rel=1e-2)


def test_uniform_noise_is_bounded() -> None:
    bound = 0.2 * np.sqrt(3)
    noise = noise_of("uniform", "peak")
    assert 0.999 * bound < np.abs(noise).max() <= bound * (1 + 1e-12)


def test_the_peak_is_the_largest_rotation_either_way() -> None:
    """Unequal torques can turn an arm the other way."""
    rng = np.random.default_rng(0)
    noisy = add_noise(-CLEAN, Noise("gaussian", 0.1, "peak"), rng)
    assert rms(noisy + CLEAN) == pytest.approx(0.2, rel=6e-3)


def test_an_instruments_noise_does_not_depend_on_the_sample() -> None:
    noise = Noise("uniform", 0.1, "peak", 3e-6)
    for size in (1e-5, 3e-3):
        rng = np.random.default_rng(0)
        assert rms(add_noise(size * CLEAN, noise, rng) - size * CLEAN) == pytest.approx(
            3e-6, rel=6e-3
        )
    assert not noise.absent
    for nothing in (Noise("gaussian", 0.0, "peak"), Noise("gaussian", 0.1, "peak", 0.0)):
        assert nothing.absent
        np.testing.assert_array_equal(add_noise(CLEAN, nothing, rng), CLEAN)
