"""The pages of a study, self-contained HTML: the report, and what one trace of a case tells."""

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from html import escape
from importlib.metadata import version
from pathlib import Path
from typing import Any

import PIL.Image
import yaml

from biogrip import __version__
from biogrip.digits import legible, significant, with_unit
from biogrip.errors import BiogripError
from biogrip.figures.fit import scale_of
from biogrip.files import read_table, whole, write_text
from biogrip.judging.likelihood import PROVIDED, quantity_value
from biogrip.judging.what_moves import error_in_words
from biogrip.page.templates import data_url, environment
from biogrip.physics.noise import rms
from biogrip_study.config.study import Case, Study
from biogrip_study.page import answers
from biogrip_study.records.identifications import read_verdicts, share_with_limits
from biogrip_study.records.traces import read_measurements
from biogrip_study.stages.judgement import JUDGED_SEED

# Characters left for images in a report of at most 8 MB.
_MOST_PICTURE_LETTERS = 2_800_000
_LIBRARIES = ("numpy", "scipy", "pandas", "matplotlib", "snakemake")
# Tables that answers are written from.
_ANSWERING = "verdict_counts", "methods", "tables_5_to_7"
# Tables under what is reconstructed; the others are under their heading.
_EVIDENCE = ("gripper", "gene_ranges", "evidence", "printed_values")
# What only the paper's page shows of the gripper and the default search ranges.
_OF_THE_PAPER = (
    *("comb", "linkage", "torque", "gripper", "actuator", "left_out"),
    *("gene_ranges", "parameter_ranges"),
)
# What is unfolded of a case on a page of one's own.
_UNFOLDED = "judged_fit", "profiles"
_QUESTION = "How well can a MEMS microgripper identify the viscoelastic parameters of a cell?"
_MOST_TITLES = 3
# The paper's figure of its first fit, between those of its convergence and of its evolution.
_FIRST_FIT = {"convergence": -1, "fit": 0, "evolution": 1}
_FIGURE_OF_FIRST_FIT = 9
# Parameters that have a slider.
_SLID = "k", "k_p", "c", "c_p"
# As many readings as a curve of a few hundred pixels shows.
_READINGS_ON_SCREEN = 800
# More digits than a screen shows, and fewer than those in which processors differ.
_SCREEN_DIGITS = 6
# How far a slider goes below the least and above the largest parameter.
_SLIDER_BEYOND = 10.0

TEMPLATES = environment(Path(__file__).parent)
TEMPLATES.filters["error"] = error_in_words
TEMPLATES.globals |= {"target_of": quantity_value}
_NUMBER_IN_CELL = re.compile(r"(?:&[gl]t;|[≤≥−])*\d[\d.]*(·10[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)?(\u00a0%)?")


@dataclass(frozen=True)
class Entry:
    """A figure or a table on the page."""

    name: str
    """What it shows."""
    whose: str
    """Name of its case or sweep, if any."""
    title: str
    caption: str
    file: Path
    content: str | None
    """Table element, or data URL of an image; None if there is no room for it."""
    size: tuple[int, int] = (0, 0)
    """Width and height of an image, px."""
    download: str = ""
    """Data URL of a table's CSV."""


def write_report(
    study: Study,
    shown: Mapping[str, Sequence[tuple[str, str]]],
    captions: list[Path],
    figures: list[Path],
    tables: list[Path],
    downloads: list[Path],
    verdicts: list[Path],
    measurements: list[Path],
    page: Path,
    front: Path,
) -> None:
    """Write the report of a study as HTML, and its answers alone.

    Captions are text, named like what they are of; figures are PNG, tables HTML, downloads the same
    tables as CSV. What these show, and the case or sweep that they are of, is told in their order.
    Verdicts and measurements with the judged trace are those of all cases in their order.
    """
    texts = {
        (path.parent.name, path.stem): " ".join(path.read_text(encoding="utf-8").split())
        for path in captions
    }
    titles = {case.name: case.title for case in study.cases.values()}
    owners = titles | {name: sweep.title or name for name, sweep in study.config.sweeps.items()}
    judged = [*zip(study.cases.values(), map(read_verdicts, verdicts), strict=True)]

    def entry(kind: str, item: tuple[str, str], file: Path, **of_file: Any) -> Entry:
        name, whose = item
        title = name.replace("_", " ").capitalize() + (f": {owners[whose]}" if whose else "")
        return Entry(name, whose, title, legible(texts[kind, name]), file, **of_file)

    images = zip(shown["figures"], figures, _images(figures), strict=True)
    drawn = [
        entry("figures", item, picture, content=url, size=size)
        for item, picture, (url, size) in images
    ]
    files = zip(shown["tables"], tables, downloads, strict=True)
    listed = [
        entry(
            "tables",
            item,
            table,
            content=_table(table, titles),
            download=data_url("text/csv", whole(csv).encode()),
        )
        for item, table, csv in files
    ]
    several = f"{len(titles)} samples"
    context = {
        "sliders": _sliders(study, measurements),
        **_answered(study, downloads),
        "cases": judged,
        **_placed(study, drawn, listed, owners),
        # But for what changes no result.
        "config": yaml.safe_dump(
            {key: value for key, value in study.plain.items() if key != "pdf"}, allow_unicode=True
        ),
        "title": ", ".join(titles.values()) if len(titles) <= _MOST_TITLES else several,
        "paper": bool(study.published),
        "versions": {"biogrip": __version__, **{name: version(name) for name in _LIBRARIES}},
    }
    if study.published:
        context["title"] = _QUESTION
    for file, template in ((page, "report"), (front, "answers")):
        write_text(file, TEMPLATES.get_template(f"{template}.html.j2").render(context))


def _answered(study: Study, downloads: Sequence[Path]) -> dict[str, Any]:
    """Return the answers, and results beside the paper's."""
    counts, methods, beside = (
        [row for csv in downloads if csv.stem == name for row in read_table(csv)]
        for name in _ANSWERING
    )
    titles = {case.name: case.title for case in study.cases.values()}
    asked = methods, study.shown_method.title
    who = "Run again, the paper's" if study.published else "The"
    runs = max((int(row["seeds"]) for row in counts), default=0)
    return {
        "determined": answers.rows_of_determined(counts, titles),
        "runs": runs,
        "none_at_most": share_with_limits(0, runs)[2] if runs else 1.0,
        "provided": PROVIDED,
        "answers": [
            answers.say_what_the_study_gives(*asked, titles, who, study.optimum_tolerance),
            answers.say_which_method_finds_it(*asked),
        ],
        "compared": answers.rows_beside_the_paper(beside, titles),
    }


def _placed(
    study: Study, drawn: Sequence[Entry], listed: Sequence[Entry], owners: Mapping[str, str]
) -> dict[str, Any]:
    """Return figures by their place, the story and all others, folded, and tables."""
    if study.published:
        story = _as_in_paper(drawn, study)
    else:
        drawn, listed = (
            [entry for entry in entries if entry.name not in _OF_THE_PAPER]
            for entries in (drawn, listed)
        )
        story = [entry for entry in drawn if entry.name in _UNFOLDED]
    unfolded = {entry.file for entry in story}
    folded: dict[str, list[Entry]] = {}
    for entry in drawn:
        if entry.file not in unfolded:
            folded.setdefault(owners.get(entry.whose, "The study"), []).append(entry)
    once = _each_caption_once(listed)
    return {
        "story": story,
        "folded": folded,
        "evidence_tables": [entry for entry in once if entry.name in _EVIDENCE],
        "tables": [entry for entry in once if entry.name not in _EVIDENCE],
    }


def _each_caption_once(entries: Iterable[Entry]) -> list[Entry]:
    """Return entries of which only the first with a caption has it."""
    first = {entry.caption: entry for entry in reversed([*entries])}
    return [
        entry if entry is first[entry.caption] else replace(entry, caption="") for entry in entries
    ]


def _as_in_paper(figures: Sequence[Entry], study: Study) -> list[Entry]:
    """Return figures that the paper has, by their numbers there."""
    numbered = dict[int, Entry]()
    for entry in figures:
        number = study.cases[entry.whose].published.figure if entry.whose in study.cases else None
        beside = _FIRST_FIT.get(entry.name)
        if number and (beside == 0 or (beside and number == _FIGURE_OF_FIRST_FIT)):
            number += beside
            numbered[number] = replace(entry, title=f"Figure {number}. {entry.title}")
    return _each_caption_once([numbered[number] for number in sorted(numbered)])


def write_summary(
    case: Case, verdicts: Path, judged_fit: Path, profiles: Path, summary: Path
) -> None:
    """Write what the judged trace of a case tells, with two figures, PNG."""
    text = TEMPLATES.get_template("summary.html.j2").render(
        case=case,
        found=read_verdicts(verdicts),
        figures=[
            (path.stem, data_url("image/png", path.read_bytes())) for path in (judged_fit, profiles)
        ],
    )
    write_text(summary, text)


def _images(paths: Sequence[Path]) -> Iterator[tuple[str | None, tuple[int, int]]]:
    """Yield images, None when there is no more room, and their sizes."""
    room = _MOST_PICTURE_LETTERS
    for path in paths:
        try:
            with PIL.Image.open(path) as image:
                size = image.size
        # The latter, too, is Pillow's for what is no PNG.
        except (OSError, SyntaxError) as error:
            raise BiogripError(f"{path}: cannot be read: {error}.") from error
        url = data_url("image/png", path.read_bytes())
        room -= len(url)
        yield url if room >= 0 else None, size


def _table(path: Path, titles: Mapping[str, str]) -> str:
    """Return the table of an HTML file written by `biogrip_study.tables.layout`, cases titled."""

    def cell(match: re.Match[str]) -> str:
        text = escape(titles[match[1]]) if match[1] in titles else legible(match[1])
        return f"<td{' class=number' * bool(_NUMBER_IN_CELL.fullmatch(text))}>{text}</td>"

    table = re.search(r"<table.*</table>", path.read_text(encoding="utf-8"), re.DOTALL)
    if table is None:
        raise BiogripError(f"{path}: holds no table.")
    return re.sub("<td>(.*?)</td>", cell, table[0].replace("<th>", '<th scope="col">'))


def _sliders(study: Study, measurements: Sequence[Path]) -> dict[str, Any] | None:
    """Return what sliders of one of the paper's cases need; None if none can have them.

    That is its first trace, thinned, with parameters, arm and steps, in SI units.
    """
    measured = zip(study.cases.values(), measurements, strict=True)
    movable = [(case, file) for case, file in measured if study.published and _has_sliders(case)]
    if not movable:
        return None
    # Where the branch relaxes fastest, its damper and the parallel one are told apart least.
    case, file = min(movable, key=lambda pair: pair[0].parameters["c"] / pair[0].parameters["k"])
    recorded, gripper = read_measurements(file, [JUDGED_SEED]), case.experiment.gripper
    readings, target = recorded.readings[JUDGED_SEED], recorded.target
    assert target is not None
    factor, unit = scale_of(readings, case.instrument.read.unit)
    stride = -(-len(readings) // _READINGS_ON_SCREEN)
    values = case.parameters.values()
    return {
        "title": case.title,
        "noise": f"{factor * rms((readings - target)[::stride]):.4g}",
        "times": recorded.time_s[::stride].tolist(),
        "readings": significant(readings[::stride], _SCREEN_DIGITS).tolist(),
        "factor": factor,
        "unit": unit,
        "read": with_unit(case.instrument.read.title, unit),
        "sample": {name: case.parameters[name] for name in _SLID},
        "ends": [
            math.log10(min(values) / _SLIDER_BEYOND),
            math.log10(max(values) * _SLIDER_BEYOND),
        ],
        "arm": {
            "stiffness": gripper.left.stiffness_Nm_per_rad,
            "damping": gripper.left.damping_Nms_per_rad,
            "lever": 2 * gripper.lever_m**2,
        },
        "steps": [(start, height) for start, _, height in case.torque.jumps],
    }


def _has_sliders(case: Case) -> bool:
    """Tell whether a case has the response of the script: one branch, equal arms, only steps."""
    arms = case.experiment.gripper.left, case.experiment.gripper.right
    simulated = case.instrument.has_jaws and not case.recorded
    alone = {*case.parameters} == {*_SLID} and min(case.parameters.values()) > 0
    return simulated and alone and arms[0] == arms[1] and not case.torque.changes[:, 1:].any()
