from decimal import Decimal

import numpy as np
import pytest

from biogrip.fit.genome import GeneRange, make_genome, nearest_encodable
from biogrip.physics.models import MODELS

STIFFNESS, DAMPING = GeneRange((-3, 8), (1, 9)), GeneRange((-4, 5), (1, 9))
RANGES = {"k": STIFFNESS, "k_p": STIFFNESS, "c": DAMPING, "c_p": DAMPING}
GENOME = make_genome(MODELS["generalized_maxwell"], RANGES)


def test_genes_are_drawn_uniformly_from_their_whole_range() -> None:
    chromosomes = GENOME.draw(20_000, np.random.default_rng(1))
    assert (GENOME.low[:3].tolist(), GENOME.high[:3].tolist()) == ([-3, 1, 1], [8, 9, 9])
    for gene in range(GENOME.genes):
        values, counts = np.unique(chromosomes[:, gene], return_counts=True)
        assert values.tolist() == list(range(GENOME.low[gene], GENOME.high[gene] + 1))
        expected = 20_000 / len(values)
        assert np.abs(counts - expected).max() < 5 * np.sqrt(expected)


@pytest.mark.parametrize("digits", range(1, 7))
@pytest.mark.parametrize("digit", [(1, 9), (0, 9), (3, 5)])
def test_any_number_of_digits_is_decoded_as_the_decimal_number_it_is(
    digits: int, digit: tuple[int, int]
) -> None:
    ranges = {**RANGES, "k": GeneRange((-16, 16), digit, digits)}
    genome = make_genome(MODELS["generalized_maxwell"], ranges)
    assert genome.genes == 9 + 1 + digits
    chromosomes = genome.draw(300, np.random.default_rng(digits))
    # Lest numbers were encoded twice.
    assert np.all(chromosomes[:, 1] > 0)
    decoded = genome.decode(chromosomes)
    for genes, value in zip(chromosomes[:, : 1 + digits].tolist(), decoded[:, 0], strict=True):
        share = sum(Decimal(g) * Decimal(10) ** -place for place, g in enumerate(genes[1:], 1))
        assert value == float(share * Decimal(10) ** genes[0])
    assert genome.decode(np.stack((genome.low, genome.high)))[:, 0].tolist() == [
        ranges["k"].low,
        ranges["k"].high,
    ]


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
