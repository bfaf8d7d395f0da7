"""Judge the claims of the paper in claims.yaml, which says how, by the tables of a study.

A claim names one of `JUDGES` with its numbers, or has parts that do. The rules of verdicts stand in
`workflow/report/tables/claims.rst`, the caption of the table.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from string import Formatter
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import yaml

from biogrip.judging.quantities import PROVIDED
from biogrip.judging.verdicts import DETERMINED
from biogrip.physics.calibration import ARM_KEYS, FreeMotion, calibrate, free_motion
from biogrip.physics.noise import Noise, add_noise, stream
from biogrip.physics.protocol import sample_times
from biogrip.records.identifications import read_histories, read_identifications
from biogrip.records.rows import read_frame
from biogrip.records.success import near_noise, share_with_limits
from biogrip.stages.job import job_study, logged, paths
from biogrip.study.study import Case, Study
from biogrip.tables.layout import Column, ShownTable, write

if TYPE_CHECKING:
    snakemake: Any

REPLICATED, IN_PART, NOT = "replicated", "in part", "not"
OUTSIDE, UNDECIDED = "outside the printed encoding", "cannot be told"
MOST, FEW = 0.9, 0.1
"""Shares from which, and up to which, something holds nearly always or hardly ever."""
CLOSE, NEAR = 0.05, 0.1
"""Relative differences up to which a rounded number, and an identified value, is the paper's."""
FEWEST_SEEDS = 20
"""Seeds that shares and ranges take: with fewer, none is outside of the middle 90 %."""
GENERATIONS = (20, 60)
"""Generations at which tables of values are made, besides that of the last."""

Judged = tuple[str, str]
"""A verdict, empty where something is only told, and the evidence."""


class LackingError(Exception):
    """The study does not have what a claim is judged by."""


@dataclass(frozen=True)
class Results:
    """What claims are judged by."""

    study: Study
    tables: Mapping[str, pd.DataFrame]
    """Tables by name; `of_table` has the number of the paper's table that rows belong to."""

    def table(self, name: str) -> pd.DataFrame:
        """Return a table; raise `LackingError` if there is none, or too few seeds in it."""
        if name not in self.tables:
            raise LackingError(f"the study has no table {name}")
        table = self.tables[name]
        if "seed" in table and (seeds := table.groupby("case")["seed"].nunique().min()) < (
            FEWEST_SEEDS
        ):
            raise LackingError(f"the study has {seeds} seeds, and it takes {FEWEST_SEEDS}")
        return table


def by_share(those: Any) -> str:
    """Judge something by the share of seeds or settings for which it holds."""
    share = np.mean(those)
    if share >= MOST:
        return REPLICATED
    return IN_PART if share > FEW else NOT


def altogether(verdicts: Iterable[str]) -> str:
    """Return the verdict on something that is said of several things."""
    found = set(verdicts)
    if found & {REPLICATED, IN_PART}:
        return found.pop() if len(found) == 1 else IN_PART
    return next((verdict for verdict in (NOT, OUTSIDE) if verdict in found), UNDECIDED)


def is_encodable(printed: float, nearest: float) -> bool:
    """Return whether the nearest value of the genes is the printed one, rounded to its digits."""
    exponent = int(Decimal(f"{printed:.15g}").as_tuple().exponent)
    return abs(nearest - printed) <= (0.5 + 1e-9) * 10.0**exponent


def of_seeds(those: Any) -> str:
    """Return a share of seeds, (n_seeds,), in words, with its 95 % limits."""
    share, low, high = (100 * end for end in share_with_limits(int(np.sum(those)), len(those)))
    return f"{share:.0f} % ({low:.0f} to {high:.0f})"


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
    holds: str = "",
    unless: Mapping[str, str] | None = None,
    each: str = "",
) -> list[Judged]:
    """Judge by the share of a table's rows for which a condition holds; without one, only tell.

    Rows are those of tables of the paper (`of`) and of a condition (`where`), judged apart `by` the
    values of a column. Verdicts that stand in `unless` take precedence where their condition holds.
    With `each`, the condition has to hold in all rows that have the same value of this column.
    Conditions are those of pandas' `eval`. Evidence may name, in braces, the `verdict`, the `share`
    with limits, the number of `rows`, of `hits` and of `misses`, the quantities of hits (`those`),
    the `study`, and statistics of columns, as in ``{median[misfit]:.2g}``.
    """
    rows = results.table(table)
    for number in of:
        if not (rows["of_table"] == number).any():
            raise LackingError(f"the study has no case of Table {number}")
    rows = rows[rows["of_table"].isin(of)] if of else rows
    rows = rows.query(where, local_dict={"study": results.study}) if where else rows
    if rows.empty:
        raise LackingError(f"the study has no such rows in its table {table}")
    judged = []
    for _, group in rows.groupby(by, sort=False) if by else [("", rows)]:
        numbers, verdict = group.select_dtypes("number"), ""
        values = group.to_dict("list")
        told: dict[str, Any] = {"study": results.study, "rows": len(group), "all": values}
        told |= {"first": {name: column[0] for name, column in values.items()}}
        told |= {"least": numbers.min(), "median": numbers.median(), "most": numbers.max()}
        told |= {f"p{percent}": numbers.quantile(percent / 100) for percent in (5, 25, 75, 95)}
        if holds:
            those = group.eval(holds)
            those = those.groupby(group[each]).all() if each else those
            verdict = by_share(those)
            others = (name for name, text in (unless or {}).items() if group.eval(text).all())
            verdict = next(others, verdict)
            hits = int(those.sum())
            told |= {"share": of_seeds(those), "hits": hits, "misses": len(those) - hits}
            told["percent"] = 100 * hits / len(those)
            if "quantity" in group and not each:
                told["those"] = ", ".join(group["quantity"][those]) or "none"
            of_sum = "sum" in group and group["sum"].all() and verdict != OUTSIDE
            told["verdict"] = f"{verdict}, {PROVIDED}" if of_sum else verdict
        judged.append((verdict, Evidence().format(evidence, **told)))
    return judged


def judge_jaw_gap(results: Results, evidence: str) -> list[Judged]:
    """Judge by how much the angle at contact changes what is found, beside what noise allows."""
    angles = np.radians(results.table("contact")["reference_angle_deg"].to_numpy(float))
    scale = np.sin(angles) ** 2
    change = 100 * float(scale.max() / scale.min() - 1)
    noise = float(results.table("coverage")["bound_percent"].min())
    said = evidence.format(change=change, noise=noise)
    return [(REPLICATED if change <= noise else IN_PART, said)]


def judge_free_arm(results: Results, evidence: str) -> list[Judged]:
    """Judge by a calibration from a free arm's simulated responses to a step and an impulse."""
    case = next(iter(results.study.cases.values()))
    test, arm = case.block.calibration, case.gripper.left
    time_s = sample_times(test.duration_s, test.rate_Hz)
    causes = test.step_torque_Nm, test.impulse_Nms
    motion = free_motion(arm, time_s, *causes)
    noise = Noise("gaussian", test.noise_level, "peak")
    rng = stream(results.study.study_seed, "claims", 0, "calibration")
    step, impulse = (add_noise(each, noise, rng) for each in (motion.step, motion.impulse))
    found = calibrate(FreeMotion(time_s, step, impulse), *causes).arm
    errors = [100 * abs(getattr(found, key) / getattr(arm, key) - 1) for key in ARM_KEYS]
    verdict = altogether(REPLICATED if error <= 100 * CLOSE else NOT for error in errors)
    return [(verdict, evidence.format(*errors, noise=100 * test.noise_level))]


def judge_equations(results: Results, evidence: str, of: int) -> list[Judged]:
    """Judge by whether the inner node runs away by eq. (6) as it is printed."""
    cases = [case for case in results.study.cases.values() if case.published.table == of]
    if not cases:
        raise LackingError(f"the study has no case of Table {of}")
    length_s = sum(phase.duration_s for phase in cases[0].phases)
    decades = cases[0].parameters["k"] / cases[0].parameters["c"] * length_s / np.log(10)
    said = evidence.format(decades=decades, length_s=length_s)
    return [(NOT if decades > 0 else REPLICATED, said)]


JUDGES: Mapping[str, Any] = {
    "rows": judge_rows,
    "jaw_gap": judge_jaw_gap,
    "free_arm": judge_free_arm,
    "equations": judge_equations,
}


def judge(claim: Mapping[str, Any], results: Results) -> Judged:
    """Judge a claim, or a part of one."""
    if "parts" in claim:
        judged = [judge(part, results) for part in claim["parts"]]
    else:
        ((name, numbers),) = ((name, claim[name]) for name in JUDGES if name in claim)
        try:
            judged = JUDGES[name](results, claim["evidence"], **(numbers or {}))
        except LackingError as lacking:
            if "elsewhere" not in claim:
                raise
            return UNDECIDED, f"Not here: {lacking}; {claim['elsewhere']} makes it."
    verdicts = [verdict for verdict, _ in judged if verdict and "tells_only" not in claim]
    said = claim.get("between", ", ").join(evidence for _, evidence in judged)
    around = claim.get("around", "{}").format(said, provided=PROVIDED)
    return altogether(verdicts) if verdicts else "", around


def judge_all(claims: Sequence[Mapping[str, Any]], results: Results, caption: str) -> ShownTable:
    """Judge every claim by the study's results."""
    rows = []
    for claim in claims:
        try:
            verdict, evidence = judge(claim, results)
        except LackingError as lacking:
            verdict, evidence = UNDECIDED, f"Not here: {lacking}."
        row = {"place": claim["place"], "claim": claim["words"], "verdict": verdict or UNDECIDED}
        rows.append(row | {"evidence": evidence})
    headings = ("Place", "Claim of the paper", "Verdict", "Evidence")
    names = ("place", "claim", "verdict", "evidence")
    return ShownTable(caption, tuple(map(Column, names, headings)), rows)


def read_results(
    study: Study, identifications: Sequence[Path], histories: Sequence[Path], files: Sequence[Path]
) -> Results:
    """Read the tables of a study, and the runs on the paper's cases, of files in their order."""
    tables = {file.stem: read_frame(file, "a table", ()) for file in files}
    add_columns(tables)
    verdicts = [table for name, table in tables.items() if name.startswith("verdicts_")]
    tables["verdicts"] = pd.concat(verdicts, ignore_index=True)
    runs: dict[str, list[pd.DataFrame]] = {}
    for case, found, best in zip(study.cases.values(), identifications, histories, strict=True):
        if study.shown == "genetic":
            of_case = read_runs(case, found, best)
            runs.setdefault("runs", []).append(of_case[""])
            for at, values in of_case.items():
                runs.setdefault(f"values{at}", []).append(values_of(case, values, tables))
    tables |= {name: pd.concat(each, ignore_index=True) for name, each in runs.items()}
    cases = study.cases.values()
    numbers = {name: case.published.table for case in cases for name in (case.name, case.title)}
    for table in tables.values():
        if "case" in table:
            table["of_table"] = table["case"].map(numbers).astype("Int64")
    return Results(study, tables)


def add_columns(tables: dict[str, pd.DataFrame]) -> None:
    """Add what claims need of several rows of a table, or cannot be said by pandas' `eval`."""
    if "evidence" in tables:
        told = tables["evidence"]
        printed = pd.to_numeric(told["paper"].str.removeprefix("about "), errors="coerce")
        close = abs(told["this_study"] / printed - 1) <= CLOSE
        told["as_printed"] = close.where(told["quantity"].str.contains("voltage for .* N m"))
    if "printed_values" in tables:
        values = tables["printed_values"]
        pairs = zip(values["printed"], values["nearest_encodable"], strict=True)
        values["encodable"] = [is_encodable(*pair) for pair in pairs]
        values["encodable"] &= values["within_range"] == "yes"
    if "gene_ranges" in tables:
        tables["gene_ranges"] = tables["gene_ranges"].sort_values("values")
    if "contact" in tables:
        tables["contact"]["closing_deg"] = np.degrees(1e-3 * tables["contact"]["closing_mrad"])
    if "methods" in tables:
        shares = tables["methods"].groupby("case")["reached_share"]
        tables["methods"]["reached_change"] = shares.transform("max") - shares.transform("min")
    if "robustness_gripper" in tables:
        sweep = tables["robustness_gripper"]
        bounds = sweep.groupby(["case", "quantity"])["bound_percent"]
        sweep["bound_change"] = bounds.transform("max") / bounds.transform("min")
    if "models" in tables:
        models = tables["models"]
        makers = models[models["model"].str.endswith("(made the traces)")].set_index("case")
        models["simpler"] = models["parameters"] < models["case"].map(makers["parameters"])
        models["for_maker"] = models["case"].map(makers["chosen_by_bic"])


def read_runs(case: Case, identifications: Path, histories: Path) -> dict[str, pd.DataFrame]:
    """Return the genetic algorithm's runs on a case, a row a seed; in the end, and at generations.

    Parameters stand by name in the place of their columns.
    """
    names = {p.column: p.name for p in case.sample.model.parameters}
    found = read_identifications(identifications, "genetic").rename(columns=names)
    best = read_histories(histories, "genetic", ["best_misfit", *names]).rename(columns=names)
    change = best.groupby("seed")["best_misfit"].diff()
    falls = best["generation"].where(change < 0, 0).groupby(best["seed"]).max()
    rises = (change > 0).groupby(best["seed"]).any()
    found["near_noise"] = near_noise(found, case.study.near_noise_tolerance)
    found = found.assign(last_improvement=found["seed"].map(falls), rises=found["seed"].map(rises))
    # Of a run that has stopped before, the last generation.
    return {"": found} | {
        f" at {at}": best[best["generation"] <= at].groupby("seed", as_index=False).last()
        for at in GENERATIONS
    }


def values_of(case: Case, runs: pd.DataFrame, tables: Mapping[str, pd.DataFrame]) -> pd.DataFrame:
    """Return a row for every quantity and run: its value beside the truth and the paper's value.

    Errors are absolute, in percent; `least_error` is that of the genes' value nearest to the truth.
    """
    printed = tables["printed_values"]
    printed = printed[printed["case"] == case.name].set_index(["quantity", "parameter"])
    nearest, expected = printed["nearest_encodable"], tables[f"verdicts_{case.name}"]
    expected = expected.set_index("quantity")
    truths, papers, rows = case.parameters, case.published.identified, []
    for quantity in case.sample.model.quantities:
        names = [parameter.name for parameter in quantity]
        label = " + ".join(names)
        truth, paper = (sum(of.get(name, np.nan) for name in names) for of in (truths, papers))
        least = sum(nearest.get(("target", name), np.nan) for name in names)
        values = runs[names].sum(axis=1)
        columns = {
            "value": values,
            "error": 100 * abs(values / truth - 1),
            "decades": abs(np.log10(values / truth)),
            "near": abs(values / paper - 1) <= NEAR,
            "printed": paper,
            "printed_error": 100 * abs(paper / truth - 1),
            "least_error": 100 * abs(least / truth - 1),
            "encodable": all(
                ("identified", name) in nearest
                and is_encodable(papers[name], nearest["identified", name])
                for name in names
            ),
            "determined": expected["expected_verdict"][label] == DETERMINED,
            "expected_high": expected["expected_high"][label],
            "noise_percent": 100 * case.noise.level,
        }
        head = {"case": case.name, "seed": runs["seed"], "quantity": label, "sum": len(names) > 1}
        rows.append(pd.DataFrame(head | columns))
    return pd.concat(rows)


if __name__ == "__main__":
    with logged(snakemake):
        study, given = job_study(snakemake), snakemake.input
        read = (paths(files) for files in (given.identifications, given.histories, given.tables))
        results = read_results(study.of(study.published), *read)
        claims = yaml.safe_load(Path(given.claims).read_text(encoding="utf-8"))
        caption = " ".join(Path(given.caption).read_text(encoding="utf-8").split())
        write(judge_all(claims, results, caption), Path(snakemake.output.table))
