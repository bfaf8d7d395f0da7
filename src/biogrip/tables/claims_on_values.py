"""Claims of the paper on the values of its Tables 5 to 7."""

import numpy as np

from biogrip.tables.claim_rules import (
    IN_PART,
    NOT,
    Judged,
    Results,
    Runs,
    altogether,
    by_share,
    by_value,
    plain,
)

_ROUNDING_PERCENT = 0.5
"""Errors of the paper are compared after rounding."""


def judge_values_of_table(results: Results, number: int) -> Judged:
    """Judge the identified values of a table."""
    runs = results.runs_of(number)
    errors = results.table("errors")
    errors = errors[errors["case"] == runs.case].set_index("parameter")
    limits = results.table(f"verdicts_{runs.case}").set_index("quantity")
    said, verdicts = [], []
    for name, printed in runs.truth.published.identified.items():
        row, expected = errors.loc[name], limits.loc[name]
        low, high = float(row["p05_identified"]), float(row["p95_identified"])
        ends = float(expected["expected_low"]), float(expected["expected_high"])
        is_close = bool(ends[0] <= float(row["typical_identified"]) <= ends[1])
        verdicts.append(by_value(low, printed, high, is_close=is_close))
        said.append(f"{name} = {printed:g} {verdicts[-1]} ({plain(low)} to {plain(high)})")
    return Judged(altogether(verdicts), f"With the middle 90 % of the seeds: {'; '.join(said)}.")


def judge_negligible(results: Results) -> Judged:
    """Judge whether errors of k_p and c are as small as printed in Table 5."""
    runs, said, verdicts = results.runs_of(5), [], []
    for name in ("k_p", "c"):
        printed = runs.truth.published.identified[name] / runs.truth.parameters[name] - 1
        errors = _errors(runs, name)
        share = float(np.mean(errors <= 100 * abs(printed) + _ROUNDING_PERCENT))
        verdicts.append(by_share(share))
        said.append(f"{name} {100 * share:.0f} % (median error {np.median(errors):.2g} %)")
    methods = results.table("methods")
    fits = methods[methods["method"] == "multi-start least squares"]
    best = fits[fits["case"] == runs.case]
    others = [f"{float(best[f'error_percent {n}'].iloc[0]):.2g}" for n in ("k_p", "c") if len(best)]
    polished = f" By least squares median errors are {' and '.join(others)} %." if others else ""
    return Judged(
        altogether(verdicts), f"Seeds as close as the paper: {', '.join(said)}.{polished}"
    )


def judge_below_noise(results: Results) -> Judged:
    """Judge whether the error of k is below the level of the noise in Table 5."""
    runs = results.runs_of(5)
    level = 100 * results.study.cases[runs.case].noise.level
    errors = _errors(runs, "k")
    share = float(np.mean(errors < level))
    return Judged(
        by_share(share),
        f"{100 * share:.0f} % of the seeds; the median error of k is {np.median(errors):.2g} %.",
    )


def judge_low_damper(results: Results) -> Judged:
    """Judge whether runs show that c_p of Table 5 is low."""
    runs = results.runs_of(5)
    limits = results.table(f"verdicts_{runs.case}").set_index("quantity")
    most = float(limits.loc["c_p", "expected_high"])
    share = float(np.mean(runs.identified("c_p") <= most))
    return Judged(
        by_share(share),
        f"{100 * share:.0f} % of the seeds identify c_p below {most:.2g} N s/m, the largest that a "
        f"trace allows; the median is {runs.identified('c_p').median():.3g} N s/m.",
    )


def judge_key_damper(results: Results) -> Judged:
    """Judge whether c of Table 6 is found; the sum may be where c is not."""
    runs = results.runs_of(6)
    printed = abs(runs.truth.published.identified["c"] / runs.truth.parameters["c"] - 1)
    alone, total = (
        float(np.mean(_errors(runs, *names) <= 100 * printed + _ROUNDING_PERCENT))
        for names in (("c",), ("c", "c_p"))
    )
    verdict = by_share(alone)
    return Judged(
        IN_PART if verdict == NOT and by_share(total) != NOT else verdict,
        f"Seeds with an error up to {100 * printed:.2g} %: {100 * alone:.0f} % for c, "
        f"{100 * total:.0f} % for c + c_p, which alone is determined.",
    )


def judge_good_identification(results: Results) -> Judged:
    """Judge whether k and c of Table 7 are found to within 3 %."""
    runs = results.runs_of(7)
    limit = 3 + _ROUNDING_PERCENT
    shares = [float(np.mean(_errors(runs, name) <= limit)) for name in ("k", "c")]
    both = float(np.mean((_errors(runs, "k") <= limit) & (_errors(runs, "c") <= limit)))
    return Judged(
        by_share(both),
        f"Seeds with errors below 3 %, rounded: k {100 * shares[0]:.0f} %, c {100 * shares[1]:.0f} "
        f"%, both {100 * both:.0f} %.",
    )


def judge_fits_response(results: Results, number: int) -> Judged:
    """Judge whether runs fit the response to within the noise."""
    runs = results.runs_of(number)
    errors = results.table("errors")
    share = float(errors.loc[errors["case"] == runs.case, "near_noise_share"].iloc[0])
    near = 100 * results.study.near_noise_tolerance
    return Judged(
        by_share(share),
        f"{100 * share:.0f} % of the seeds fit to within {near:g} % of the noise.",
    )


def _errors(runs: Runs, *names: str) -> "np.ndarray":
    """Return absolute errors of a parameter or a sum in percent, one a seed."""
    values = np.sum([runs.identified(name) for name in names], axis=0)
    target = sum(runs.truth.parameters[name] for name in names)
    return np.asarray(100 * np.abs(values / target - 1))
