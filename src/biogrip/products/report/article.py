"""The study as an article: a PDF whose every number, table and figure comes from results."""

import json
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from hashlib import sha256
from io import StringIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pandas as pd
import yaml

from biogrip.errors import BiogripError
from biogrip.files import atomic_write
from biogrip.products.files.rows import read_rows
from biogrip.products.plan import Plan, Wildcards
from biogrip.products.product import Product, Reads, Weight
from biogrip.products.report.answers import say_what_traces_tell
from biogrip.products.report.entries import Entry, entries, files_of, files_shown, rules_of
from biogrip.products.report.marks import NoSuchRowError, number
from biogrip.products.tables.claim_rules import FEW, MOST
from biogrip.study.defaults import shipped
from biogrip.study.plain import plain
from biogrip.study.study import Study

_BODY = "article.typ"
_SOURCES = (_BODY, "article_style.typ", "references.yaml")
_FIGURES, _TABLES = ("Figures", "pdf"), ("Tables", "csv")
_CASES = {"endothelial_cell", "liquid_drop_1", "liquid_drop_2"}
PUBLISHED = "results/published"
# By the folder that they are published in, which names the rule that makes them.
SWEEP_TABLES = (
    "coverage/tables/verdict_counts.csv",
    "interpretations/tables/interpretations.csv",
    "interpretations/tables/interpretations_jointly.csv",
    "robustness/tables/robustness_gripper.csv",
    "robustness/tables/robustness_noise.csv",
)
SWEEP_FIGURES = (
    "robustness/figures/robustness_noise.pdf",
)
BENCHMARKS = "benchmarks/results/benchmarks.json"
CITATION = "CITATION.cff"
_MARK = re.compile("«(.+?)»", re.DOTALL)
_DRAWN = re.compile(r'#drawn\(((?:\s*"\w+",)+)')
_ORDINALS = ("first", "second")
_EXPERIMENT = " of the paper's experiment"
_LACKING = "(not in this study)"


@dataclass(frozen=True)
class Content:
    """Content of the article, except the study's results."""

    sources: Mapping[str, str]
    """Texts of the template, the style and the references, by file name."""
    entries: tuple[Entry, ...]
    """The study's figures and tables."""
    sweeps: Mapping[str, str]
    """Published tables of sweeps, CSV, by their path."""
    pictures: Mapping[str, str]
    """SHA-256 of published figures of sweeps, by their path."""
    benchmarks: str
    """Published benchmarks, JSON."""
    citation: str
    """How to cite the software, CFF."""
    settings: Mapping[str, object]
    """Values of the config by dotted key."""
    phases: tuple[Mapping[str, object], ...]
    """The protocol's phases."""


def content(study: Study, _: Wildcards) -> Content:
    """Return the content of the article, except the study's results."""
    plan = Plan(study, Path("results"))
    rules = rules_of(plan)
    return Content(
        {name: Path(__file__).with_name(name).read_text(encoding="utf-8") for name in _SOURCES},
        tuple(entry for kinds in (_FIGURES, _TABLES) for entry in entries(plan, kinds, rules)),
        {name: published_file(name).read_text(encoding="utf-8") for name in SWEEP_TABLES},
        {name: sha256(published_file(name).read_bytes()).hexdigest() for name in SWEEP_FIGURES},
        shipped(BENCHMARKS).read_text(encoding="utf-8"),
        shipped(CITATION).read_text(encoding="utf-8"),
        dict(_flat(plain(study.config), "")),
        tuple(
            {
                "number": ordinal,
                "duration_s": phase.duration_s,
                "torque_nNm": 1e9 * phase.left.value_Nm,
            }
            for ordinal, phase in zip(_ORDINALS, study.phases, strict=False)
        ),
    )


def write(shown: Content, figures: list[Path], tables: list[Path], pdf: Path) -> None:
    """Write the article.

    Parameters
    ----------
    shown
        Content, except results.
    figures
        Figures that the template shows, PDF.
    tables
        All tables of the study, CSV.
    pdf
        The article.

    Raises
    ------
    BiogripError
        If an input cannot be read, or the template cannot be set.
    """
    frames = read_frames(shown, tables)
    sources = dict(shown.sources)
    sources[_BODY] = fill(sources[_BODY], frames)
    sources["data.json"] = json.dumps(collect_data(shown, frames))
    pictures = [*figures, *map(published_file, shown.pictures)]
    written, _ = compile_article(sources, pictures)
    with atomic_write(pdf) as scratch:
        scratch.write_bytes(written)


def compile_article(
    sources: Mapping[str, str], pictures: Iterable[Path]
) -> tuple[bytes, list[str]]:
    """Set the article with Typst, from its sources by file name, and figures.

    Returns
    -------
    article
        PDF.
    warnings
        What Typst warns of.

    Raises
    ------
    BiogripError
        If a figure cannot be read, or Typst refuses the text.
    """
    import typst

    with TemporaryDirectory() as name:
        folder = Path(name)
        for file, text in sources.items():
            (folder / file).write_text(text, encoding="utf-8", newline="\n")
        for picture in pictures:
            try:
                (folder / picture.name).write_bytes(picture.read_bytes())
            except OSError as error:
                raise BiogripError(f"{picture}: cannot be read: {error.strerror}.") from error
        try:
            # Fonts are those within Typst, and no time is written: the same bytes everywhere.
            compiler = typst.Compiler(folder / _BODY, folder, ignore_system_fonts=True)
            found, warnings = compiler.compile_with_warnings(format="pdf", timestamp=0)
        except typst.TypstError as error:
            raise BiogripError(f"article: cannot be set: {error.message}.") from error
    assert isinstance(found, bytes)
    return found, [warning.diagnostic for warning in warnings]


def fill(text: str, frames: Mapping[str, pd.DataFrame]) -> str:
    """Return a text with every mark between « and » replaced by the number that it names.

    Raises
    ------
    BiogripError
        If a mark cannot be read, or names no column.
    """
    return _MARK.sub(lambda match: _number(" ".join(match[1].split()), frames), text)


def _number(what: str, frames: Mapping[str, pd.DataFrame]) -> str:
    if what == "answer":
        return say_what_traces_tell(frames["verdicts"].to_dict("records"), _EXPERIMENT)
    try:
        return number(what, lambda name: frames[name]).replace("-", "−").replace(" %", "~%")
    except NoSuchRowError:
        return "0" if ".count" in what else _LACKING
    except KeyError:
        return _LACKING
    except ValueError as error:
        raise BiogripError(f"article: {error}.") from error


def read_frames(shown: Content, tables: list[Path]) -> dict[str, pd.DataFrame]:
    """Read all tables as text, by name, the study's own in place of published ones."""
    benchmarks = json.loads(shown.benchmarks)
    found = {name: pd.DataFrame(rows) for name, rows in benchmarks.items() if type(rows) is list}
    found |= {
        Path(name).stem: pd.read_csv(StringIO(text), dtype=str, keep_default_na=False)
        for name, text in shown.sweeps.items()
    }
    found |= {path.stem: _own(path) for path in tables}
    found["setting"] = pd.DataFrame(
        {"key": list(shown.settings), "value": list(shown.settings.values())}
    )
    found["rule"] = pd.DataFrame([{"most": MOST, "few": FEW}])
    found["phase"] = pd.DataFrame(shown.phases)
    judged = [frame for name, frame in found.items() if name.startswith("verdicts_")]
    found["verdicts"] = pd.concat(judged, ignore_index=True)
    # As CSV has them: with all digits, and empty where there is nothing.
    return {
        name: frame.astype(object).where(frame.notna(), "").astype(str).replace("", None)
        for name, frame in found.items()
    }


def _own(path: Path) -> pd.DataFrame:
    header, *rows = read_rows(path)
    return pd.DataFrame(rows, columns=header)


def collect_data(shown: Content, frames: Mapping[str, pd.DataFrame]) -> dict[str, Any]:
    """Return what the style makes title, tables and captions from."""
    own = {Path(entry.file).stem: entry for entry in shown.entries}
    sweeps = {Path(name).stem: name for name in (*shown.sweeps, *shown.pictures)}
    made = {
        name: (f"publish_{path.partition('/')[0]}", f"{PUBLISHED}/{path}")
        for name, path in sweeps.items()
    }
    made |= {name: (entry.rule, entry.file) for name, entry in own.items()}
    made["verdicts"] = made[f"verdicts_{min(_CASES)}"][0], "results/tables/verdicts_*.csv"
    made["identification"] = "make bench", BENCHMARKS
    citation = yaml.safe_load(shown.citation)
    return {
        "tables": {
            name: frame.astype(object).where(frame.notna(), "").to_dict("records")
            for name, frame in frames.items()
            if name != "setting"
        },
        "made": {name: {"rule": rule, "file": file} for name, (rule, file) in made.items()},
        "says": {name: entry.caption for name, entry in own.items()},
        "authors": [_name(author) for author in citation["authors"]],
        "keywords": citation["keywords"],
        "version": citation["version"],
        "license": citation["license"],
    }


def _name(author: Mapping[str, str]) -> str:
    own = [author[part] for part in ("given-names", "family-names") if part in author]
    return " ".join(own) or author["name"]


def _flat(value: object, key: str) -> Iterator[tuple[str, object]]:
    """Yield the values of a config by dotted keys."""
    parts = dict(enumerate(value)) if isinstance(value, list) else value
    if not isinstance(parts, dict):
        yield key, value
        return
    for name, part in parts.items():
        yield from _flat(part, f"{key}.{name}" if key else str(name))


def published_file(name: str) -> Path:
    """Return a published file of a sweep."""
    return shipped(f"{PUBLISHED}/{name}")


def _drawn(plan: Plan, _: Wildcards) -> list[str]:
    body = Path(__file__).with_name(_BODY).read_text(encoding="utf-8")
    stems = {name for names in _DRAWN.findall(body) for name in re.findall(r"\w+", names)}
    return [file for _, _, file in files_of(plan, _FIGURES) if Path(file).stem in stems]


def _jobs(plan: Plan) -> list[Wildcards]:
    there = {*plan.study.published} & {*plan.study.gripped}
    return [{}] if there >= _CASES else []


ARTICLE = Product(
    "article",
    {"pdf": "results/article.pdf"},
    write,
    content,
    _jobs,
    message="Writing the article",
    reads={"figures": Reads(_drawn), "tables": files_shown(_TABLES)},
    weight=Weight(10, 2000),
    caption="The study as an article, with the paper's tables and figures beside ours. Made of "
    "studies that have all samples of the paper.",
)
