"""Tables of a whole study: methods and models on its traces, and how often limits are true."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.special import betaincinv

import biogrip_study.records.identifications as records
from biogrip.fit.nested_fits import aic_and_bic
from biogrip.judging.likelihood import Quantity, bounds_percent, parameters_and_sum, quantity_value
from biogrip.judging.profiles import DETERMINED, NOT_DETERMINED
from biogrip.levels import WIDE
from biogrip_study.config.study import Case, Study
from biogrip_study.methods.registry import METHODS
from biogrip_study.records.rows import seeds_of
from biogrip_study.stages.targets import noise_of_readings
from biogrip_study.tables.cases import error_percent
from biogrip_study.tables.layout import Column, Row, ShownTable, titled

_METHOD_COLUMNS = (
    *titled("case", "method", "seeds"),
    Column("reached_share", "Share that reached the best encodable point", 2),
    Column("reached_low", "95 % from", 2),
    Column("reached_high", "95 % to", 2),
    Column("median_rise", "Median Δχ²", 2),
    Column("encodable_rise", "Median Δχ² of that point", 2),
    Column("median_evaluations", "Median responses", 3),
)


def methods(study: Study, identifications: list[Path]) -> ShownTable:
    """Compare success rate, errors and cost of each method."""
    rows = []
    labels = {}
    for (name, case), path in zip(study.cases.items(), identifications, strict=True):
        identified = records.read_identifications(path, case)
        identified["increase"] = records.chi_square_increase(identified, case)
        identified["least"] = records.chi_square_increase(identified, case, records.ENCODABLE)
        identified["reached"] = records.reached_encodable(identified, case)
        for method, mine in identified.groupby("method", sort=False):
            row: Row = {
                "case": name,
                "method": METHODS[method].title,
                "seeds": len(mine),
                "median_rise": mine["increase"].median(),
                "encodable_rise": mine["least"].median(),
                "median_evaluations": mine["evaluations"].median(),
            }
            shares = records.share_with_limits(int(mine["reached"].sum()), len(mine))
            row |= zip(("reached_share", "reached_low", "reached_high"), shares, strict=True)
            for label, values in records.values_by_quantity(mine, case.sample.model).items():
                error = error_percent(quantity_value(label, case.parameters), values)
                row[f"error_percent {label}"] = abs(error).median()
                labels[f"error_percent {label}"] = f"Error {label} %"
            rows.append(row)
    errors = (Column(name, heading, 2) for name, heading in labels.items())
    caption = (
        "Methods on the same traces. Reached: chi-squared, in mean squares of that point, at most "
        f"{study.optimum_tolerance:g} above that of the best point that the genes can encode of "
        "the trace (95 % interval by Wilson); methods without digits may lie below. That point is "
        "the lowest around the ends of all methods' runs: were there a lower one, a run that is "
        "just within the bound would not count. Δχ² is above the lowest that any method, or the "
        "truth, has on the trace. Errors are medians of the absolute error."
    )
    return ShownTable(caption, (*_METHOD_COLUMNS, *errors), rows)


_MODEL_COLUMNS = (
    *titled("case", "model", "parameters"),
    Column("median_delta_aic", "Median ΔAIC", 3),
    Column("median_delta_bic", "Median ΔBIC", 3),
    Column("chosen_by_aic", "Chosen by AIC"),
    Column("chosen_by_bic", "Chosen by BIC"),
    Column("seeds", "Seeds"),
)


def models(study: Study, fits: list[Path]) -> ShownTable:
    """Count over seeds which model has the lowest AIC and BIC, see `aic_and_bic`."""
    fitted = pd.concat([read_fits(study, path) for path in fits], ignore_index=True)
    told = fitted["misfit"], fitted["samples"], fitted["parameters"]
    fitted["aic"], fitted["bic"] = aic_and_bic(*told)
    for name in ("aic", "bic"):
        of_traces = fitted.groupby(["case", "seed"])[name]
        fitted[f"delta_{name}"] = fitted[name] - of_traces.transform("min")
        # Of equals the first, in the configured order.
        fitted[f"by_{name}"] = fitted.index.isin(of_traces.idxmin())
    rows: list[Row] = []
    for (case, candidate), of_model in fitted.groupby(["case", "model"], sort=False):
        made = study.cases[case]
        maker, model = candidate == made.sample.candidate, made.models[candidate].model
        row: Row = {"case": case, "parameters": len(model.names), "seeds": len(of_model)}
        row["model"] = model.title + " (made the traces)" * (maker and not made.recorded)
        for name in ("aic", "bic"):
            row[f"median_delta_{name}"] = of_model[f"delta_{name}"].median()
            row[f"chosen_by_{name}"] = of_model[f"by_{name}"].sum()
        rows.append(row)
    caption = (
        "Simplest adequate model: by how much each model's AIC and BIC exceed the lowest, and in "
        "how many seeds it has the lowest."
    )
    return ShownTable(caption, _MODEL_COLUMNS, rows)


def read_fits(study: Study, path: Path) -> pd.DataFrame:
    """Read the fits of every model of a case, in the seeds of a batch."""
    case = study.cases[path.parent.name]
    return records.MODEL_FITS.read(
        path, case=[case.name], model=case.models, seed=seeds_of(path.stem)
    )


_COVERAGE_COLUMNS = (
    *titled("case", "quantity", "unit"),
    Column("target", "Target", 4),
    Column("bound_percent", "Cramér-Rao bound, rest known %", 3),
    Column("spread_percent", "Spread %", 3),
    Column("spread_over_bound", "Spread / bound", 3),
    Column("bias_percent", "Bias %", 2),
    Column("confidence_percent", "Confidence %", 4),
    Column("coverage_percent", "Intervals that hold the truth %", 3),
    Column("seeds", "Seeds"),
)


def coverage(study: Study, intervals: list[Path]) -> ShownTable:
    """Compare estimates and intervals of many seeds with the true values and the bound."""
    rows: list[Row] = []
    bounds = {
        (name, quantity.label): percent
        for name, case in study.cases.items()
        for quantity, percent in bounds_at_truth(case)
    }
    for case, head, estimated in _by_quantity(study, intervals):
        fitted = estimated[estimated["estimate"].notna()]
        if fitted.empty:
            continue
        errors = np.log(fitted["estimate"].to_numpy(float) / head["target"])
        spread, bound = 100 * np.std(errors, ddof=1), bounds[case.name, head["quantity"]]
        rows.append(
            {
                **head,
                "bound_percent": bound,
                "spread_percent": spread,
                "spread_over_bound": spread / bound,
                "bias_percent": np.mean(100 * errors),
                "confidence_percent": 100 * case.confidence,
                "coverage_percent": 100 * np.mean(_holds(fitted, head["target"])),
                "seeds": len(fitted),
            }
        )
    caption = (
        "Least squares over many seeds, for every quantity that a case's traces should determine: "
        "standard deviation of the estimates' logarithms beside the Cramér-Rao bound, and how "
        "often the intervals hold the truth. The bound is for a simpler problem than that of the "
        "fits: parameters without information in the traces are fixed. Fits search these too; as "
        "they are near zero they can only be overestimated, at the expense of others: hence the "
        "bias, and a spread above the bound."
    )
    return ShownTable(caption, _COVERAGE_COLUMNS, rows)


def _by_quantity(
    study: Study, intervals: Sequence[Path]
) -> Iterator[tuple[Case, Row, pd.DataFrame]]:
    """Yield what the first columns say of every quantity of a case, and its rows of all batches."""
    estimated = pd.concat([read_intervals(study, path) for path in intervals], ignore_index=True)
    for name, case in study.cases.items():
        of_case = estimated[estimated["case"] == name]
        for quantity in parameters_and_sum(case.experiment.searched):
            target = quantity_value(quantity.label, case.parameters)
            head = {"case": name, "quantity": quantity.label, "unit": quantity.unit}
            yield case, head | {"target": target}, of_case[of_case["quantity"] == quantity.label]


def bounds_at_truth(case: Case) -> list[tuple[Quantity, float]]:
    """Return the `bounds_percent` of what is searched of a case, at its true parameters.

    The noise is that of its traces, whatever gripper the identification assumes.
    """
    noise_sd = noise_of_readings(case, case.times_s)
    return bounds_percent(case.experiment, noise_sd, case.parameters, case.times_s)


def read_intervals(study: Study, path: Path) -> pd.DataFrame:
    """Read the intervals of a batch of a case, a row for each quantity and seed."""
    case = study.cases[path.parent.name]
    every = [quantity.label for quantity in parameters_and_sum(case.experiment.searched)]
    return records.INTERVALS.read(path, case=[case.name], quantity=every, seed=seeds_of(path.stem))


def _holds(limits: pd.DataFrame, truth: float, which: str = "") -> "pd.Series[bool]":
    """Return whether limits hold the true value, (n_rows,); an open side does."""
    low, high = limits[f"{which}low"].fillna(0.0), limits[f"{which}high"].fillna(np.inf)
    return low.le(truth) & high.ge(truth)


_COUNT_COLUMNS = (
    *titled("case", "quantity", "unit"),
    Column("target", "Target", 4),
    *titled("verdict", "seeds"),
    Column("reached", "With this verdict"),
    *(Column(f"reached_{end}_percent", f"{end.title()} %") for end in ("from", "to")),
    Column("narrow", f"Within a factor of {WIDE:g}"),
    Column("true", "True"),
    Column("true_percent", "True %"),
    *(Column(f"true_{end}_percent", f"{end.title()} %") for end in ("from", "to")),
)


def verdict_counts(study: Study, intervals: list[Path]) -> ShownTable:
    """Count verdicts of whole profiles, and those whose limits hold the true value."""
    rows = [
        head | row
        for _, head, estimated in _by_quantity(study, intervals)
        for row in _counts(estimated[estimated["verdict"].notna()], head["target"])
    ]
    percents = " or ".join(sorted({f"{100 * case.confidence:g}" for case in study.cases.values()}))
    caption = (
        f"Verdicts from whole profiles at {percents} %, as users are shown them: "
        "how often each is reached, with the 95 % interval of its share, and how often its limits "
        "hold the true value, with the 95 % interval of that share (Clopper and Pearson)."
    )
    return ShownTable(caption, _COUNT_COLUMNS, rows)


def _counts(judged: pd.DataFrame, target: float | None) -> Iterator[Row]:
    for verdict, mine in judged.groupby("verdict"):
        count = len(mine)
        row: Row = {"verdict": verdict, "seeds": len(judged), "reached": count}
        row |= _interval("reached", count, len(judged))
        if verdict == DETERMINED:
            row["narrow"] = np.sum(mine["shown_high"] <= WIDE**2 * mine["shown_low"])
        if verdict != NOT_DETERMINED and target is not None:
            true = int(np.sum(_holds(mine, target, "shown_")))
            row |= {"true": true, "true_percent": 100 * true / count}
            row |= _interval("true", true, count)
        yield row


def _interval(name: str, count: int, tried: int) -> Row:
    """Return the 95 % interval of Clopper and Pearson for a share, in percent."""
    missed = tried - count
    low = betaincinv(count, missed + 1, 0.025) if count else 0.0
    high = betaincinv(count + 1, missed, 0.975) if missed else 1.0
    return {f"{name}_from_percent": 100 * low, f"{name}_to_percent": 100 * high}
