"""Whether posteriors are calibrated: ranks of true values among samples, over draws of the prior.

``python -m tests.helpers.posterior_campaign [draws]`` takes some 90 minutes of one core for 1000
draws, goes on where an earlier one ended, and writes the table that the documentation shows. The
test suite has a few.

References
----------
.. [1] S. Talts, M. Betancourt, D. Simpson, A. Vehtari and A. Gelman, Validating Bayesian inference
   algorithms with simulation-based calibration, arXiv:1804.06788 (2018).
.. [2] M. Modrák et al., Simulation-based calibration checking for Bayesian computation: the choice
   of test quantities shapes sensitivity, Bayesian Analysis 20 (2025), 461-488: the likelihood,
   too.
"""

import sys
from collections.abc import Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy import stats

from biogrip.arrays import Array
from biogrip.experiment.protocol import sample_times
from biogrip.identifiability.posterior import Posterior
from biogrip.identifiability.posterior_settings import PosteriorSettings
from biogrip.identifiability.prior import make_prior
from biogrip.identifiability.quantities import parameters_and_sum
from biogrip.identifiability.sampling import sampled
from biogrip.identify.answer import silent
from biogrip.response.linear import rotation, step_response
from tests.helpers.places import ROOT
from tests.helpers.problems import GRIPPER, MODEL, RANGES, TORQUE, posed_for

TABLE = ROOT / "results/published/posterior_calibration/tables/posterior_calibration.csv"
DRAWS = TABLE.with_name("posterior_draws.csv")
QUANTITIES = parameters_and_sum(MODEL)
NAMES = (*(quantity.label for quantity in QUANTITIES), "likelihood")
RATE_HZ = 1.0
SETTINGS = PosteriorSettings()
# The level's prior is Jeffreys' as far as it goes: of an improper one nothing can be drawn.
LEAST_NOISE, MOST_NOISE = 0.05, 0.2


@dataclass(frozen=True)
class Draw:
    """What came of a draw: shares of the samples below the true values, and whether to rely."""

    ranks: Array
    converged: bool


def drawn(number: int, settings: PosteriorSettings = SETTINGS) -> Draw:
    """Draw a sample from the prior, simulate its trace, and sample the posterior."""
    rng = np.random.default_rng([number, 31])
    genes = [RANGES[p.range_name] for p in MODEL.parameters]
    low, high = (np.log([getattr(own, end) for own in genes]) for end in ("low", "high"))
    prior = make_prior(MODEL, low, high, {})
    truth = prior.draw(1, rng)
    times = sample_times(400.0, RATE_HZ)
    clean = rotation(step_response(GRIPPER, MODEL.network(np.exp(truth))), TORQUE, times)[0]
    level = np.exp(rng.uniform(np.log(LEAST_NOISE), np.log(MOST_NOISE)))
    trace = clean + level * np.max(np.abs(clean)) * rng.standard_normal(len(times))
    problem = posed_for(MODEL, times, trace)
    posterior = Posterior(problem, prior)
    found = sampled(posterior, settings, rng, silent)
    samples = found.log_parameters.reshape(-1, len(low))
    ranks = [np.mean(q.logs(samples) < q.log(truth[0])) for q in QUANTITIES]
    # The prior is uniform, so that this orders samples as the likelihood does.
    ranks.append(np.mean(posterior.log_density(samples) < posterior.log_density(truth)[0]))
    return Draw(np.array(ranks), found.convergence.reached)


def counted(draws: Iterable[Draw]) -> pd.DataFrame:
    """Test whether ranks are uniform, and count how often intervals hold the truth.

    Draws that have converged are counted alone, too, and so are the others: as that depends on the
    trace and not on the truth behind it, the ranks of either must be uniform.
    """
    kept = list(draws)
    parts = {
        "all": kept,
        "converged": [draw for draw in kept if draw.converged],
        "not converged": [draw for draw in kept if not draw.converged],
    }
    return pd.DataFrame(row for name, part in parts.items() if part for row in _rows(name, part))


def _rows(part: str, draws: list[Draw]) -> Iterator[dict[str, object]]:
    ranks = np.array([draw.ranks for draw in draws])
    bins = max(len(draws) // 10, 2)
    for name, own in zip(NAMES, ranks.T, strict=True):
        yield {
            "quantity": name,
            "part": part,
            "draws": len(draws),
            "p_value": stats.kstest(own, "uniform").pvalue,
            "p_value_binned": stats.chisquare(np.histogram(own, bins, (0, 1))[0]).pvalue,
            "coverage_50_percent": 100 * np.mean(np.abs(own - 0.5) <= 0.25),
            "coverage_95_percent": 100 * np.mean(np.abs(own - 0.5) <= 0.475),
        }


def main(draws: int) -> None:
    """Add draws to those that there are, and write the table of all."""
    DRAWS.parent.mkdir(parents=True, exist_ok=True)
    if not DRAWS.is_file():
        DRAWS.write_text(",".join(("draw", *NAMES, "converged")) + "\n")
    first = len(pd.read_csv(DRAWS))
    with ProcessPoolExecutor() as processes, DRAWS.open("a") as kept:
        for number, each in enumerate(processes.map(drawn, range(first, draws)), first):
            ranks = ",".join(f"{rank:.4f}" for rank in each.ranks)
            print(f"{number},{ranks},{each.converged}", file=kept, flush=True)
    table = counted(
        Draw(np.array(row[1:-1], dtype=float), bool(row[-1]))
        for row in pd.read_csv(DRAWS).itertuples(index=False)
    )
    table.to_csv(TABLE, index=False, float_format="%.3g")
    print(table.to_string(index=False), flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1000)
