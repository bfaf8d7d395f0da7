"""Claims of the paper's sections 5 and 6: convergence, and the values of Tables 5 to 7."""

from collections.abc import Iterable
from functools import partial

import numpy as np
import pandas as pd

from biogrip.arrays import Array, BoolArray
from biogrip.fit.methods import near_noise
from biogrip.judging.quantities import PROVIDED
from biogrip.judging.verdicts import DETERMINED
from biogrip.tables.claim_rules import (
    IN_PART,
    NEAR,
    NOT,
    OUTSIDE,
    REPLICATED,
    UNDECIDED,
    Judged,
    LackingError,
    Results,
    Runs,
    altogether,
    by_share,
    by_value,
    claim,
    is_encodable,
    of_seeds,
    percent,
    plain,
    within_a_decade,
)

_TABLES = (5, 6, 7)
_EARLY, _CONVERGED = 20, 60
_ROUNDING_PERCENT = 0.5
"""Errors of the paper are compared after rounding."""
_SCATTER_OF_CELLS = 30.0
"""Factor by which measured moduli of cells differ from 1 kPa, by the method of measurement."""
_OF_MEDIAN = 0.6745
"""Median error of an estimator at the bound, in standard deviations."""
_NEAR_BOUND = 2.0
"""Factor of that up to which a method's error counts as that which noise allows."""
_APART = 10.0
"""Difference of BIC that is decisive."""


def judge_values(results: Results, number: int) -> Judged:
    """Judge the identified values of a table, and the sum of those that trade."""
    runs = results.runs_of(number)
    identified = runs.case.published.identified
    nearest = _nearest(results, runs, "identified")
    told = results.table(f"verdicts_{runs.case.name}").set_index("quantity")["expected_verdict"]
    said, verdicts = [], []
    for quantity in runs.case.sample.model.quantities:
        names = [parameter.name for parameter in quantity]
        label, printed = " + ".join(names), sum(identified[name] for name in names)
        values = runs.found[names].sum(axis=1).to_numpy(float)
        near = np.abs(values / printed - 1) <= NEAR
        verdict = by_value(
            near,
            encodable=all(is_encodable(identified[name], nearest[name]) for name in names),
            determined=told[label] == DETERMINED,
        )
        verdicts.append(verdict)
        if len(names) > 1 and verdict != OUTSIDE:
            verdict += f", {PROVIDED}"
        low, median, high = np.percentile(values, [25, 50, 75])
        what = f"{of_seeds(near)}, median {plain(median)}, {plain(low)} to {plain(high)}"
        said.append(f"{label} = {printed:.4g} {verdict}: {what}")
    return Judged(altogether(verdicts), f"Seeds near it, median and quartiles: {'; '.join(said)}.")


def _nearest(results: Results, runs: Runs, which: str) -> "pd.Series[float]":
    """Return the genes' value nearest to each target or identified value of a case, by name."""
    table = results.table("printed_values")
    mine = table[(table["case"] == runs.case.name) & (table["quantity"] == which)]
    return mine.set_index("parameter")["nearest_encodable"]


def judge_fits_response(results: Results, number: int) -> Judged:
    """Judge whether runs fit the response to within the noise."""
    near = _near_noise(results, number)
    tolerance = 100 * results.study.near_noise_tolerance
    said = f"{of_seeds(near)} of the seeds fit to within {tolerance:g} % of the noise."
    return Judged(by_share(near), said)


def _near_noise(results: Results, number: int) -> BoolArray:
    """Return whether a run's fit comes near the noise, (n_seeds,)."""
    return near_noise(results.runs_of(number).found, results.study.near_noise_tolerance)


def tell_of_generation(results: Results, number: int) -> Judged:
    """Tell why the generation at which the paper shows a fit proves nothing."""
    runs = results.runs_of(number)
    if runs.case.published.generation is None:
        raise LackingError("the config has no generation of the fit")
    stop, last = runs.found["generations"], runs.last_improvement
    low, high = np.percentile(stop, [5, 95])
    return Judged(
        UNDECIDED,
        f"Ours stop at generation {stop.median():.0f} ({low:.0f} to {high:.0f}), and last improve "
        f"at {last.median():.0f}; the rule that stops them was chosen with the paper's generations "
        "in view.",
    )


def judge_orders(results: Results, names: dict[int, tuple[str, ...]]) -> Judged:
    """Judge whether orders of magnitude of parameters of some tables are found in the end."""
    said: list[str] = []
    verdicts: list[str] = []
    for number, each in names.items():
        runs = results.runs_of(number)
        those = _within_a_decade(runs, each, runs.found)
        verdicts += [by_share(it) for it in those]
        said.append(f"Table {number}: {_listed(each, those)}")
    return Judged(
        altogether(verdicts), f"Seeds within half a decade of the target: {'; '.join(said)}."
    )


def _within_a_decade(runs: Runs, names: Iterable[str], values: pd.DataFrame) -> list[BoolArray]:
    return [within_a_decade(values[name], runs.case.parameters[name]) for name in names]


def _listed(names: Iterable[str], those: Iterable[BoolArray]) -> str:
    return ", ".join(f"{name} {of_seeds(it)}" for name, it in zip(names, those, strict=True))


def _errors_percent(runs: Runs, *names: str) -> Array:
    """Return absolute errors of a parameter or a sum, one a seed."""
    values = runs.found[list(names)].sum(axis=1).to_numpy(float)
    target = sum(runs.case.parameters[name] for name in names)
    return np.asarray(100 * np.abs(values / target - 1))


claim("sections 4, 6", "does not require to assume a priori the order of magnitude")(
    partial(judge_orders, names={5: ("k", "k_p", "c"), 6: ("k", "c"), 7: ("k", "c")})
)


@claim("section 5", "reaching a stationary value")
def judge_stationary(results: Results) -> Judged:
    runs = [results.runs_of(n) for n in _TABLES]
    stalled = pd.concat([each.found["stop_reason"] == "stalled" for each in runs])
    changes = [each.history.groupby("seed")["best_misfit"].diff().fillna(0) for each in runs]
    never_worse = bool((pd.concat(changes) <= 0).all())
    return Judged(
        by_share(stalled) if never_worse else NOT,
        f"{of_seeds(stalled)} of the runs end without improvement for 20 generations; the best "
        f"misfit {'never rises' if never_worse else 'rises at times'}.",
    )


@claim("section 5, Figure 8", "Generally, convergence is reached around the 60th generation")
def judge_convergence(results: Results) -> Judged:
    last = {n: results.runs_of(n).last_improvement for n in _TABLES}
    said = ", ".join(f"{np.median(each):.0f} (Table {n})" for n, each in last.items())
    return Judged(
        UNDECIDED,
        f"Median generation of the last improvement: {said}. The rule that stops runs was chosen "
        "with the paper's generations in view.",
    )


@claim(
    "section 5, Figure 8",
    "20 generations … verify if mutation can move the optimum from a local minimum",
)
def judge_further_generations(results: Results) -> Judged:
    near = {n: _near_noise(results, n) for n in _TABLES}
    points = results.of_sweep("interpretations")
    patient = points[points["interpretation"].isin(["as printed", "patience of 60 generations"])]
    printed, longer = patient.loc[
        patient["case"] == results.case_of(5), "near_noise_share"
    ].to_numpy(float)
    said = ", ".join(f"Table {n} {of_seeds(those)}" for n, those in near.items())
    return Judged(
        altogether(by_share(those) for those in near.values()),
        f"Runs that come near the noise: {said}. With 60 further generations they are "
        f"{100 * longer:.1f} instead of {100 * printed:.1f} % for Table 5 (sweep interpretations).",
    )


@claim("section 5", "for the case of endothelial cells")
def judge_endothelial(results: Results) -> Judged:
    table = results.table("mechanics")
    title = results.study.cases[results.case_of(5)].title
    modulus = table.loc[table["case"] == title, "apparent_modulus_kPa"].to_numpy(float)
    is_like = modulus.min() >= 1 / _SCATTER_OF_CELLS and modulus.max() <= _SCATTER_OF_CELLS
    return Judged(
        REPLICATED if is_like else NOT,
        f"Its apparent modulus is {plain(modulus.min(), 2)} to {plain(modulus.max(), 2)} kPa by "
        f"its size; cells have about 1 kPa, give or take a factor of {_SCATTER_OF_CELLS:g}.",
    )


claim("Figure 9", "the best fit solution, obtained at the 70th generation")(
    partial(tell_of_generation, number=5)
)
claim("Figure 9", "target response … and the best fit")(partial(judge_fits_response, number=5))


@claim("Figure 10", "except c_p, the order of magnitude … is obtained around the 20th generation")
def judge_early_orders(results: Results) -> Judged:
    runs = results.runs_of(5)
    names = [name for name in runs.case.sample.model.names if name != "c_p"]
    early, later = (
        # Of a run that has stopped before, the last generation.
        _within_a_decade(
            runs, names, runs.history[runs.history["generation"] <= at].groupby("seed").last()
        )
        for at in (_EARLY, _CONVERGED)
    )
    return Judged(
        altogether(by_share(it) for it in early),
        f"Seeds within half a decade of the target at generation {_EARLY}: "
        f"{_listed(names, early)}; at {_CONVERGED}: {_listed(names, later)}.",
    )


claim("Table 5", "identified values")(partial(judge_values, number=5))


@claim("Table 5", "k_p and c have a negligible error")
def judge_negligible(results: Results) -> Judged:
    runs, said, verdicts = results.runs_of(5), [], []
    nearest = _nearest(results, runs, "target")
    for name in ("k_p", "c"):
        target = runs.case.parameters[name]
        printed = 100 * abs(runs.case.published.identified[name] / target - 1)
        least = 100 * abs(nearest[name] / target - 1)
        errors = _errors_percent(runs, name)
        close = errors <= printed + _ROUNDING_PERCENT
        can = least <= printed + _ROUNDING_PERCENT
        verdicts.append(by_value(close, encodable=can, determined=True))
        said.append(
            f"{name} {of_seeds(close)}, with a median error of {np.median(errors):.2g} %; the "
            f"genes allow {least:.2g} % at best"
        )
    methods = results.table("methods")
    is_best = (methods["method"] == "multi-start least squares") & (
        methods["case"] == runs.case.name
    )
    polished = ""
    if is_best.any():
        best = methods[is_best].iloc[0]
        others = f"{best['error_percent k_p']:.2g} and {best['error_percent c']:.2g}"
        polished = f" By least squares median errors are {others} %."
    return Judged(
        altogether(verdicts), f"Seeds as close as the paper: {'; '.join(said)}.{polished}"
    )


@claim("Table 5", "the error on k is lower than the noise level")
def judge_below_noise(results: Results) -> Judged:
    runs = results.runs_of(5)
    errors = _errors_percent(runs, "k")
    below = errors < 100 * results.study.cases[runs.case.name].noise.level
    said = f"{of_seeds(below)} of the seeds; the median error of k is {np.median(errors):.2g} %."
    return Judged(by_share(below), said)


@claim("Table 5", "c_p … has a very low value that does not affect the response")
def judge_low_damper(results: Results) -> Judged:
    runs = results.runs_of(5)
    limits = results.table(f"verdicts_{runs.case.name}").set_index("quantity")
    most = float(limits.loc["c_p", "expected_high"])
    low = runs.found["c_p"] <= most
    return Judged(
        by_share(low),
        f"{of_seeds(low)} of the seeds identify c_p below {most:.2g} N s/m, the largest that a "
        f"trace allows; the median is {runs.found['c_p'].median():.3g} N s/m.",
    )


claim("section 5", "generally able … also in case of simpler models")(
    partial(judge_orders, names={6: ("k", "c"), 7: ("k", "c")})
)
claim("Table 6", "identified values")(partial(judge_values, number=6))


@claim("Table 6", "response … is dominated basically by the damping value")
def judge_damper_dominates(results: Results) -> Judged:
    table = results.table("models")
    rows = table[(table["case"] == results.case_of(6)) & (table["model"] == "bare damper")]
    if rows.empty:
        raise LackingError("the study does not compare a bare damper")
    chosen, seeds = int(rows["chosen_by_bic"].iloc[0]), int(rows["seeds"].iloc[0])
    return Judged(
        by_share(chosen / seeds), f"BIC prefers a bare damper for {chosen} of {seeds} traces."
    )


claim("Figure 11", "fits correctly the response")(partial(judge_fits_response, number=6))


@claim("Table 6", "identify with small error the key parameter c")
def judge_key_damper(results: Results) -> Judged:
    runs = results.runs_of(6)
    printed = abs(runs.case.published.identified["c"] / runs.case.parameters["c"] - 1)
    alone, total = (
        _errors_percent(runs, *names) <= 100 * printed + _ROUNDING_PERCENT
        for names in (("c",), ("c", "c_p"))
    )
    verdict = by_share(alone)
    found = by_share(total)
    return Judged(
        IN_PART if verdict == NOT and found != NOT else verdict,
        f"Seeds with an error up to {100 * printed:.2g} %: {of_seeds(alone)} for c, "
        f"{of_seeds(total)} for c + c_p, which alone is determined, {PROVIDED}.",
    )


claim("Table 6", "catch k_p and k orders of magnitude")(
    partial(judge_orders, names={6: ("k", "k_p")})
)
claim("Table 7", "identified values")(partial(judge_values, number=7))


@claim("Table 7", "becomes affected by the k value, thus the identification improves")
def judge_spring_shows(results: Results) -> Judged:
    determined = {}
    for number in (6, 7):
        table = results.table(f"verdicts_{results.case_of(number)}").set_index("quantity")
        determined[number] = str(table.loc["k", "expected_verdict"])
    right = [determined[6] != DETERMINED, determined[7] == DETERMINED]
    return Judged(
        altogether(REPLICATED if each else IN_PART for each in right),
        f"Without noise k is {determined[6]} in Table 6's sample, {determined[7]} in Table 7's.",
    )


@claim("Table 7", "good identification for k and c (error below 3%)")
def judge_good_identification(results: Results) -> Judged:
    runs = results.runs_of(7)
    k, c = (_errors_percent(runs, name) <= 3 + _ROUNDING_PERCENT for name in ("k", "c"))
    return Judged(
        by_share(k & c),
        f"Seeds with errors below 3 %, rounded: k {of_seeds(k)}, "
        f"c {of_seeds(c)}, both {of_seeds(k & c)}.",
    )


@claim("Figure 12", "axis from -0.6 to 4.2 mrad")
def judge_rotation(results: Results) -> Judged:
    rows = results.table("evidence")
    rows = rows[rows["unit"] == "mrad"]
    if rows.empty:
        raise LackingError("the study has no trace of Table 7")
    low, high = (float(value) for value in rows["this_study"])
    return Judged(
        UNDECIDED,
        f"Ours span {low:.2g} to {high:.2g} mrad; the arms' stiffness, which the copy lacks, was "
        "reconstructed from this axis.",
    )


claim("Figure 12", "fit at generation 61")(partial(tell_of_generation, number=7))


@claim("section 6", "confirm the feasibility of the approach")
def judge_feasible(results: Results) -> Judged:
    said, verdicts = [], []
    for number in _TABLES:
        table = results.table(f"verdicts_{results.case_of(number)}")
        is_determined = table["verdict"] == DETERMINED
        is_sum = table["quantity"].str.contains("+", regex=False)
        verdicts += [REPLICATED if each else NOT for each in is_determined[~is_sum]]
        said.append(f"Table {number}: {', '.join(table['quantity'][is_determined]) or 'none'}")
    return Judged(
        altogether(verdicts), f"A trace determines, c + c_p {PROVIDED}: {'; '.join(said)}."
    )


@claim("section 6", "highly robust with respect to measurement noise")
def judge_robust(results: Results) -> Judged:
    points = results.of_sweep("robustness_noise")
    points = points[(points["row"] > 0) & np.isfinite(points["bound_percent"])]
    fine = points["error_genetic"] <= _NEAR_BOUND * _OF_MEDIAN * points["bound_percent"]
    shares = fine.groupby([points["case"], points["quantity"]], sort=False).mean()
    names = {results.case_of(number): number for number in _TABLES}
    said = ", ".join(
        f"{percent(share)} ({quantity}, Table {names[case]})"
        for (case, quantity), share in shares.items()
    )
    return Judged(
        altogether(map(by_share, shares)),
        f"Levels and kinds of noise at which the median error is at most {_NEAR_BOUND:g} times "
        f"that which noise allows, c + c_p {PROVIDED}: {said} (sweep robustness_noise).",
    )


@claim("section 6", "nor the specific cell model")
def judge_cell_model(results: Results) -> Judged:
    table = results.table("models")
    verdicts, said = [], []
    for number in _TABLES:
        mine = table[table["case"] == results.case_of(number)]
        (maker,) = mine[mine["model"].str.endswith("(made the traces)")].to_dict("records")
        simpler = mine[mine["parameters"] < maker["parameters"]]
        if simpler.empty:
            raise LackingError("the study compares no simpler sample models")
        fail = int((simpler["median_delta_bic"] > _APART).sum())
        verdicts.append(NOT if fail else REPLICATED)
        chosen = f"{maker['chosen_by_bic']} of {maker['seeds']} traces"
        said.append(f"Table {number}: {fail} of {len(simpler)}, {chosen}")
    return Judged(
        altogether(verdicts),
        "The paper fits only the model that made its traces. Simpler models that a trace refutes "
        f"(BIC higher by over {_APART:g}), and traces whose BIC prefers the one that made them: "
        f"{'; '.join(said)}.",
    )
