"""Stage 4: confidence limits of a case's moduli over frequency, by profiles of one trace."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np

from biogrip.arrays import Array
from biogrip.digits import rounded_numbers
from biogrip.files import write_text
from biogrip.identifiability.fit_status import REJECTED
from biogrip.identifiability.likelihood import MISSED, Likelihood, make_likelihood
from biogrip.identifiability.moduli import Modulus, moduli_at, profile_moduli
from biogrip.identifiability.profiles import Profile
from biogrip.identify.methods import METHODS
from biogrip.identify.multi_start import fit_from
from biogrip.products.files.modulus_profiles import PATH
from biogrip.products.files.traces import read_measurements
from biogrip.products.files.verdicts import PATH as VERDICTS
from biogrip.products.files.verdicts import read_verdicts
from biogrip.products.product import JUDGEMENT, Product, the, wildcards_of
from biogrip.products.stages.calibrated import CALIBRATED
from biogrip.products.stages.judgement import JUDGED_TRACE, TRACE, fit_judged
from biogrip.products.uses import from_case, searched_for
from biogrip.study.study import Case

# Frequencies beyond those of the experiment, as a factor: what a model says there is a guess.
_BEYOND = 10.0
_A_DECADE = 2


def profile(
    case: Case, verdicts: Path, measurements: Path, calibrated: list[Path], limits: Path
) -> None:
    """Profile the moduli of the judged fit of a case; a rejected one has no limits."""
    recorded = read_measurements(measurements, [TRACE])
    case_problem = case.problem.calibrated(calibrated).weighted(recorded.sd_rad)
    judged = read_verdicts(verdicts)
    found = {item["quantity"]: item["value"] for item in judged["quantities"]}
    moduli = moduli_at(case_problem.searched, frequencies(recorded.time_s))
    best = np.log([found[name] for name in case_problem.searched.names])
    ends: list[tuple[float | None, float | None]] = [(None, None)] * len(moduli)
    if judged["fit"] != REJECTED:
        fit = fit_judged(case, case_problem, recorded.time_s, recorded.rotation_rad[TRACE], TRACE)

        def likelihood_from(start: Array) -> Likelihood:
            optimum = fit_from([fit.problem], start)
            return make_likelihood(
                fit.problem,
                optimum.x[0],
                float(optimum.misfit_rad[0]),
                confidence=case.confidence,
                noise_rad=case_problem.noise_rad,
            )

        likelihood, profiles = profile_from(likelihood_from, best, moduli)
        best = likelihood.best
        ends = [(each.low, each.high) for each in profiles]
    said = {
        "case": case.name,
        "fit": judged["fit"],
        "confidence": case.confidence,
        "unit": case_problem.searched.stiffness_unit,
        "moduli": [
            {
                "part": each.part,
                "rad_per_s": each.omega,
                "value": float(np.exp(each.log(best))),
                "low": None if low is None else float(np.exp(low)),
                "high": None if high is None else float(np.exp(high)),
            }
            for each, (low, high) in zip(moduli, ends, strict=True)
        ],
    }
    write_text(limits, json.dumps(rounded_numbers(said), indent=1) + "\n")


def frequencies(time_s: Array) -> Array:
    """Return angular frequencies, two a decade, that an experiment may see, and a decade beyond."""
    slowest, fastest = 1 / (time_s[-1] - time_s[0]), 1 / np.min(np.diff(time_s))
    first = np.ceil(_A_DECADE * np.log10(slowest / _BEYOND))
    last = np.floor(_A_DECADE * np.log10(fastest * _BEYOND))
    return 10.0 ** (np.arange(first, last + 1) / _A_DECADE)


def profile_from(
    likelihood_from: Callable[[Array], Likelihood], start: Array, moduli: list[Modulus]
) -> tuple[Likelihood, list[Profile]]:
    """Profile moduli, again from the lowest point that is found below the optimum, if any is."""
    likelihood = likelihood_from(start)
    while True:
        profiles = profile_moduli(likelihood, moduli)
        lowest = min(profiles, key=lambda each: float(each.increases.min()))
        again = likelihood_from(lowest.lowest)
        if likelihood.increase(again.misfit_rad) > -MISSED:
            return likelihood, profiles
        likelihood = again


MODULUS_PROFILES = Product(
    "modulus_profiles",
    {"limits": PATH},
    profile,
    from_case("name least_squares confidence study.study_seed", problem=searched_for),
    lambda plan: wildcards_of(plan.study.with_moduli),
    message="Computing confidence limits of the moduli of {case}",
    reads={
        "verdicts": the(VERDICTS),
        "measurements": JUDGED_TRACE,
        "calibrated": CALIBRATED,
    },
    weight=JUDGEMENT,
    modules=lambda _: (METHODS["least_squares"].module,),
)
