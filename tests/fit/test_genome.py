from decimal import Decimal

import numpy as np
import pytest

from biogrip.fit.genome import GeneRange, make_genome, nearest_encodable
from biogrip.physics.models import MODELS

STIFFNESS, DAMPING = GeneRange((-3, 8), (1, 9)), GeneRange((-4, 5), (1, 9))
RANGES = {"k": STIFFNESS, "k_p": STIFFNESS, "c": DAMPING, "c_p": DAMPING}
GENOME = make_genome(MODELS["generalized_maxwell"], RANGES)


def test_ranges_are_those_of_table_4() -> None:
    assert (STIFFNESS.low, STIFFNESS.high) == (1.1e-4, 9.9e7)
    assert (DAMPING.low, DAMPING.high) == (1.1e-5, 9.9e4)


def test_genes_are_drawn_uniformly_from_their_whole_range() -> None:
    chromosomes = GENOME.draw(20_000, np.random.default_rng(1))
    for gene in range(GENOME.genes):
        values, counts = np.unique(chromosomes[:, gene], return_counts=True)
        assert values.tolist() == list(range(GENOME.low[gene], GENOME.high[gene] + 1))
        expected = 20_000 / len(values)
        assert np.abs(counts - expected).max() < 5 * np.sqrt(expected)


def test_a_model_with_fewer_parameters_has_fewer_genes() -> None:
    assert make_genome(MODELS["liquid_drop"], RANGES).genes == 9


@pytest.mark.parametrize("digits", range(1, 7))
@pytest.mark.parametrize("digit", [(1, 9), (0, 9), (3, 5)])
def test_any_number_of_digits_is_decoded_as_the_decimal_number_it_is(
    digits: int, digit: tuple[int, int]
) -> None:
    ranges = {**RANGES, "k": GeneRange((-16, 16), digit, digits)}
    genome = make_genome(MODELS["generalized_maxwell"], ranges)
    assert genome.genes == 9 + 1 + digits
    chromosomes = genome.draw(300, np.random.default_rng(digits))
    decoded = genome.decode(chromosomes)
    for genes, value in zip(chromosomes[:, : 1 + digits].tolist(), decoded[:, 0], strict=True):
        share = sum(Decimal(g) * Decimal(10) ** -place for place, g in enumerate(genes[1:], 1))
        assert value == float(share * Decimal(10) ** genes[0])
    assert genome.decode(np.stack((genome.low, genome.high)))[:, 0].tolist() == [
        ranges["k"].low,
        ranges["k"].high,
    ]


def test_a_first_digit_is_never_zero_lest_numbers_were_encoded_twice() -> None:
    genome = make_genome(MODELS["damper"], {"c_p": GeneRange((0, 0), (0, 9), 3)})
    first, second, third = (genome.draw(5000, np.random.default_rng(0))[:, g] for g in (1, 2, 3))
    assert (set(first), set(second), set(third)) == ({*range(1, 10)}, *[{*range(10)}] * 2)


@pytest.mark.parametrize("value", [1e-9, 0.0999, 10.0, 12.34567, 302.5, 1.0e12])
@pytest.mark.parametrize("digits", [1, 3, 4])
def test_nearest_encodable_is_the_nearest_of_all(value: float, digits: int) -> None:
    genes = GeneRange((-2, 4), (0, 9), digits)
    every = [
        float(f"{mantissa}e{exponent - digits}")
        for mantissa in range(10 ** (digits - 1), 10**digits)
        for exponent in range(-2, 5)
    ]
    nearest = min(abs(each - value) for each in every)
    assert abs(nearest_encodable(value, genes) - value) == nearest
