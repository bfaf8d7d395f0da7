"""The pages of a study, each a self-contained HTML file.

The report has the answers, tables, figures, verdicts and an explorer; a summary what one trace of a
case tells.
"""

import base64
import platform
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from html import escape
from importlib.metadata import version
from io import BytesIO
from pathlib import Path
from typing import Any

import jinja2
import PIL.Image

from biogrip.errors import BiogripError
from biogrip.files import write_text
from biogrip.page import answers
from biogrip.page.explorer import explorer, fits_of
from biogrip.records.identifications import read_verdicts
from biogrip.records.rows import read_table
from biogrip.stages.judgement import TRACE
from biogrip.study.study import Case, Study
from biogrip.tables.cases import target_of

# Characters left for images in a report of at most 8 MB.
_MOST_PICTURE_LETTERS = 2_800_000
_LIBRARIES = ("biogrip", "numpy", "scipy", "pandas", "matplotlib", "snakemake", "plotly")
# Figures that are shown at once, on top and under their heading; the others are folded.
_STORY = ("moduli",)
_SHOWN = ("overview", "linkage", "torque")
# Tables under the results, and under what is reconstructed; the others are under their heading.
_FIRST = ("errors", "claims", "methods", "coverage", "models")
_EVIDENCE = ("gripper", "gene_ranges", "evidence", "printed_values")

_TEMPLATES = jinja2.Environment(
    loader=jinja2.FileSystemLoader(Path(__file__).parent),
    autoescape=True,
    trim_blocks=True,
    lstrip_blocks=True,
    undefined=jinja2.StrictUndefined,
)


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
    content: str | None = None
    """Table element, or data URL of an image; None if there is no room for it."""
    download: str = ""
    """Data URL of a table's CSV."""


def write_report(study: Study, config: str, files: Mapping[str, list[Path]], page: Path) -> None:
    """Write the report of a study.

    Parameters
    ----------
    study, config
        The study, and the whole config as YAML.
    files
        By what they have: `figures`, PNG; `tables`, HTML, and in their order their `downloads`,
        CSV; `captions`, text, named like what they are of; of all cases in their order
        `identifications`, `verdicts` and `measurements` with the judged trace; `calibrated`
        grippers of the cases that have them, which the file names tell.
    page
        HTML.

    Raises
    ------
    BiogripError
        If an input cannot be read.
    """
    texts = {
        (path.parent.name, path.stem): " ".join(path.read_text(encoding="utf-8").split())
        for path in files["captions"]
    }
    owners = [*study.cases, *study.sweeps]
    cases, methods = list(study.cases.values()), list(study.identifiers.values())
    traces = []
    of_cases = zip(cases, files["identifications"], files["measurements"], strict=True)
    for case, found, measured in of_cases:
        calibrated = [path for path in files["calibrated"] if path.stem == case.name]
        traces.append((case.title, fits_of(case, methods, found, measured, calibrated)))
    errors, judged, compared = (
        [row for csv in files["downloads"] if csv.name.startswith(name) for row in read_table(csv)]
        for name in ("errors.csv", "verdicts_", "methods.csv")
    )
    paper = {case.name: _in_paper(case) for case in cases}
    tables = []
    for path, csv in zip(files["tables"], files["downloads"], strict=True):
        entry, download = entry_of(path, owners, texts), _url("text/csv", csv.read_bytes())
        tables.append(replace(entry, content=_table(path, entry.caption), download=download))
    figures = [
        replace(entry_of(path, owners, texts), content=image)
        for path, image in zip(files["figures"], _images(files["figures"]), strict=True)
    ]
    write_text(
        page,
        _TEMPLATES.get_template("report.html.j2").render(
            style=Path(__file__).with_name("report.css").read_text(encoding="utf-8"),
            explorer=explorer(traces),
            answers=[
                answers.compare_with_paper(errors, judged, paper),
                answers.say_what_traces_tell(judged),
                answers.say_which_method_finds_it(compared, study.shown_method.title),
            ],
            compared=answers.compared_rows(errors, judged),
            cases=[_card(case, path) for case, path in zip(cases, files["verdicts"], strict=True)],
            story=_named(figures, _STORY),
            figures=_named(figures, _SHOWN),
            folded=_by_sample(figures, {case.name: case.title for case in cases}),
            first_tables=_named(tables, _FIRST),
            evidence_tables=_named(tables, _EVIDENCE),
            other_tables=[it for it in tables if it.name not in _FIRST + _EVIDENCE],
            config=config,
            grips=study.has_gripper,
            versions={"Python": platform.python_version()}
            | {name: version(name) for name in _LIBRARIES},
        ),
    )


def write_summary(case: Case, verdicts: Path, figures: list[Path], page: Path) -> None:
    """Write what the judged trace of a case tells, with figures, PNG.

    Raises
    ------
    BiogripError
        If an input cannot be read.
    """
    text = _TEMPLATES.get_template("summary.html.j2").render(
        title=case.title,
        model=case.sample.model.title,
        trace=case.file or f"seed {TRACE} of the simulated traces",
        found=read_verdicts(verdicts),
        unit=case.instrument.read.unit,
        has_jaws=case.instrument.has_jaws,
        figures=[(path.stem, _url("image/png", path.read_bytes())) for path in figures],
    )
    write_text(page, text)


def entry_of(file: Path, owners: Sequence[str], texts: Mapping[tuple[str, str], str]) -> Entry:
    """Return the entry of a file that is named after what it shows, and its case or sweep.

    Captions are by the name of the file's folder and what it shows.
    """
    kind, stem = file.parent.name, file.stem
    # One name may end with another, and that of a figure with that of a case.
    ends = sorted((name for name in owners if stem.endswith(f"_{name}")), key=len)
    whose = "" if (kind, stem) in texts or not ends else ends[-1]
    name = stem.removesuffix(f"_{whose}")
    return Entry(name, whose, texts[kind, name], str(file))


def _images(paths: Sequence[Path]) -> Iterator[str | None]:
    """Yield images of at most 256 colours, a third as large; None when there is no more room.

    Raises
    ------
    BiogripError
        If one cannot be read.
    """
    room = _MOST_PICTURE_LETTERS
    for path in paths:
        packed = BytesIO()
        try:
            with PIL.Image.open(path) as image:
                few = image.convert("RGB").quantize(256, dither=PIL.Image.Dither.NONE)
        except OSError as error:
            raise BiogripError(f"{path}: cannot be read: {error.strerror or error}.") from error
        few.save(packed, "png")
        url = _url("image/png", packed.getvalue())
        room -= len(url)
        yield url if room >= 0 else None


def _url(kind: str, content: bytes) -> str:
    """Return a file as a data URL (RFC 2397)."""
    return f"data:{kind};base64,{base64.b64encode(content).decode()}"


def _table(path: Path, caption: str) -> str:
    """Return the table element of an HTML file written by `biogrip.tables.layout`."""
    found = re.search(r"<table.*</table>", path.read_text(encoding="utf-8"), re.DOTALL)
    if found is None:
        raise BiogripError(f"{path}: holds no table.")
    columns = found[0].replace("<th>", '<th scope="col">')
    return re.sub("(<table[^>]*>)", rf"\1<caption>{escape(caption)}</caption>", columns)


def _in_paper(case: Case) -> str:
    """Return the paper's table of a case, or the title of a case that it does not have."""
    number = case.truth.published.table
    return case.title if number is None else f"Table {number}"


def _card(case: Case, path: Path) -> dict[str, Any]:
    """Return the verdicts on a case with the true values beside them."""
    found = read_verdicts(path)
    for item in found["quantities"]:
        item["target"] = target_of(item["quantity"], case.parameters)
    unit = case.instrument.read.unit
    return found | {"title": case.title, "recorded": case.recorded, "unit": unit}


def _named(entries: Sequence[Entry], names: Sequence[str]) -> list[Entry]:
    return [entry for name in names for entry in entries if entry.name == name]


def _by_sample(figures: Sequence[Entry], titles: Mapping[str, str]) -> dict[str, list[Entry]]:
    """Return the figures that are not shown at once, by title of their sample."""
    found: dict[str, list[Entry]] = {}
    for entry in figures:
        if entry.name not in _STORY + _SHOWN:
            title = titles.get(entry.whose, entry.whose or "The study")
            found.setdefault(title, []).append(entry)
    return found
