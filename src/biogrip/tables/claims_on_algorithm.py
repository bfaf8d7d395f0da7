"""Claims of the paper on its genetic algorithm: encoding, convergence, what it does not need."""

import numpy as np
import pandas as pd

from biogrip.tables.claim_rules import (
    IN_PART,
    NOT,
    REPLICATED,
    UNDECIDED,
    Judged,
    LackingError,
    Results,
    altogether,
    by_range,
    by_share,
    plain,
    share_within_a_decade,
)

_EARLY, _CONVERGED = 20, 60
_TABLES = (5, 6, 7)
_OF_MEDIAN = 0.6745
"""Median error of an estimator at the bound, in standard deviations."""
_NEAR_BOUND = 2.0
"""Factor of that up to which a method's error counts as that which noise allows."""
_APART = 10.0
"""Difference of BIC that is decisive."""


def judge_genes(results: Results) -> Judged:
    """Judge the numbers of values that a gene takes."""
    table = results.table("gene_ranges")
    counts = sorted(set(table["values"].astype(int)))
    return Judged(
        altogether(REPLICATED if count in (9, 12) else NOT for count in counts),
        f"Ranges that give Table 4 have {', '.join(map(str, counts))} values a gene.",
    )


def judge_digits(results: Results) -> Judged:
    """Judge whether the printed results can be encoded."""
    table = results.table("printed_values")
    found = table[table["quantity"] == "identified"]
    fits = (found["distance_percent"].abs() < 1e-9) & (found["within_range"] == "yes")
    return Judged(
        by_share(float(fits.mean())),
        f"{fits.sum()} of the {len(fits)} values that Tables 5 to 7 call identified have two "
        "digits within the ranges of Table 4.",
    )


def judge_splitting(results: Results) -> Judged:
    """Tell what is known of the encoding in three genes."""
    table = results.table("methods").groupby("method", sort=False)["median_evaluations"].max()
    said = "; ".join(f"{name} {plain(count)}" for name, count in table.items())
    return Judged(
        UNDECIDED,
        f"The paper shows no other encoding. Simulated responses, medians, at most: {said}.",
    )


def judge_stationary(results: Results) -> Judged:
    """Judge whether runs come to rest before the last generation allowed."""
    stalled = [results.runs_of(n).found["stop_reason"] == "stalled" for n in _TABLES]
    falls = [
        results.runs_of(n).history.groupby("seed")["best_misfit"].diff().fillna(0) <= 0
        for n in _TABLES
    ]
    share = float(np.mean(pd.concat(stalled)))
    never_worse = bool(pd.concat(falls).all())
    return Judged(
        by_share(share) if never_worse else NOT,
        f"{100 * share:.0f} % of the runs end without improvement for 20 generations; the best "
        f"misfit {'never rises' if never_worse else 'rises at times'}.",
    )


def judge_convergence(results: Results) -> Judged:
    """Judge the generation of convergence by that of the last improvement."""
    last = [results.runs_of(n).last_improvement for n in _TABLES]
    said = ", ".join(
        f"{np.median(each):.0f} (Table {n})" for n, each in zip(_TABLES, last, strict=True)
    )
    return Judged(
        altogether(by_range(_CONVERGED, each) for each in last),
        f"Median generation of the last improvement: {said}.",
    )


def judge_further_generations(results: Results) -> Judged:
    """Judge whether twenty further generations lead out of local minima."""
    methods = results.table("methods")
    ours = methods[methods["method"] == "genetic algorithm"]
    shares = [
        float(ours.loc[ours["case"] == results.runs_of(n).case, "near_noise_share"].iloc[0])
        for n in _TABLES
    ]
    points = results.of_sweep("interpretations")
    patient = points[points["interpretation"].isin(["as printed", "patience of 60 generations"])]
    printed, longer = patient.loc[
        patient["case"] == results.case_of(5), "near_noise_share"
    ].to_numpy(float)
    said = ", ".join(f"{100 * s:.0f} % (Table {n})" for n, s in zip(_TABLES, shares, strict=True))
    return Judged(
        altogether(by_share(share) for share in shares),
        f"Runs that come near the noise: {said}. With 60 further generations they are "
        f"{100 * longer:.1f} instead of {100 * printed:.1f} % for Table 5 (sweep interpretations).",
    )


def judge_generation_of_the_fit(results: Results, number: int) -> Judged:
    """Judge the generation at which the paper shows a fit."""
    runs = results.runs_of(number)
    printed = runs.truth.published.generation
    if printed is None:
        raise LackingError("the config has no generation of the fit")
    stop, last = runs.found["generations"], runs.last_improvement
    low, high = np.percentile(stop, [5, 95])
    return Judged(
        by_range(printed, stop),
        f"Ours stop at generation {stop.median():.0f} ({low:.0f} to {high:.0f}), and last improve "
        f"at {last.median():.0f}.",
    )


def judge_early_orders(results: Results) -> Judged:
    """Judge whether orders of magnitude are there at the twentieth generation."""
    runs = results.runs_of(5)
    names = [name for name in runs.truth.model.names if name != "c_p"]
    shares = {
        at: [
            share_within_a_decade(runs.at_generation(at, name), runs.truth.parameters[name])
            for name in names
        ]
        for at in (_EARLY, _CONVERGED)
    }
    early, later = (
        ", ".join(f"{name} {100 * s:.0f} %" for name, s in zip(names, each, strict=True))
        for each in shares.values()
    )
    return Judged(
        altogether(map(by_share, shares[_EARLY])),
        f"Seeds within half a decade of the target at generation {_EARLY}: {early}; at "
        f"{_CONVERGED}: {later}.",
    )


def judge_orders_found(results: Results) -> Judged:
    """Judge whether orders of magnitude are found in the end."""
    return _orders(results, {5: ("k", "k_p", "c"), 6: ("k", "c"), 7: ("k", "c")})


def judge_orders_of_drop(results: Results) -> Judged:
    """Judge whether the orders of magnitude of Table 6's springs are found."""
    return _orders(results, {6: ("k", "k_p")})


def judge_simpler_models(results: Results) -> Judged:
    """Judge whether the general model's parameters are found in simpler samples."""
    return _orders(results, {6: ("k", "c"), 7: ("k", "c")})


def _orders(results: Results, names: dict[int, tuple[str, ...]]) -> Judged:
    said: list[str] = []
    verdicts: list[str] = []
    for number, each in names.items():
        runs = results.runs_of(number)
        shares = [
            share_within_a_decade(runs.identified(name), runs.truth.parameters[name])
            for name in each
        ]
        verdicts += map(by_share, shares)
        values = ", ".join(f"{n} {100 * s:.0f} %" for n, s in zip(each, shares, strict=True))
        said.append(f"Table {number}: {values}")
    return Judged(
        altogether(verdicts), f"Seeds within half a decade of the target: {'; '.join(said)}."
    )


def judge_cell_model(results: Results) -> Judged:
    """Judge whether any simpler model would do, and whether a trace tells which was right."""
    table = results.table("models")
    verdicts, said = [], []
    for number in _TABLES:
        case = results.case_of(number)
        mine = table[table["case"] == case]
        made = mine["model"].str.endswith("(made the traces)")
        simpler = mine[mine["parameters"] < int(mine.loc[made, "parameters"].iloc[0])]
        if simpler.empty:
            raise LackingError("the study compares no simpler sample models")
        fail = int((simpler["median_delta_bic"] > _APART).sum())
        verdicts.append(NOT if fail else REPLICATED)
        chosen = int(mine.loc[made, "chosen_by_bic"].iloc[0])
        said.append(
            f"Table {number}: {fail} of {len(simpler)}, {chosen} of {mine['seeds'].iloc[0]} traces"
        )
    return Judged(
        altogether(verdicts),
        "The paper fits only the model that made its traces. Simpler models that a trace refutes "
        f"(BIC higher by over {_APART:g}), and traces whose BIC prefers the one that made them: "
        f"{'; '.join(said)}.",
    )


def judge_robust(results: Results) -> Judged:
    """Judge robustness by errors over a sweep of noise beside those that noise allows."""
    points = results.of_sweep("robustness_noise")
    points = points[(points["row"] > 0) & np.isfinite(points["bound_percent"])]
    fine = points["error_genetic"] <= _NEAR_BOUND * _OF_MEDIAN * points["bound_percent"]
    shares = fine.groupby([points["case"], points["quantity"]], sort=False).mean()
    names = {results.case_of(number): number for number in _TABLES}
    said = ", ".join(
        f"{100 * share:.0f} % ({quantity}, Table {names[case]})"
        for (case, quantity), share in shares.items()
    )
    return Judged(
        altogether(map(by_share, shares)),
        f"Levels and kinds of noise at which the median error is at most {_NEAR_BOUND:g} times "
        f"that which noise allows: {said} (sweep robustness_noise).",
    )


def judge_feasible(results: Results) -> Judged:
    """Judge feasibility by what a trace determines."""
    said, verdicts = [], []
    for number in _TABLES:
        table = results.table(f"verdicts_{results.case_of(number)}")
        own = table[~table["quantity"].str.contains("+", regex=False)]
        determined = own.loc[own["verdict"] == "determined", "quantity"]
        verdicts += [REPLICATED if name in set(determined) else NOT for name in own["quantity"]]
        said.append(f"Table {number}: {', '.join(determined) if len(determined) else 'none'}")
    return Judged(altogether(verdicts), f"Parameters that a trace determines: {'; '.join(said)}.")


def judge_damper_dominates(results: Results) -> Judged:
    """Judge whether a bare damper says as much of Table 6's traces."""
    table = results.table("models")
    rows = table[(table["case"] == results.case_of(6)) & (table["model"] == "bare damper")]
    if rows.empty:
        raise LackingError("the study does not compare a bare damper")
    chosen, seeds = int(rows["chosen_by_bic"].iloc[0]), int(rows["seeds"].iloc[0])
    return Judged(
        by_share(chosen / seeds), f"BIC prefers a bare damper for {chosen} of {seeds} traces."
    )


def judge_spring_shows(results: Results) -> Judged:
    """Judge whether k is determined in Table 7's sample, and not in Table 6's."""
    determined = {}
    for number in (6, 7):
        table = results.table(f"verdicts_{results.case_of(number)}").set_index("quantity")
        determined[number] = str(table.loc["k", "expected_verdict"])
    right = [determined[6] != "determined", determined[7] == "determined"]
    return Judged(
        altogether(REPLICATED if each else IN_PART for each in right),
        f"Without noise k is {determined[6]} in Table 6's sample, {determined[7]} in Table 7's.",
    )
