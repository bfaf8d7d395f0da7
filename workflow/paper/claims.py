"""Judge the claims of the paper in claims.yaml, which says how, by the tables of a study.

A claim names one of `JUDGES` with its numbers; each quantity and sample that it is said of has a
verdict of its own. Runs of the genetic algorithm have a verdict under each interpretation of the
paper that is not excluded; where these differ, the claim depends on the interpretation. The rules
of verdicts stand in `workflow/report/tables/claims.rst`, the caption of the table. A second table
has the paper's Tables 5 to 7 beside what the study finds.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from string import Formatter
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import yaml
from scipy.special import bdtr

from biogrip.arrays import Array
from biogrip.judging.likelihood import bounds_percent
from biogrip.judging.profiles import DETERMINED
from biogrip.levels import DETERMINED_PERCENT
from biogrip.physics.gripper import ARM_KEYS, Gripper
from biogrip.physics.noise import Noise, add_noise, stream
from biogrip.physics.protocol import sample_times
from biogrip_study.config.study import Case, Study
from biogrip_study.gripper.calibration import calibrate, free_motion
from biogrip_study.records.identifications import (
    near_noise,
    read_histories,
    read_identifications,
    read_readings,
    share_with_limits,
)
from biogrip_study.records.rows import RowFile
from biogrip_study.stages.job import job_study, logged, paths
from biogrip_study.stages.targets import noise_of_readings
from biogrip_study.tables.cases import value_in_case
from biogrip_study.tables.layout import Column, Row, ShownTable, titled, write

if TYPE_CHECKING:
    snakemake: Any

REPLICATED, IN_PART, NOT = "replicated", "in part", "not"
UNDECIDED, DEPENDS = "undecided", "depends on the interpretation"
UNIDENTIFIABLE = "not identifiable"
TOLD, ELSEWHERE = "not judged", "judged elsewhere"
MOST, FEW = 0.9, 0.1
"""Shares from which, and up to which, something holds nearly always or hardly ever."""
CLOSE, NEAR = 0.05, 0.1
"""Relative differences up to which a rounded number, and an identified value, is the paper's."""
AROUND = 10
"""Generations about the paper's that are still around it."""
PAPERS_NOISE = 0.1
"""The paper's noise, as a share of the peak."""
REFUTED = 10
"""Rise of BIC from which a model is refuted."""
EXCLUDED = "excluded"
"""Verdict on a reading that its likelihood rules out."""
TEXT = "two digits from 1"
"""Name of the encoding that the text describes, by which the study's own runs are made."""

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
        """Return rows of a table, of the paper's cases alone if it has rows of cases.

        Raises `LackingError` if there is none.
        """
        if table not in self.tables:
            raise LackingError(f"the study has no table {table}")
        rows = self.tables[table]
        if "of_table" in rows:
            rows = rows[rows["of_table"].isin(of) if of else rows["of_table"].notna()]
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
    return IN_PART if few < low and high < most else UNDECIDED


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
    **rule: Any,
) -> list[Judged]:
    """Judge rows of a table, those of each value of the columns `by` apart, by a `rule`.

    Rows are those of tables of the paper (`of`) and of a condition (`where`). The rule has the
    keywords of `decide`. Runs, which have a column `judging`, are judged under each of their
    readings of the paper for which it is true; the evidence is that of the first, and the range
    over the others, with the runs of the text's encoding beside it if these do not judge.

    `name` and evidence may name, in braces, the `share`, the number of `rows`, of `hits` and of
    `misses`, the `study`, and statistics of columns, as in ``{median[misfit]:.2g}``.
    """
    judged = []
    rows = results.rows(table, of, where)
    for _, group in rows.groupby(by, sort=False) if by else [("", rows)]:
        told = _statistics(group) | {"study": results.study}
        what = Evidence().format(name, **told)
        if "judging" in group:
            judged.append((what, *_judge_runs(results, group, evidence, rule)))
        else:
            verdict, _, more = decide(results, group, **rule)
            judged.append((what, verdict, Evidence().format(evidence, **told | more)))
    return judged


def _judge_runs(
    results: Results, group: pd.DataFrame, evidence: str, rule: Mapping[str, Any]
) -> tuple[str, str]:
    """Return the verdict on runs under all readings that judge, and the evidence."""
    found = {
        str(title): (runs, *decide(results, runs, **rule))
        for title, runs in group[group["judging"]].groupby("reading", sort=False)
    }
    title, (runs, *_, more) = next(iter(found.items()))
    said = Evidence().format(evidence, **_statistics(runs), study=results.study, **more)
    verdicts = [verdict for _, verdict, *_ in found.values()]
    if not rule:
        return verdicts[0], said
    said += f" Runs have {title}"
    beside = group[~group["judging"] & (group["reading"] == TEXT)]
    if len(beside):
        said += f"; with {TEXT} it is {decide(results, beside, **rule)[2]['number']}"
    if len(found) > 1:
        ordered = sorted(found.items(), key=lambda item: item[1][2])
        ends = (f"{of[3]['number']} (“{name}”)" for name, of in (ordered[0], ordered[-1]))
        counts = (f"{count} {verdict}" for verdict, count in Counter(verdicts).items())
        said += f"; over {len(found)} interpretations {' to '.join(ends)}, {', '.join(counts)}"
    return agreed(verdicts), f"{said}."


def agreed(verdicts: Sequence[str]) -> str:
    """Return the verdict in which those under all readings agree; what is undecided denies none."""
    decided = {*verdicts} - {UNDECIDED}
    return DEPENDS if len(decided) > 1 else UNDECIDED if UNDECIDED in verdicts else decided.pop()


def _statistics(group: pd.DataFrame) -> dict[str, Any]:
    """Return what evidence may name of a group of rows, whatever the rule."""
    numbers = group.select_dtypes("number")
    told = {"rows": len(group), "first": {column: group[column].iloc[0] for column in group}}
    told |= {"least": numbers.min(), "median": numbers.median(), "most": numbers.max()}
    return told | {f"p{percent}": numbers.quantile(percent / 100) for percent in (5, 95)}


def decide(
    results: Results,
    group: pd.DataFrame,
    *,
    holds: str = "",
    each: str = "",
    fails: str = "",
    count: Sequence[str] = (),
    around: Sequence[Any] = (),
    unless: str = "",
) -> tuple[str, float, dict[str, Any]]:
    """Return the verdict on rows, the number that decides, and what evidence may name of it.

    If rows are runs, with a column `seed`, the share counts for which `holds` is true, with `each`
    in all rows of the same value. Else it has to be true of all rows; where `fails` is given and
    not true of all, it may hold in part. Instead of it, `count` names columns of hits and of runs,
    and `around` a column whose median is to be near a number. Where `unless` is true no trace tells
    anything. Conditions are those of pandas' `eval`.
    """
    verdict, number, told = "", 0.0, dict[str, Any]()
    if around:
        number, low, high = median_with_limits(group[around[0]].to_numpy(float))
        told = {"middle": number, "low": low, "high": high, "number": f"{number:.0f}"}
        inside = around[1] - AROUND <= low and high <= around[1] + AROUND
        outside = high < around[1] - AROUND or low > around[1] + AROUND
        verdict = REPLICATED if inside else NOT if outside else UNDECIDED
    elif holds or count:
        hits, runs = _counted(results, group, holds, each, count)
        number, *limits = share_with_limits(hits, runs)
        told = {"hits": hits, "misses": runs - hits, "share": in_words(hits, runs)}
        told["number"] = f"{100 * number:.0f} %"
        if "seed" in group or count:
            verdict = by_interval(*limits)
        elif hits == runs:
            verdict = REPLICATED
        else:
            verdict = IN_PART if fails and not group.eval(fails).all() else NOT
    if unless and group.eval(unless).all():
        verdict = UNIDENTIFIABLE
    return verdict, number, told


def _counted(
    results: Results, rows: pd.DataFrame, holds: str, each: str, count: Sequence[str]
) -> tuple[int, int]:
    """Return how often something holds, and of how many."""
    if count:
        hits, runs = (int(rows[column].sum()) for column in count)
        return hits, runs
    those = rows.eval(holds, local_dict={"study": results.study})
    those = those.groupby(rows[each]).all() if each else those
    return int(those.sum()), len(those)


def judge_grippers(
    results: Results,
    evidence: str,
    *,
    others: Callable[[Results, Gripper], Iterator[Gripper]],
    changes: bool,
) -> list[Judged]:
    """Judge by the factor by which other grippers, known, change what noise allows at best.

    The noise is that of the case in rad. `changes` tells which of both is claimed.
    """
    judged = []
    for case in results.study.cases.values():
        noise_sd = noise_of_readings(case, case.times_s)
        every = []
        for gripper in (case.gripper, *others(results, case.gripper)):
            problem = replace(case.experiment, gripper=gripper)
            bounds = bounds_percent(problem, noise_sd, case.parameters, case.times_s)
            every.append([bound for _, bound in bounds])
        told = np.array(every)[:, np.array(every[0]) < DETERMINED_PERCENT]
        factor = float(np.max(told.max(axis=0) / told.min(axis=0)))
        said = evidence.format(factor=factor)
        claimed = factor > 1 + NEAR if changes else factor <= 1 + CLOSE
        judged.append((f"Table {case.published.table}", REPLICATED if claimed else NOT, said))
    return judged


def _at_contact(results: Results, gripper: Gripper) -> Iterator[Gripper]:
    for angle in results.rows("contact", (), "")["reference_angle_deg"].dropna():
        yield replace(gripper, reference_angle_deg=float(angle))


def _devices(_: Results, gripper: Gripper) -> Iterator[Gripper]:
    """Yield grippers with arms of two thirds to four thirds the length, half to twice as stiff."""
    for factor in (2 / 3, 4 / 3):
        yield replace(gripper, arm_length_m=factor * gripper.arm_length_m)
    for factor in (0.5, 2.0):
        left, right = (
            replace(arm, stiffness_Nm_per_rad=factor * arm.stiffness_Nm_per_rad)
            for arm in (gripper.left, gripper.right)
        )
        yield replace(gripper, left=left, right=right)


def judge_free_arm(results: Results, evidence: str) -> list[Judged]:
    """Judge by a calibration from a free arm's simulated responses to a step and an impulse."""
    case = next(iter(results.study.cases.values()))
    test, arm = case.block.calibration, case.gripper.left
    time_s = sample_times(test.duration_s, test.rate_Hz)
    causes = test.step_torque_Nm, test.impulse_Nms
    motion = free_motion(arm, time_s, *causes)
    noise = Noise("gaussian", test.noise_level, "peak")
    rng = stream(results.study.config.study_seed, "claims", 0, "calibration")
    measured = np.stack([add_noise(clean, noise, rng) for clean in motion])
    fitted, _ = calibrate(time_s, measured, *causes)
    errors = [100 * abs(getattr(fitted, key) / getattr(arm, key) - 1) for key in ARM_KEYS]
    verdict = REPLICATED if max(errors) <= 100 * CLOSE else NOT
    return [("", verdict, evidence.format(*errors, noise=100 * test.noise_level))]


JUDGES: Mapping[str, Any] = {
    "rows": judge_rows,
    "jaw_gap": partial(judge_grippers, others=_at_contact, changes=False),
    "device": partial(judge_grippers, others=_devices, changes=True),
    "free_arm": judge_free_arm,
}


def judge(claim: Mapping[str, Any], results: Results) -> list[Judged]:
    """Judge a claim; what nothing can contradict is only told."""
    ((name, numbers),) = ((name, claim[name]) for name in JUDGES if name in claim)
    try:
        judged = JUDGES[name](results, claim["evidence"], **(numbers or {}))
    except LackingError as lacking:
        other = claim.get("elsewhere", "Another study")
        return [("", ELSEWHERE, f"{other} has what it takes: {lacking}.")]
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
    Column("near_share", "Share near the paper's value", 2),
    Column("near_from", "from", 2),
    Column("near_to", "to", 2),
    Column("verdict", "Verdict"),
)


def compared(results: Results) -> ShownTable:
    """Put the paper's Tables 5 to 7 beside what the runs of the study find."""
    rows: list[Row] = []
    values = results.tables.get("values", pd.DataFrame({"reading": []}))
    shown = [TEXT, *values.loc[values["reading"] != TEXT, "reading"].unique()[:1]]
    values = values[values["reading"].isin(shown)]
    for (reading, case, quantity), runs in (
        values.groupby(["reading", "case", "quantity"], sort=False) if len(values) else ()
    ):
        first, row = runs.iloc[0], {"case": case, "quantity": quantity, "reading": reading}
        row |= {name: first[name] for name in ("unit", "target", "printed_from", "printed_to")}
        row |= {f"error_{end}_percent": first[f"printed_error_{end}"] for end in ("from", "to")}
        row["runs"] = len(runs)
        medians = median_with_limits(runs["error"].to_numpy(float))
        row |= zip((f"median_{n}_percent" for n in ("error", "from", "to")), medians, strict=True)
        near = share_with_limits(int(runs["near"].sum()), len(runs))
        row |= zip(("near_share", "near_from", "near_to"), near, strict=True)
        verdict = by_interval(*near[1:]) if first["encodable"] else f"{reading} cannot write it"
        rows.append(row | {"verdict": verdict if first["determined"] else UNIDENTIFIABLE})
    caption = (
        "The paper's Tables 5 to 7 beside the runs of this study, with the two digits that the "
        "text describes and with the encoding that judges the claims. The "
        "paper's value from and to: what is printed so with the printed error. Errors of a run are "
        "absolute; their median has its 95 % interval. Near: within "
        f"{NEAR:.0%} of the paper's value. The 95 % limits of that share decide: from {MOST:.0%} "
        f"on replicated, up to {FEW:.0%} not, between in part, across one undecided; limits "
        "are of seeds alone. Not identifiable: no trace determines the quantity."
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

    Runs under readings of the paper are in files named like these, in folders of their case.
    """
    tables = {file.stem: RowFile("a table", words=None).read(file) for file in files}
    add_columns(tables)
    verdicts = [table for name, table in tables.items() if name.startswith("verdicts_")]
    tables["verdicts"] = pd.concat(verdicts, ignore_index=True)
    runs: dict[str, list[pd.DataFrame]] = {}
    for case, found, best in zip(study.cases.values(), identifications, histories, strict=True):
        if study.shown_method.name == "genetic":
            for at, runs_of_text in read_runs(case, found, best).items():
                others = [file for file in read if file.parent.name == case.name and not at]
                both = [runs_of_text.assign(judging=not others)]
                both += [read_reading(study, tables.get("readings"), file) for file in others]
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


def read_reading(study: Study, compared: pd.DataFrame | None, file: Path) -> pd.DataFrame:
    """Return the runs of a case under a reading; they judge unless its likelihood excludes it."""
    title = study.config.readings[file.stem].title
    found = read_readings(file, study.cases[file.parent.name])
    excluded = (
        compared is not None
        and title in compared.loc[compared["verdict"] == EXCLUDED, "reading"].to_numpy()
    )
    near = near_noise(found, study)
    return found.assign(near_noise=near, judging=not excluded, reading=title)


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
    if "robustness_noise" in tables:
        sweep = tables["robustness_noise"]
        noisy = sweep[sweep["row"] > 0]
        tables["by_noise"] = pd.DataFrame(
            {"case": case, "quantity": quantity, **_by_noise(rows)}
            for (case, quantity), rows in noisy.groupby(["case", "quantity"], sort=False)
        )
    if "models" in tables:
        models = tables["models"]
        models["made"] = models["model"].str.endswith("(made the traces)")
        made = models[models["made"]].set_index("case")["parameters"]
        simpler = models[models["parameters"] < models["case"].map(made)].groupby("case")
        models["simpler"] = models["case"].map(simpler.size())
        refuted = simpler["median_delta_bic"].agg(lambda rise: (rise > REFUTED).sum())
        models["refuted"] = models["case"].map(refuted)


def _by_noise(rows: pd.DataFrame) -> Row:
    """Return errors at the least, the paper's and the most noise, their power, and the worst ratio.

    The ratio is to the median absolute error that noise allows, 0.6745 bounds.
    """
    at = rows.groupby("row")["error_genetic"].median()
    power = np.polyfit(np.log(at.index), np.log(at), 1)[0]
    over = (rows["error_genetic"] / (0.6745 * rows["bound_percent"])).groupby(rows["row"]).median()
    sizes = {"first": at.iloc[0], "last": at.iloc[-1], "paper": at.get(100 * PAPERS_NOISE, np.nan)}
    ends = {"first_noise": at.index[0], "last_noise": at.index[-1], "over_bound": over.max()}
    return {"power": round(power, 2) + 0.0} | sizes | ends


def read_runs(case: Case, identifications: Path, histories: Path) -> dict[str, pd.DataFrame]:
    """Return the genetic algorithm's runs on a case, a row a seed; at the end and generation 20.

    Parameters stand by name in the place of their columns.
    """
    names = {p.column: p.name for p in case.sample.model.parameters}
    found = read_identifications(identifications, case, "genetic").rename(columns=names)
    best = read_histories(histories, "genetic", ["best_misfit", *names]).rename(columns=names)
    change = best.groupby("seed")["best_misfit"].diff()
    falls = best["generation"].where(change < 0, 0).groupby(best["seed"]).max()
    found["near_noise"] = near_noise(found, case.study)
    found = found.assign(last_improvement=found["seed"].map(falls))
    # Of a run that has stopped before, the last generation.
    at_20 = best[best["generation"] <= 20].groupby("seed", as_index=False).last()
    return {"": found.assign(reading=TEXT), " at 20": at_20.assign(reading=TEXT)}


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
        written = len(names) > 1 or bool(held.get(names[0], False))
        columns = {
            "value": values,
            "error": 100 * abs(values / truth - 1),
            "decades": abs(np.log10(values.clip(lower=1e-300) / truth)),
            "near": abs(values / paper - 1) <= NEAR,
            "encodable": (runs["reading"] != TEXT) | written,
        }
        head = {"quantity": label, "unit": quantity[0].unit, "target": truth}
        head |= {"printed_from": ends[0], "printed_to": ends[1], "printed_error_from": least}
        head |= {"printed_error_to": max(sizes), "sum": len(names) > 1}
        head |= {"determined": expected["expected_verdict"][label] == DETERMINED}
        head |= {"expected_high": expected["expected_high"][label]}
        kept = runs.filter(["case", "seed", "reading", "judging", "near_noise"])
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
