"""The report of a study: one self-contained HTML file with tables, figures and an explorer."""

import base64
import platform
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from importlib.metadata import version
from io import BytesIO
from pathlib import Path
from typing import Any

import jinja2

from biogrip.errors import BiogripError
from biogrip.files import atomic_write
from biogrip.page.answers import (
    compare_with_paper,
    compared_rows,
    say_what_traces_tell,
    say_which_method_finds_it,
)
from biogrip.page.explorer import explorer, fits_of
from biogrip.page.png_address import png_address
from biogrip.records.identifications import read_verdicts
from biogrip.records.rows import read_table
from biogrip.study.study import Case, Study
from biogrip.tables.verdicts import target_of

# Characters left for images in a report of at most 8 MB.
_MOST_PICTURE_LETTERS = 2_800_000
_LIBRARIES = ("biogrip", "numpy", "scipy", "pandas", "matplotlib", "snakemake", "plotly")
_STORY = ("moduli",)
_SHOWN = ("overview", "linkage", "torque")
_FIRST = ("errors", "claims", "methods", "coverage", "models")
_EVIDENCE = ("gripper", "gene_ranges", "evidence", "printed_values")


@dataclass(frozen=True)
class Entry:
    """A figure or a table on the page."""

    name: str
    """What it shows."""
    whose: str
    """Name of its case or sweep, if any."""
    caption: str
    file: str
    """Path among the results."""


def write(
    study: Study,
    config: str,
    captions: list[Path],
    figures: list[Path],
    tables: list[Path],
    downloads: list[Path],
    identifications: list[Path],
    verdicts: list[Path],
    measurements: list[Path],
    calibrated: list[Path],
    page: Path,
) -> None:
    """Write the page.

    Parameters
    ----------
    study
        The study.
    config
        The whole config, YAML.
    captions
        Text of the caption of each kind of figure and table, named like it.
    figures, tables
        PNG and HTML files.
    downloads
        CSV files of the tables, in their order.
    identifications, verdicts, measurements
        Files of all cases, in their order; of the measurements those with the judged trace.
    calibrated
        Files of the cases that have them; the case is told by the file name.
    page
        HTML.

    Raises
    ------
    BiogripError
        If an input cannot be read.
    """
    texts = {
        (path.parent.name, path.stem): " ".join(path.read_text(encoding="utf-8").split())
        for path in captions
    }
    owners = [*study.cases, *study.sweeps]
    cases = list(study.cases.values())
    methods = list(study.identifiers.values())
    fits = [
        fits_of(case, methods, found, measured, [p for p in calibrated if p.stem == case.name])
        for case, found, measured in zip(cases, identifications, measurements, strict=True)
    ]
    shown_tables: list[dict[str, Any]] = [
        {"entry": entry, "html": _table(path, entry.caption), "download": _download(csv)}
        for path, csv in zip(tables, downloads, strict=True)
        for entry in [entry_of(path, owners, texts)]
    ]
    errors, judged, compared = (
        [row for path in downloads if path.name.startswith(name) for row in read_table(path)]
        for name in ("errors.csv", "verdicts_", "methods.csv")
    )
    shown_figures = [
        {"entry": entry_of(path, owners, texts), "image": image}
        for path, image in zip(figures, _images(figures), strict=True)
    ]
    environment = jinja2.Environment(
        autoescape=True, trim_blocks=True, lstrip_blocks=True, undefined=jinja2.StrictUndefined
    )
    parts = environment.from_string(_source("report.html.j2")).stream(
        style=_source("report.css"),
        explorer=explorer([(case.title, own) for case, own in zip(cases, fits, strict=True)]),
        answers=[
            compare_with_paper(errors, judged, {case.name: _whose(case) for case in cases}),
            say_what_traces_tell(judged),
            say_which_method_finds_it(compared, study.identifiers[study.shown].title),
        ],
        compared=compared_rows(errors, judged),
        cases=[_card(case, v) for case, v in zip(cases, verdicts, strict=True)],
        story=_named(shown_figures, _STORY),
        figures=_named(shown_figures, _SHOWN),
        folded=_by_sample(shown_figures, {case.name: case.title for case in cases}),
        first_tables=_named(shown_tables, _FIRST),
        evidence_tables=_named(shown_tables, _EVIDENCE),
        other_tables=[
            item for item in shown_tables if item["entry"].name not in (*_FIRST, *_EVIDENCE)
        ],
        config=config,
        grips=study.has_gripper,
        versions={"Python": platform.python_version()}
        | {name: version(name) for name in _LIBRARIES},
    )
    with atomic_write(page) as scratch, scratch.open("wb") as file:
        parts.dump(file, encoding="utf-8")


def _source(name: str) -> str:
    return Path(__file__).with_name(name).read_text(encoding="utf-8")


def entry_of(file: Path, owners: Sequence[str], texts: Mapping[tuple[str, str], str]) -> Entry:
    """Return the entry of a file that is named after what it shows, and its case or sweep.

    Captions are in folders named like those of the files.
    """
    kind, stem = file.parent.name, file.stem
    # One name may end with another, and that of a figure with that of a case.
    ends = sorted((name for name in owners if stem.endswith(f"_{name}")), key=len)
    whose = "" if (kind, stem) in texts or not ends else ends[-1]
    name = stem.removesuffix(f"_{whose}")
    return Entry(name, whose, texts[kind, name], str(file))


def _images(paths: Sequence[Path]) -> Iterable[str | None]:
    """Yield images as data URLs, None when there is no more room."""
    room = _MOST_PICTURE_LETTERS
    for path in paths:
        image = png_address(_in_few_colours(path))
        room -= len(image)
        yield image if room >= 0 else None


def _in_few_colours(path: Path) -> bytes:
    """Return an opaque PNG file with at most 256 colours, a third as large.

    Raises
    ------
    BiogripError
        If it cannot be read.
    """
    import PIL.Image

    packed = BytesIO()
    try:
        with PIL.Image.open(path) as image:
            few = image.convert("RGB").quantize(256, dither=PIL.Image.Dither.NONE)
    except OSError as error:
        raise BiogripError(f"{path}: cannot be read: {error.strerror or error}.") from error
    few.save(packed, "png")
    return packed.getvalue()


def _table(path: Path, caption: str) -> str:
    """Return the table element of an HTML file written by `biogrip.tables.layout`."""
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise BiogripError(f"{path}: cannot be read as a table: {error}.") from error
    found = re.search(r"<table.*</table>", text, re.DOTALL)
    if found is None:
        raise BiogripError(f"{path}: holds no table.")
    columns = found[0].replace("<th>", '<th scope="col">')
    return re.sub("(<table[^>]*>)", rf"\1<caption>{escape(caption)}</caption>", columns)


def _download(path: Path) -> str:
    """Return a file as a data URL."""
    return f"data:text/csv;base64,{base64.b64encode(path.read_bytes()).decode()}"


def _whose(case: Case) -> str:
    """Return the paper's table of a case, or the name of a case that it does not have."""
    number = case.truth.published.table
    return case.title if number is None else f"Table {number}"


def _card(case: Case, path: Path) -> dict[str, Any]:
    """Return the verdicts on a case with the true values beside them."""
    found = read_verdicts(path)
    for item in found["quantities"]:
        item["target"] = target_of(item["quantity"], case.parameters)
    unit = case.instrument.read.unit
    return {"title": case.title, "recorded": case.recorded, "unit": unit, **found}


def _named(items: list[dict[str, Any]], names: Sequence[str]) -> list[dict[str, Any]]:
    return [item for name in names for item in items if item["entry"].name == name]


def _by_sample(
    figures: Sequence[Mapping[str, Any]], titles: Mapping[str, str]
) -> dict[str, list[Mapping[str, Any]]]:
    """Return the figures that are not shown at once, by title of their sample."""
    found: dict[str, list[Mapping[str, Any]]] = {}
    for item in figures:
        if item["entry"].name not in (*_STORY, *_SHOWN):
            whose = item["entry"].whose
            found.setdefault(titles.get(whose, whose or "The study"), []).append(item)
    return found
