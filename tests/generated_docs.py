"""Parts of the documentation that are written from code and results; `make docs` renews them."""

import ast
import json
import re
import shlex
import shutil
import textwrap
from collections import Counter
from collections.abc import Callable, Iterable
from contextlib import redirect_stderr, redirect_stdout, suppress
from difflib import get_close_matches
from functools import cache
from io import StringIO
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from unittest import mock

import numpy as np
import pandas as pd
import yaml
from scipy.stats import chi2

from biogrip.arrays import Array
from biogrip.cli import main
from biogrip.command.words import in_sentences
from biogrip.design import NO_BOUND, relative_bounds
from biogrip.digits import plain as in_digits
from biogrip.digits import with_unit
from biogrip.files import read_table
from biogrip.fit.least_squares import identify_many
from biogrip.fit.problem import silent
from biogrip.physics.models import ALIASES, MODELS
from biogrip.physics.noise import add_noise, standard_deviation, stream
from biogrip.physics.response import linear_responses, simulated_response
from biogrip.physics.sample_model import sketched
from biogrip_study.config.study import Case
from biogrip_study.page import answers
from biogrip_study.records.identifications import share_in_words
from tests.helpers.default import STUDY, study_of
from tests.helpers.key_reference import file_schema, reference
from tests.helpers.places import EXAMPLE, ROOT
from tests.helpers.runs import ran
from tests.published_numbers import renewed_numbers
from workflow.paper.claims import Results, add_columns, judge_all

_CASES = {"endothelial_cell": "the cell", "liquid_drop_1": "drop 1", "liquid_drop_2": "drop 2"}
_JUDGED_IN_NOISE = [("drop", "c + c_p"), ("drop 2", "k"), ("drop 1", "k")]
_JUDGED_IN_NOISE += [("the cell", "k"), ("the cell", "k_p")]
# Of the independent fit of HL60's stretch, and of pyRheo's demonstrations.
_MEASURED = {
    "hl60": {"alpha": 0.701},
    "mucus": {"k_alpha": 0.5593, "alpha": 0.1056, "c_p": 0.3113},
    "fish_muscle": {"k_alpha": 869957.81, "alpha": 0.67438, "k_beta": 22074.487, "beta": 0.11006},
    "cellulose_hydrogel": {"k_p": 73.72, "k_alpha": 175.07, "alpha": 0.8148},
}


def _path(name: str, overlay: str = "") -> Path:
    """Of a table of the published study, or of one of its overlays."""
    return ROOT / "results" / "published" / overlay / "tables" / f"{name}.csv"


def sample_models() -> str:
    return _table(
        {"model": f"`{model.name}`", "is": model.title}
        | {"elements": f"`{sketched(model)}`"}
        | {"usual names": ", ".join(name for name, of in ALIASES.items() if of == model.name)}
        for model in MODELS.values()
    )


# N s/m
_SLOW = 1000
PIPETTE_TRUTH = {"k_s": 500.0, "k_v": 400.0, "c_v": 2000.0, "tau_v": 5.0}
"""Parameters that data/pipette.csv is simulated with."""


def paper_against_study() -> str:
    beside = read_table(_path("tables_5_to_7", "readings"))
    return _table(answers.rows_beside_the_paper(beside, _CASES))


def readings_compared() -> str:
    table = read_table(_path("readings", "readings"))

    def likelihood(row: dict[str, str], name: str) -> str:
        value, error = (float(row[f"{name}{end}"]) for end in ("", "_error"))
        return f"{round(value, 1) + 0.0:.1f} ± {error:.1f}"

    counts = Counter(row["verdict"] for row in table)
    said = ", ".join(f"{count} {verdict}" for verdict, count in counts.items())
    rows = _table(
        {
            "interpretation": row["reading"],
            "values held": f"{row['with_error']} of {row['values']}",
            "log₁₀ likelihood": likelihood(row, "likelihood"),
            "without Table 7": likelihood(row, "without_shared"),
            "speaks most against it": row["decides"]
            and f"{row['decides']} ({float(row['least']):.1f})",
            "runs that count": row["counted"],
            "last improvement, Tables 5, 6, 7": ", ".join(
                f"{float(row[f'last_improvement_{number}']):.0f}" for number in (5, 6, 7)
            ),
            "by its likelihood": row["verdict"],
        }
        for row in sorted(table, key=lambda row: -float(row["likelihood"]))
    )
    return f"**Of {len(table)} interpretations: {said}.**\n\n{rows}"


def joint() -> str:
    """Interpretations that change noise, rate, device and encoding, and nothing else, together."""
    config = yaml.safe_load((ROOT / "config" / "readings.yaml").read_text("utf-8"))["readings"]
    compared = {row["reading"]: row for row in read_table(_path("readings", "readings"))}
    found = pd.read_csv(_path("readings_found", "readings")).set_index(["reading", "case"])
    rows = []
    for block in config.values():
        changes, title = block["changes"], block["title"]
        measured = changes.get("measurement", {})
        noise = measured.get("noise", {"kind": "gaussian"})
        encoding = {"": "two from 1", "4": "four from 0"}.get(_digits_of(changes))
        kind = {
            "gaussian": "Gaussian, 10 % of the peak",
            "uniform": "uniform within 10 % of the signal",
        }
        told = noise == {"kind": "gaussian"} or (
            noise.get("reference") == "signal" and "level" in noise
        )
        others = {*changes} - {"search_range", "measurement", "gripper"} or block.keys() - {
            "title",
            "changes",
        }
        if encoding is None or others or not told or measured.get("rate_Hz", 10.0) > 10:
            continue
        cell, drop = (found.loc[title, case] for case in ("endothelial_cell", "liquid_drop_2"))
        rows.append(
            {"noise": kind[noise["kind"]], "rate (Hz)": f"{measured.get('rate_Hz', 10.0):g}"}
            | {"arms (mm)": f"{1e3 * changes.get('gripper', {}).get('arm_length_m', 1.5e-3):g}"}
            | {
                "digits": encoding,
                "log₁₀ likelihood": f"{float(compared[title]['likelihood']):.1f}",
            }
            | {"by its likelihood": compared[title]["verdict"]}
            | {"cell near the noise": _share(cell, "near_noise")}
            | {"error of k, cell": f"{cell['error_percent k']:.2g} %"}
            | {"of k, drop 2": f"{drop['error_percent k']:.2g} %"}
            | {"last improvement, Table 5": f"{cell['last_improvement']:.0f}"}
        )
    return _table(sorted(rows, key=lambda row: [*row.values()][:4]))


def _digits_of(changes: dict[str, Any]) -> str:
    """Of the encoding, "" if it is the text's; other than from 0, their number is not enough."""
    genes = changes.get("search_range", {}).get("k")
    from_0 = genes and genes.get("first_digit") == 0
    return "" if genes is None else str(genes.get("digits")) if from_0 else "other"


def choices() -> str:
    table = pd.read_csv(_path("readings_found", "readings"))
    errors = {
        "error of k, cell": ("k", "endothelial_cell"),
        "of k, drop 2": ("k", "liquid_drop_2"),
        "of c + c_p, drop 1": ("c + c_p", "liquid_drop_1"),
        "of c + c_p, drop 2": ("c + c_p", "liquid_drop_2"),
    }
    rows = []
    for reading, mine in table.groupby("reading", sort=False):
        own = mine.set_index("case")
        cell = own.loc["endothelial_cell"]
        row = {"interpretation": str(reading), "runs": str(cell["seeds"])}
        row |= {"cell near the noise": _share(cell, "near_noise")}
        for heading, (quantity, case) in errors.items():
            row[heading] = f"{own.loc[case, f'error_percent {quantity}']:.2g} %"
        rows.append(row)
    return _table(rows)


def protocols_compared() -> str:
    table = pd.read_csv(_path("protocols", "repaired"))
    return _table(
        {"sample and protocol": row["case"], "quantity": row["quantity"]}
        | {"lowest jaw force (µN)": f"{row['lowest_force_uN']:.2g}"}
        | {"noise (µrad)": f"{row['noise_urad']:.3g}", "(nrad/√Hz)": f"{row['density_nrad']:.3g}"}
        | {"bound, rest known": f"{row['bound_percent']:.2g} %"}
        | {"at the paper's density": f"{row['bound_same_density_percent']:.2g} %"}
        | {f"within 10 % of {row['seeds']}": _share(row, "enough")}
        for row in table.to_dict("records")
    )


def protocols_together() -> str:
    """What two protocols of one gripper tell of one drop together: information adds."""
    repaired = study_of((ROOT / "config" / "repaired.yaml").read_text(encoding="utf-8"))

    def told(case: Case) -> Array:
        experiment = case.experiment
        values = np.array([case.parameters[name] for name in experiment.searched.names])
        given = experiment.gripper, experiment.searched, experiment.torque, case.times_s
        read, *slopes = linear_responses(*given, values[None])[0]
        return np.array(slopes) / standard_deviation(read, case.noise)

    rows, chosen = [], {"the paper's": (0,), "the other": (1,), "both": (0, 1)}
    chosen |= {"the paper's, twice": (0, 0), "both, the other ten times": (0, *(1,) * 10)}
    for drop in ("liquid_drop_1", "liquid_drop_2"):
        case = STUDY.cases[drop]
        of = [told(case), told(repaired.cases[f"{drop}_alternated"])]
        for protocols, which in chosen.items():
            bounds = relative_bounds(np.hstack([of[index] for index in which]), 1.0)
            named = zip(case.experiment.searched.names, bounds.tolist(), strict=True)
            said = {name: f"{100 * it:.2g} %" if it < NO_BOUND else "none" for name, it in named}
            rows.append({"sample": case.title, "protocols": protocols, **said})
    return _table(rows)


def _claims() -> list[dict[str, str]]:
    """Return the claims in their order, each by the study of the most runs that can judge it."""
    tables = {"robustness_noise": pd.read_csv(_path("robustness_noise", "robustness"))}
    add_columns(tables)
    numbers = {case.name: case.published.table for case in STUDY.cases.values()}
    for table in tables.values():
        table["of_table"] = table["case"].map(numbers).astype("Int64")
    every = yaml.safe_load((ROOT / "workflow" / "paper" / "claims.yaml").read_text("utf-8"))
    told = [claim for claim in every if claim.get("rows", {}).get("table") == "by_noise"]
    rows = [dict(row) for row in judge_all(told, Results(STUDY, tables), "").rows]
    for name in ("readings", ""):
        rows += read_table(_path("claims", name))
    found: dict[str, dict[str, dict[str, str]]] = {claim["words"]: {} for claim in every}
    for row in rows:
        if row["verdict"] != "judged elsewhere":
            found[row["claim"]].setdefault(row["of"], row)
    return [row for rows_of_claim in found.values() for row in rows_of_claim.values()]


def claims_judged() -> str:
    names = ("claim", "place", "of", "verdict", "evidence")
    return _table({name: row[name].replace("|", r"\|") for name in names} for row in _claims())


def answer() -> str:
    methods = read_table(_path("methods"))
    own, titles = STUDY.shown_method.title, {case.name: case.title for case in STUDY.cases.values()}
    given = answers.say_what_the_study_gives(methods, own, titles, "Run again, the paper's", 1.0)
    return f"- {given}\n- {answers.say_which_method_finds_it(methods, own)}"


def measured() -> str:
    models = pd.read_csv(_path("models", "measured")).sort_values("median_delta_bic")
    rows = []
    for sample, published in _MEASURED.items():
        verdicts = read_table(_path(f"verdicts_{sample}", "measured"))
        found = {row["quantity"]: row for row in verdicts}
        best = models[models["case"] == sample]["model"].iloc[0]
        for quantity, value in published.items():
            own, first = found[quantity], quantity == next(iter(published))
            row = {"sample": sample.replace("_", " ") * first, "fit": own["fit"] * first}
            row |= {"quantity": with_unit(quantity, own["unit"]), "published": f"{value:.5g}"}
            rows.append(row | {"ours, 95 % limits": _limits_of(own), "lowest BIC": best * first})
    return _table(rows)


def _limits_of(row: dict[str, str]) -> str:
    if row["verdict"] == "determined":
        return f"{float(row['value']):.4g} ({float(row['low']):.4g} to {float(row['high']):.4g})"
    if row["verdict"] == "bounded above":
        return f"at most {float(row['high']):.3g}"
    return row["verdict"]


def errors_by_noise() -> str:
    table = pd.read_csv(_path("robustness_noise", "robustness"))
    rows = []
    for whose, quantity in _JUDGED_IN_NOISE:
        cases = [name for name, of in _CASES.items() if whose in of]
        ours = table[table["case"].isin(cases) & (table["quantity"] == quantity)]
        row = {"quantity": f"{quantity} of {'both drops' if whose == 'drop' else whose}"}
        for level in (2, 10, 40):
            of = ours[ours["row"] == level]
            error, bound = (of[it] for it in ("error_genetic", "bound_percent"))
            row[f"{level} % noise"] = f"{_range(error, '.2g', ' %')} ({_range(bound, '.2g', ' %')})"
        near = 100 * ours[ours["row"] == 2]["near_noise_genetic"]
        rows.append(row | {"runs near a noise of 2 %": _range(near, ".0f", " %")})
    return _table(rows)


def methods_compared() -> str:
    table = pd.read_csv(_path("methods"))
    rows = [
        {"method": method}
        | {
            f"{_CASES[row['case']]}: reached; Δχ²": f"{100 * row['reached_share']:.0f} % "
            f"({100 * row['reached_low']:.0f}–{100 * row['reached_high']:.0f}); "
            f"{in_digits(row['median_rise'], 2)}"
            for row in rows.to_dict("records")
        }
        | {"median responses": _range(rows["median_evaluations"], ".0f")}
        for method, rows in table.groupby("method", sort=False)
    ]
    least = table.groupby("case", sort=False)["encodable_rise"].first()
    shown = [in_digits(rise, 2) for rise in least]
    best = dict(zip(rows[0], ["*best encodable point*", *shown, ""], strict=True))
    return _table([*rows, best])


def slow_branch() -> str:
    """In how many traces of drop 1 a damper far above the truth fits as well as the best."""
    case = STUDY.case("liquid_drop_1")
    slow = study_of(f"cases: {{liquid_drop_1: {{fixed: {{c: {_SLOW}}}}}}}").case(case.name)
    time_s, seeds = case.times_s, range(case.seeds)
    (target,) = simulated_response(case.gripper, case.network, case.torque, time_s)
    rngs = [stream(STUDY.config.study_seed, case.name, seed, "noise") for seed in seeds]
    traces = [add_noise(target, case.noise, rng, time_s) for rng in rngs]
    posed = (each.experiment.to_identify().of_each(time_s, traces) for each in (case, slow))
    fits_of = [identify_many(each, case.block.least_squares, rngs, silent) for each in posed]
    free, held = (np.array([fit.misfit for fit in fits]) for fits in fits_of)
    limit = chi2.ppf(case.confidence, 1)
    fits = int(np.sum(len(time_s) * ((held / free) ** 2 - 1) < limit))
    return (
        f"With c fixed at {_SLOW:,} N s/m, a hundred times the truth, χ² of drop 1 rises by less "
        f"than {limit:.3g} in {share_in_words(fits, len(seeds))} of {len(seeds)} traces."
    )


def _share(row: Any, name: str) -> str:
    share, low, high = (100 * row[f"{name}_{end}"] for end in ("share", "from", "to"))
    return f"{share:.0f} % ({low:.0f} to {high:.0f} %)"


def _range(values: "pd.Series[float]", how: str, unit: str = "") -> str:
    ends = dict.fromkeys(format(end, how) for end in (values.min(), values.max()))
    return "none" if np.isinf(values.max()) else f"{'–'.join(ends)}{unit}"


@cache
def example(*options: str, trace: Path = EXAMPLE) -> tuple[str, dict[str, Any]]:
    """What `biogrip identify` prints of a trace, under options of the command, and its JSON."""
    unheard = redirect_stderr(StringIO())
    with TemporaryDirectory() as folder, redirect_stdout(StringIO()) as said, unheard:
        main(["identify", str(trace), "--output", f"{folder}/found.json", *options])
        return said.getvalue(), json.loads(Path(folder, "found.json").read_text(encoding="utf-8"))


def printed_example(*options: str) -> str:
    lines = example(*options)[0].replace(f"{ROOT}/", "").splitlines()[:-1]
    return "\n".join(textwrap.indent(textwrap.fill(line, 136), "    ") for line in lines)


def beginning_of_example() -> str:
    with EXAMPLE.open(encoding="utf-8") as lines:
        return f"```csv\n{''.join(islice(lines, 4))}```"


def typed_in_readme() -> list[tuple[str, dict[str, Any]]]:
    """What the commands of README print that identify one trace."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    typed = [
        shlex.split(line) for line in re.findall(r"^    biogrip identify (\S+csv .*)$", text, re.M)
    ]
    left_out = "--plot", "fit.png", "--report", "page.html"
    return [
        example(*(it for it in options if it not in left_out), trace=ROOT / file)
        for file, *options in typed
    ]


def identified_example() -> str:
    """What is printed of the first trace's quantities, beside the truth: it is simulated."""
    said, found = typed_in_readme()[0]
    lines = [line for line in _said(said) if line.startswith(("data", "  "))]
    told = "\n".join(f"    {line}" for line in lines[: 1 + len(found["quantities"])])
    made = ", ".join(f"{name} = {in_digits(value)}" for name, value in PIPETTE_TRUTH.items())
    missed = [
        q["quantity"]
        for q in found["quantities"]
        if not q["low"] <= PIPETTE_TRUTH[q["quantity"]] <= q["high"]
    ]
    every = f"Every interval but of {missed}" if missed else "Every interval"
    return f"{told}\n\nTrue are {made}. {every} holds its true value."


def doubted_example() -> str:
    """Status of the second trace, and the first sentence of why."""
    said, found = typed_in_readme()[1]
    first, *_ = _said(said)
    told = first, f"  {in_sentences(found['reasons'][0])[0]}"
    return "\n".join(textwrap.indent(textwrap.fill(line, 112), "    ") for line in told)


def _said(text: str) -> list[str]:
    return text.replace(f"{ROOT}/", "").splitlines()


def _quantities(*options: str) -> str:
    lines = [line.removeprefix("    ") for line in printed_example(*options).splitlines()]
    told = (line for line in lines if line.startswith(("  ", "Model-free")))
    return "\n".join(f"    {line.removeprefix('  ')}" for line in told)


def folders() -> str:
    told = {
        file.parent.relative_to(ROOT / "src"): str(
            ast.get_docstring(ast.parse(file.read_text("utf-8")))
        )
        for file in sorted((ROOT / "src").glob("*/*/__init__.py"))
    }
    return _table({"folder of `src/`": str(name), "has": has} for name, has in told.items())


def command_help() -> str:
    """What the command and each of its subcommands say of themselves, each paragraph once."""
    overview = _help()
    parts, said = [f"```text\n{overview}```"], set[str]()
    for name in re.findall(r"^    (\w+) ", overview, re.MULTILINE):
        new = [each for each in _help(name).rstrip().split("\n\n") if each not in said]
        said.update(new)
        parts.append(f"## biogrip {name}\n\n```text\n" + "\n\n".join(new) + "\n```")
    return "\n\n".join(parts)


def _help(*command: str) -> str:
    said = StringIO()
    # As wide on every terminal.
    with mock.patch.dict("os.environ", COLUMNS="100"), redirect_stdout(said), suppress(SystemExit):
        main([*command, "--help"])
    return said.getvalue()


def _table(rows: Iterable[dict[str, str]]) -> str:
    return str(pd.DataFrame(rows).to_markdown(index=False, disable_numparse=True))


_COUNTS = _path("verdict_counts", "coverage")
_SHORTER = "--no-compare", "--set", "gripper.arm_length_m=1.2e-3"
PARTS: dict[str, dict[str, Callable[[], str]]] = {
    "docs/reference/config.md": {"keys": reference},
    "README.md": {
        "answer": answer,
        "example": identified_example,
        "doubtful": doubted_example,
    },
    "CONTRIBUTING.md": {"folders": folders},
    "docs/tutorial.md": {
        "file": beginning_of_example,
        "printed": printed_example,
        "shorter": lambda: _quantities(*_SHORTER),
    },
    "docs/reference/command.md": {"help": command_help},
    "docs/models.md": {"models": sample_models},
    "docs/identifiability.md": {"slow": slow_branch, "methods": methods_compared},
    "docs/measured.md": {"measured": measured},
    "docs/robustness.md": {"errors": errors_by_noise},
    "docs/claims.md": {"claims": claims_judged},
    "docs/reproduction.md": {
        "results": paper_against_study,
        "readings": readings_compared,
        "choices": choices,
        "joint": joint,
        "told": lambda: _table(answers.rows_of_determined(read_table(_COUNTS), _CASES)),
        "protocols": protocols_compared,
        "together": protocols_together,
    },
}
"""Parts of documents that are written, by what."""

SCHEMA = ROOT / "config" / "schema.json"
DOCUMENTS = [
    *(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "config/README.md")),
    *sorted((ROOT / "docs").rglob("*.md")),
]
GENERATED = [SCHEMA, *DOCUMENTS]


def renewed(path: Path) -> str:
    """Return a document with its generated parts, and its numbers, as they should be."""
    if path == SCHEMA:
        return file_schema()
    text = path.read_text(encoding="utf-8")
    for name, content in PARTS.get(str(path.relative_to(ROOT)), {}).items():
        match = re.search(
            rf"<!-- {name}: begin[^\n]*-->\n(.*)<!-- {name}: end -->", text, re.DOTALL
        )
        if match is None:
            raise ValueError(f"{path}: has no part {name} to be written.")
        text = f"{text[: match.start(1)]}\n{content()}\n\n{text[match.end(1) :]}"
    return renewed_numbers(SHOWN.sub(_printed_again, text))


SHOWN = re.compile(r"^```sh\n(biogrip identify data/[^`]*)```[^`]*^```text\n(.*?)^```", re.S | re.M)
"""Commands, and lines of what they print."""


def _printed_again(shown: re.Match[str]) -> str:
    """Type commands, and put in the place of each line the one printed that is most like it."""
    with TemporaryDirectory() as folder:
        shutil.copytree(ROOT / "data", Path(folder, "data"))
        typed = [shlex.split(line, comments=True) for line in shown[1].splitlines()]
        said = "".join(ran(Path(folder), *each, PYTHONPATH=str(ROOT / "src")) for each in typed)
    lines = [get_close_matches(it, said.splitlines(), 1, 0.0)[0] for it in shown[2].splitlines()]
    return shown[0].replace(shown[2], "".join(f"{line}\n" for line in lines))


if __name__ == "__main__":
    for document in GENERATED:
        document.write_text(renewed(document), encoding="utf-8")
