"""Judge the claims of the paper in claims.yaml, which says how, by the tables of a study.

A claim names one of `JUDGES` with its numbers; each quantity and sample that it is said of has a
verdict of its own. The rules of verdicts stand in `workflow/report/tables/claims.rst`, the caption
of the table. A second table has the paper's Tables 5 to 7 beside what the study finds.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from string import Formatter
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import yaml
from scipy.special import bdtr

from biogrip.arrays import Array
from biogrip.judging.verdicts import DETERMINED
from biogrip.physics.gripper import ARM_KEYS
from biogrip.physics.noise import Noise, add_noise, stream
from biogrip.physics.protocol import sample_times
from biogrip_study.config.study import Case, Study
from biogrip_study.gripper.calibration import FreeMotion, calibrate, free_motion
from biogrip_study.records.identifications import (
    near_noise,
    read_histories,
    read_identifications,
    read_readings,
    share_with_limits,
)
from biogrip_study.records.rows import RowFile
from biogrip_study.stages.job import job_study, logged, paths
from biogrip_study.tables.cases import value_in_case
from biogrip_study.tables.layout import Column, Row, ShownTable, titled, write

if TYPE_CHECKING:
    snakemake: Any

REPLICATED, IN_PART, NOT = "replicated", "in part", "not"
TOO_FEW, UNDECIDED = "too few runs to tell", "cannot be told"
TOLD, ELSEWHERE = "not judged", "judged elsewhere"
MOST, FEW = 0.9, 0.1
"""Shares from which, and up to which, something holds nearly always or hardly ever."""
CLOSE, NEAR = 0.05, 0.1
"""Relative differences up to which a rounded number, and an identified value, is the paper's."""
AROUND = 10
"""Generations about the paper's that are still around it."""
FASTER = 1.25
"""Exponent of the noise up to which an error grows no faster than it."""
OWN = "two digits from 1"
"""Name of the encoding that the text describes, beside a reading that can print the tables."""

Judged = tuple[str, str, str]
"""What is judged, the verdict, and the evidence."""


class LackingError(Exception):
    """The study does not have what a claim is judged by."""


@dataclass(frozen=True)
class Results:
    """What claims are judged by."""

    study: Study
    tables: Mapping[str, pd.DataFrame]
    """Tables by name; `of_table` has the number of the paper's table that rows belong to."""

    def rows(self, table: str, of: Sequence[int], where: str) -> pd.DataFrame:
        """Return rows of a table; raise `LackingError` if there is none."""
        if table not in self.tables:
            raise LackingError(f"the study has no table {table}")
        rows = self.tables[table]
        rows = rows[rows["of_table"].isin(of)] if of else rows
        if rows.empty:
            raise LackingError(f"the study has no case of Table {' or '.join(map(str, of))}")
        rows = rows.query(where, local_dict={"study": self.study}) if where else rows
        if rows.empty:
            raise LackingError(f"the study has no such rows in its table {table}")
        return rows


def by_interval(low: float, high: float, few: float = FEW, most: float = MOST) -> str:
    """Judge something by the 95 % interval of the share of runs for which it holds."""
    if low >= most:
        return REPLICATED
    if high <= few:
        return NOT
    return IN_PART if few < low and high < most else TOO_FEW


def in_words(hits: int, runs: int) -> str:
    """Return a share in words, with its 95 % limits."""
    share, low, high = (100 * end for end in share_with_limits(hits, runs))
    return f"{share:.0f} % ({low:.0f} to {high:.0f} %) of {runs}"


def median_with_limits(values: Array) -> tuple[float, float, float]:
    """Return the median of values, (n,), and its 95 % interval from their order."""
    ordered, count = np.sort(values), len(values)
    binomial = bdtr(np.arange(count), count, 0.5)
    first = max(int(np.searchsorted(binomial, 0.025)) - 1, 0)
    return float(np.median(values)), float(ordered[first]), float(ordered[count - 1 - first])


class Evidence(Formatter):
    """Fills numbers into words: as Python does, but ``3p`` is 3 digits without an exponent."""

    def format_field(self, value: Any, format_spec: str) -> str:
        """Return a number as its format says, with a space before a percent sign."""
        if format_spec.endswith("p"):
            return f"{float(f'{value:.{format_spec[:-1]}g}'):,g}"
        text = str(super().format_field(value, format_spec))
        return text.replace("%", " %") if format_spec.endswith("%") else text


def judge_rows(
    results: Results,
    evidence: str,
    table: str,
    *,
    of: Sequence[int] = (),
    where: str = "",
    by: str | Sequence[str] = (),
    name: str = "",
    holds: str = "",
    each: str = "",
    count: Sequence[str] = (),
    around: Sequence[Any] = (),
    slope: Sequence[str] = (),
    unless: str = "",
) -> list[Judged]:
    """Judge rows of a table, those of each value of the columns `by` apart.

    Rows are those of tables of the paper (`of`) and of a condition (`where`). If they are runs,
    with a column `seed`, the share counts for which `holds` is true, with `each` in all rows of the
    same value. Else it has to be true of all rows. Instead of it, `count` names columns of hits and
    of runs, `around` a column whose median is to be near a number, and `slope` a column with its
    lowest and its highest value. Where `unless` is true nothing can be told. Runs of several
    readings are judged by the one that can print the paper's values, with the text's beside it.

    Conditions are those of pandas' `eval`. `name` and evidence may name, in braces, the `share`,
    the number of `rows`, of `hits` and of `misses`, the `study`, and statistics of columns, as in
    ``{median[misfit]:.2g}``.
    """
    judged = []
    rows = results.rows(table, of, where)
    for _, every in rows.groupby(by, sort=False) if by else [("", rows)]:
        group = every[every["able"]] if "able" in every and every["able"].any() else every
        numbers, verdict, values = group.select_dtypes("number"), "", group.to_dict("list")
        told: dict[str, Any] = {"study": results.study, "rows": len(group), "all": values}
        told |= {"first": {label: column[0] for label, column in values.items()}}
        told |= {"least": numbers.min(), "median": numbers.median(), "most": numbers.max()}
        told |= {f"p{percent}": numbers.quantile(percent / 100) for percent in (5, 25, 75, 95)}
        if holds:
            those = _those(results, group, holds, each)
            hits, runs = int(those.sum()), len(those)
            told |= {"hits": hits, "misses": runs - hits, "share": in_words(hits, runs)}
            if "seed" in group:
                verdict = by_interval(*share_with_limits(hits, runs)[1:])
            else:
                verdict = REPLICATED if hits == runs else NOT
        elif count:
            hits, runs = (int(group[column].sum()) for column in count)
            told["share"] = in_words(hits, runs)
            verdict = by_interval(*share_with_limits(hits, runs)[1:])
        elif around:
            told["middle"], low, high = median_with_limits(group[around[0]].to_numpy(float))
            told |= {"low": low, "high": high}
            inside = around[1] - AROUND <= low and high <= around[1] + AROUND
            outside = high < around[1] - AROUND or low > around[1] + AROUND
            verdict = REPLICATED if inside else NOT if outside else TOO_FEW
        elif slope:
            low, high = group[slope[1]].min(), group[slope[2]].max()
            verdict = REPLICATED if high <= FASTER else NOT if low > FASTER else TOO_FEW
        if unless and group.eval(unless).all():
            verdict = UNDECIDED
        said = Evidence().format(evidence, **told)
        if len(group) < len(every) and holds:
            beside = _those(results, every[~every["able"]], holds, each)
            said = f"{said[:-1]}; with {OWN} {in_words(int(beside.sum()), len(beside))}."
        judged.append((Evidence().format(name, **told), verdict, said))
    return judged


def _those(results: Results, rows: pd.DataFrame, holds: str, each: str) -> Any:
    those = rows.eval(holds, local_dict={"study": results.study})
    return those.groupby(rows[each]).all() if each else those


def judge_jaw_gap(results: Results, evidence: str) -> list[Judged]:
    """Judge by how much the angle at contact changes what is found, beside what noise allows."""
    angles = np.radians(results.rows("contact", (), "")["reference_angle_deg"].to_numpy(float))
    scale = np.sin(angles) ** 2
    change = 100 * float(np.nanmax(scale) / np.nanmin(scale) - 1)
    noise = float(results.rows("coverage", (), "")["bound_percent"].min())
    said = evidence.format(change=change, noise=noise)
    return [("", REPLICATED if change <= noise else NOT, said)]


def judge_free_arm(results: Results, evidence: str) -> list[Judged]:
    """Judge by a calibration from a free arm's simulated responses to a step and an impulse."""
    case = next(iter(results.study.cases.values()))
    test, arm = case.block.calibration, case.gripper.left
    time_s = sample_times(test.duration_s, test.rate_Hz)
    causes = test.step_torque_Nm, test.impulse_Nms
    motion = free_motion(arm, time_s, *causes)
    noise = Noise("gaussian", test.noise_level, "peak")
    rng = stream(results.study.config.study_seed, "claims", 0, "calibration")
    step, impulse = (add_noise(each, noise, rng) for each in (motion.step, motion.impulse))
    found = calibrate(FreeMotion(time_s, step, impulse), *causes).arm
    errors = [100 * abs(getattr(found, key) / getattr(arm, key) - 1) for key in ARM_KEYS]
    verdict = REPLICATED if max(errors) <= 100 * CLOSE else NOT
    return [("", verdict, evidence.format(*errors, noise=100 * test.noise_level))]


JUDGES: Mapping[str, Any] = {
    "rows": judge_rows,
    "jaw_gap": judge_jaw_gap,
    "free_arm": judge_free_arm,
}


def judge(claim: Mapping[str, Any], results: Results) -> list[Judged]:
    """Judge a claim; what nothing can contradict is only told."""
    ((name, numbers),) = ((name, claim[name]) for name in JUDGES if name in claim)
    try:
        judged = JUDGES[name](results, claim["evidence"], **(numbers or {}))
    except LackingError as lacking:
        if "elsewhere" in claim:
            return [("", ELSEWHERE, f"{claim['elsewhere']} has what it takes.")]
        return [("", UNDECIDED, f"Not here: {lacking}.")]
    return [(what, TOLD if claim.get("told") else verdict, said) for what, verdict, said in judged]


def judge_all(claims: Sequence[Mapping[str, Any]], results: Results, caption: str) -> ShownTable:
    """Judge every claim by the study's results."""
    rows: list[Row] = [
        {"claim": claim["words"], "place": claim["place"], "of": what}
        | {"verdict": verdict, "evidence": said}
        for claim in claims
        for what, verdict, said in judge(claim, results)
    ]
    headings = ("Claim of the paper", "Place", "Of", "Verdict", "Evidence")
    names = ("claim", "place", "of", "verdict", "evidence")
    return ShownTable(caption, tuple(map(Column, names, headings)), rows)


_COMPARED_COLUMNS = (
    Column("case", "Sample"),
    *titled("quantity", "unit"),
    Column("target", "Target", 4),
    Column("printed_from", "Paper from", 4),
    Column("printed_to", "to", 4),
    Column("error_from_percent", "Its error % from", 2),
    Column("error_to_percent", "to", 2),
    *titled("reading", "runs"),
    Column("median_error_percent", "Median error of a run %", 2),
    Column("median_from_percent", "from", 2),
    Column("median_to_percent", "to", 2),
    Column("p25", "Quartiles from", 3),
    Column("p75", "to", 3),
    Column("near_share", "Share near the paper's value", 2),
    Column("near_from", "from", 2),
    Column("near_to", "to", 2),
    Column("verdict", "Verdict"),
)


def compared(results: Results) -> ShownTable:
    """Put the paper's Tables 5 to 7 beside what the runs of the study find."""
    rows: list[Row] = []
    values = results.tables.get("values", pd.DataFrame())
    for (reading, case, quantity), runs in (
        values.groupby(["reading", "case", "quantity"], sort=False) if len(values) else ()
    ):
        first, row = runs.iloc[0], {"case": case, "quantity": quantity, "reading": reading}
        row |= {name: first[name] for name in ("unit", "target", "printed_from", "printed_to")}
        row |= {f"error_{end}_percent": first[f"printed_error_{end}"] for end in ("from", "to")}
        row |= {"runs": len(runs), **{f"p{p}": runs["value"].quantile(p / 100) for p in (25, 75)}}
        medians = median_with_limits(runs["error"].to_numpy(float))
        row |= zip((f"median_{n}_percent" for n in ("error", "from", "to")), medians, strict=True)
        near = share_with_limits(int(runs["near"].sum()), len(runs))
        row |= zip(("near_share", "near_from", "near_to"), near, strict=True)
        verdict = by_interval(*near[1:]) if first["encodable"] else "its genes lack the value"
        rows.append(row | {"verdict": verdict if first["determined"] else UNDECIDED})
    caption = (
        "The paper's Tables 5 to 7 beside the runs of this study, by readings of the paper. The "
        "paper's value from and to: what is printed so with the printed error. Errors of a run are "
        "absolute; their median has its 95 % interval. Near: within "
        f"{NEAR:.0%} of the paper's value, with 95 % limits, by which the verdict is; it cannot be "
        "told where no trace determines the quantity."
    )
    return ShownTable(caption, _COMPARED_COLUMNS, rows)


def read_results(
    study: Study,
    identifications: Sequence[Path],
    histories: Sequence[Path],
    files: Sequence[Path],
    read: Sequence[Path] = (),
) -> Results:
    """Read the tables of a study, and the runs on the paper's cases, of files in their order.

    Runs under readings of the paper are in files named like their case.
    """
    tables = {file.stem: RowFile("a table", words=None).read(file) for file in files}
    add_columns(tables)
    verdicts = [table for name, table in tables.items() if name.startswith("verdicts_")]
    tables["verdicts"] = pd.concat(verdicts, ignore_index=True)
    runs: dict[str, list[pd.DataFrame]] = {}
    for case, found, best in zip(study.cases.values(), identifications, histories, strict=True):
        if study.shown_method.name == "genetic":
            for at, own in read_runs(case, found, best).items():
                others = [file for file in read if file.stem == case.name and not at]
                both = [own.assign(able=False)]
                both += [read_reading(study, tables["readings"], file) for file in others]
                every = pd.concat(both, ignore_index=True).assign(case=case.name)
                if not at:
                    runs.setdefault("runs", []).append(every)
                runs.setdefault(f"values{at}", []).append(values_of(case, every, tables))
    tables |= {name: pd.concat(each, ignore_index=True) for name, each in runs.items()}
    cases = study.cases.values()
    numbers = {name: case.published.table for case in cases for name in (case.name, case.title)}
    for table in tables.values():
        if "case" in table:
            table["of_table"] = table["case"].map(numbers).astype("Int64")
    return Results(study, tables)


def read_reading(study: Study, readings: pd.DataFrame, file: Path) -> pd.DataFrame:
    """Return the runs of a case under the reading that can print the most of the paper's values."""
    best = readings["with_error"].idxmax()
    name, block = list(study.config.readings.items())[best]
    found = read_readings(file, study.cases[file.stem])
    found = found[found["reading"] == name].copy()
    found["near_noise"] = near_noise(found, study.near_noise_tolerance)
    holds = readings.loc[best, "with_error"] == readings.loc[best, "values"]
    return found.assign(able=True, reading=block.title, encodable=holds)


def add_columns(tables: dict[str, pd.DataFrame]) -> None:
    """Add what claims need of several rows of a table, or cannot be said by pandas' `eval`."""
    if "evidence" in tables:
        told = tables["evidence"]
        printed = pd.to_numeric(told["paper"].str.removeprefix("about "), errors="coerce")
        close = abs(told["this_study"] / printed - 1) <= CLOSE
        told["as_printed"] = close.where(told["quantity"].str.contains("voltage for .* N m"))
    if "contact" in tables:
        tables["contact"]["closing_deg"] = np.degrees(1e-3 * tables["contact"]["closing_mrad"])
    if "methods" in tables:
        ends = tables["methods"].groupby("case")[["reached_low", "reached_high"]]
        apart = ends.transform("max")["reached_low"] > ends.transform("min")["reached_high"]
        # Where there is one method alone there is nothing to compare.
        several = tables["methods"]["method"].nunique() > 1
        tables["methods"]["apart"] = apart if several else np.nan
    if "robustness_gripper" in tables:
        sweep = tables["robustness_gripper"]
        bounds = sweep.groupby(["case", "quantity"])["bound_percent"]
        sweep["bound_change"] = bounds.transform("max") / bounds.transform("min")
    if "robustness_noise" in tables:
        sweep = tables["robustness_noise"]
        noisy = sweep[sweep["row"] > 0]
        tables["slopes"] = pd.DataFrame(
            {"case": case, "quantity": quantity, **_slope(rows)}
            for (case, quantity), rows in noisy.groupby(["case", "quantity"], sort=False)
        )
    if "models" in tables:
        models = tables["models"]
        makers = models[models["model"].str.endswith("(made the traces)")].set_index("case")
        models["simpler"] = models["parameters"] < models["case"].map(makers["parameters"])
        models["for_maker"] = models["case"].map(makers["chosen_by_bic"])


def _slope(rows: pd.DataFrame) -> Row:
    """Return the exponent with which errors grow with the noise, and their size beside bounds."""
    noise, error = np.log(rows[["row", "error_genetic"]].to_numpy(float).T)
    (slope, _), spread = np.polyfit(noise, error, 1, cov=True)
    wide = 1.96 * float(np.sqrt(spread[0, 0]))
    # Rounded, for errors that do not change at all leave rounding.
    ends = [round(end, 2) + 0.0 for end in (slope, slope - wide, slope + wide)]
    # The median absolute error of an unbiased Gaussian estimate is 0.6745 standard deviations.
    over = (rows["error_genetic"] / (0.6745 * rows["bound_percent"])).median()
    at = rows.groupby("row")["error_genetic"].median()
    sizes = {"over_bound": over, "first": at.iloc[0], "last": at.iloc[-1]}
    sizes |= {"first_noise": at.index[0], "last_noise": at.index[-1]}
    return dict(zip(("slope", "slope_from", "slope_to"), ends, strict=True)) | sizes


def read_runs(case: Case, identifications: Path, histories: Path) -> dict[str, pd.DataFrame]:
    """Return the genetic algorithm's runs on a case, a row a seed; at the end and generation 20.

    Parameters stand by name in the place of their columns.
    """
    names = {p.column: p.name for p in case.sample.model.parameters}
    found = read_identifications(identifications, case, "genetic").rename(columns=names)
    best = read_histories(histories, "genetic", ["best_misfit", *names]).rename(columns=names)
    change = best.groupby("seed")["best_misfit"].diff()
    falls = best["generation"].where(change < 0, 0).groupby(best["seed"]).max()
    found["near_noise"] = near_noise(found, case.study.near_noise_tolerance)
    found = found.assign(last_improvement=found["seed"].map(falls))
    # Of a run that has stopped before, the last generation.
    at_20 = best[best["generation"] <= 20].groupby("seed", as_index=False).last()
    return {"": found.assign(reading=OWN), " at 20": at_20.assign(reading=OWN)}


def values_of(case: Case, runs: pd.DataFrame, tables: Mapping[str, pd.DataFrame]) -> pd.DataFrame:
    """Return a row for every quantity and run: its value beside the truth and the paper's value.

    Errors are absolute, in percent.
    """
    printed = tables["printed_values"]
    printed = printed[(printed["case"] == case.name) & (printed["quantity"] == "identified")]
    held = printed.set_index("parameter")["encodable"] == "yes"
    expected = tables[f"verdicts_{case.name}"].set_index("quantity")
    rows = []
    for quantity in case.sample.model.quantities:
        names = [parameter.name for parameter in quantity]
        label, truth = " + ".join(names), sum(case.parameters[name] for name in names)
        paper, *ends = value_in_case(case, names) or 3 * (np.nan,)
        sizes = [100 * abs(end / truth - 1) for end in ends]
        # A target between the ends may have no error.
        least = 0.0 if ends[0] <= truth <= ends[1] else min(sizes)
        values = runs[names].sum(axis=1)
        # Sums have many ways to be made.
        own = len(names) > 1 or bool(held.get(names[0], False))
        columns = {
            "value": values,
            "error": 100 * abs(values / truth - 1),
            "decades": abs(np.log10(values.clip(lower=1e-300) / truth)),
            "near": abs(values / paper - 1) <= NEAR,
            "encodable": runs["encodable"].where(runs["able"], own) if runs["able"].any() else own,
        }
        head = {"quantity": label, "unit": quantity[0].unit, "target": truth}
        head |= {"printed_from": ends[0], "printed_to": ends[1], "printed_error_from": least}
        head |= {"printed_error_to": max(sizes), "sum": len(names) > 1}
        head |= {"determined": expected["expected_verdict"][label] == DETERMINED}
        head |= {"expected_high": expected["expected_high"][label]}
        head |= {"noise_percent": 100 * case.noise.level}
        kept = runs[["case", "seed", "reading", "able"]]
        rows.append(kept.assign(**head, **columns))
    return pd.concat(rows)


if __name__ == "__main__":
    with logged(snakemake):
        given = snakemake.input
        of_paper = job_study(snakemake)
        of_paper = of_paper.of(of_paper.published)
        files = (given.identifications, given.histories, given.tables, given.readings)
        results = read_results(of_paper, *map(paths, files))
        claims = yaml.safe_load(Path(given.claims).read_text(encoding="utf-8"))
        caption = " ".join(Path(given.caption).read_text(encoding="utf-8").split())
        write(judge_all(claims, results, caption), Path(snakemake.output.table))
        write(compared(results), Path(snakemake.output.compared))
