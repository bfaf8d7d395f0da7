"""Whether posteriors are calibrated: ranks of true values among samples, over draws of the prior.

``python -m tests.helpers.posterior_campaign [draws [first]]`` takes some 20 minutes for 200 draws,
and writes the table that the documentation shows. The test suite has a few.

References
----------
.. [1] S. Talts, M. Betancourt, D. Simpson, A. Vehtari and A. Gelman, Validating Bayesian inference
   algorithms with simulation-based calibration, arXiv:1804.06788 (2018).
.. [2] M. Modrák et al., Simulation-based calibration checking for Bayesian computation: the choice
   of test quantities shapes sensitivity, Bayesian Analysis 20 (2025), 461-488: the likelihood,
   too.
"""

import sys
from collections.abc import Iterable
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
QUANTITIES = parameters_and_sum(MODEL)
NAMES = (*(quantity.label for quantity in QUANTITIES), "likelihood")
RATE_HZ = 1.0
SETTINGS = PosteriorSettings()
_WRITTEN_EVERY = 20
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
    """Test whether ranks are uniform, and count how often intervals hold the truth."""
    kept = list(draws)
    ranks = np.array([draw.ranks for draw in kept])
    bins = max(len(kept) // 10, 2)
    return pd.DataFrame(
        [
            {
                "quantity": name,
                "draws": len(kept),
                "converged": sum(draw.converged for draw in kept),
                "p_value": stats.kstest(own, "uniform").pvalue,
                "p_value_binned": stats.chisquare(np.histogram(own, bins, (0, 1))[0]).pvalue,
                "coverage_50_percent": 100 * np.mean(np.abs(own - 0.5) <= 0.25),
                "coverage_95_percent": 100 * np.mean(np.abs(own - 0.5) <= 0.475),
            }
            for name, own in zip(NAMES, ranks.T, strict=True)
        ]
    )


def main(draws: int, first: int) -> None:
    """Write the table, and print it."""
    found = []
    with ProcessPoolExecutor() as processes:
        for number, each in enumerate(processes.map(drawn, range(first, first + draws)), first):
            found.append(each)
            ranks = " ".join(f"{rank:.3f}" for rank in each.ranks)
            print(f"{number}: {ranks} {'' if each.converged else 'not converged'}", flush=True)
            if len(found) % _WRITTEN_EVERY == 0 or len(found) == draws:
                table = counted(found)
                print(table.to_string(index=False), flush=True)
                TABLE.parent.mkdir(parents=True, exist_ok=True)
                table.to_csv(TABLE, index=False, float_format="%.3g")


if __name__ == "__main__":
    given = [int(argument) for argument in sys.argv[1:]]
    main(given[0] if given else 200, given[1] if len(given) > 1 else 0)
