"""How probable the paper's tables are together: limits, products, and what is compared."""

from itertools import product
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import beta

from biogrip.records.identifications import INTERPRETATIONS
from biogrip.records.rows import read_table
from biogrip.tables.layout import write
from tests.helpers.default import study_of
from workflow.paper.interpretations import (
    interpretations_jointly,
    limits,
    own_shares,
    share_not_larger,
)

OVERLAY = """
seeds: 4
methods: [genetic]
cases: {liquid_drop_2: null}
interpretations: {printed: {title: as printed, changes: {}}}
"""
# k, k_p, c, c_p of each seed.
CELL = (
    (35.0, 12.3, 299.9, 1.0),
    (32.8, 12.3, 302.5, 50.0),
    (32.8, 12.0, 302.5, 1e-3),
    (70.0, 12.3, 300.0, 1e-3),
)
DROP = (
    (9.5, 1e-4, 10.0, 1e-4),
    (6.7, 1.5e-4, 9.9, 1.0),
    (6.7, 1e-4, 5.0, 5.0),
    (0.1, 1e-4, 10.0, 1.0),
)


@pytest.fixture
def rows(tmp_path: Path) -> list[dict[str, str]]:
    files = []
    for case, seeds in (("endothelial_cell", CELL), ("liquid_drop_1", DROP)):
        found = (
            (case, "printed", seed, *values, 1.0, 1.0, 40) for seed, values in enumerate(seeds)
        )
        files.append(tmp_path / f"{case}.csv")
        INTERPRETATIONS.write(files[-1], found)
    study = study_of(OVERLAY).of(file.stem for file in files)
    write(interpretations_jointly(study, files), tmp_path / "t.csv")
    return read_table(tmp_path / "t.csv")


def test_only_seeds_that_are_close_in_all_parameters_count(rows: list[dict[str, str]]) -> None:
    """Two digits for 12.3, an error of k, or of c in place of c_p, are none; c_p does not count."""
    told = [(r["errors"], r["table"], r["as_close"], r["probability"]) for r in rows]
    assert told == [
        ("as small", "5", "2", "0.5"),
        ("as small", "6", "1", "0.25"),
        ("as small", "all", "", "0.125"),
        ("of the same order", "5", "3", "0.75"),
        ("of the same order", "6", "2", "0.5"),
        ("of the same order", "all", "", "0.375"),
    ]


def test_as_improbable_counts_combinations_of_seeds(rows: list[dict[str, str]]) -> None:
    shares = []
    for found, true in ((CELL, (35.0, 12.3, 299.9)), (DROP, (9.5, 1e-4, 10.0))):
        errors = np.abs(np.array(found)[:, :3] / true - 1)
        shares.append([np.mean([np.all(other <= mine) for other in errors]) for mine in errors])
    not_larger = np.mean([a * b <= 0.125 for a, b in product(*shares)])
    assert float(rows[2]["as_improbable"]) == pytest.approx(not_larger)
    assert rows[0]["as_improbable"] == rows[5]["as_improbable"] == ""


@pytest.mark.parametrize("found", [(31, 200), (1, 50), (0, 200), (200, 200)])
def test_limits_of_one_table_are_those_of_jeffreys(found: tuple[int, int]) -> None:
    low, high = beta.ppf([0.025, 0.975], found[0] + 0.5, found[1] - found[0] + 0.5)
    expected = (low if found[0] else 0.0, high if found[0] < found[1] else 1.0)
    assert limits([found]) == pytest.approx(expected, rel=5e-3)


def test_limits_of_a_product_are_those_of_random_draws() -> None:
    counts = [(31, 200), (17, 200), (36, 200)]
    rng = np.random.default_rng(1)
    draws = np.prod([rng.beta(n + 0.5, m - n + 0.5, 400_000) for n, m in counts], axis=0)
    assert limits(counts) == pytest.approx(tuple(np.quantile(draws, (0.025, 0.975))), rel=0.01)


def test_of_runs_as_likely_as_any_a_share_is_as_improbable() -> None:
    """Of one table it is the share itself; of many continuous ones it is below Fisher's."""
    shares = own_shares(np.random.default_rng(2).random((1, 400)))
    assert share_not_larger([shares], 0.25) == pytest.approx(0.25)
    # P(U V W <= p) of uniform numbers, by the Gamma distribution of -log.
    p = 0.02
    exact = p * (1 - np.log(p) + np.log(p) ** 2 / 2)
    assert share_not_larger(3 * [shares], p) == pytest.approx(exact, rel=0.05)
