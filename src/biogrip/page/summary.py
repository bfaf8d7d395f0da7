"""Summary page of one trace: confidence limits, notes and figures, self-contained."""

from pathlib import Path

import jinja2

from biogrip.errors import BiogripError
from biogrip.files import write_text
from biogrip.page.png_address import png_address
from biogrip.records.identifications import read_verdicts
from biogrip.stages.judgement import TRACE
from biogrip.study.study import Case

_TEMPLATE = "summary.html.j2"


def _template(_: Case) -> str:
    return Path(__file__).with_name(_TEMPLATE).read_text(encoding="utf-8")


def write(case: Case, verdicts: Path, figures: list[Path], page: Path) -> None:
    """Write the summary of a case.

    Parameters
    ----------
    case
        The case.
    verdicts
        Verdicts on the judged trace, JSON.
    figures
        Figures to show, PNG.
    page
        Self-contained page, HTML.

    Raises
    ------
    BiogripError
        If an input cannot be read.
    """
    environment = jinja2.Environment(autoescape=True, trim_blocks=True)
    text = environment.from_string(_template(case)).render(
        title=case.title,
        model=case.sample.model.title,
        trace=case.file or f"seed {TRACE} of the simulated traces",
        found=read_verdicts(verdicts),
        unit=case.instrument.read.unit,
        has_jaws=case.instrument.has_jaws,
        figures=[(path.stem, embedded(path)) for path in figures],
    )
    write_text(page, text)


def embedded(path: Path) -> str:
    """Return a PNG file as a data URL.

    Raises
    ------
    BiogripError
        If it cannot be read.
    """
    try:
        return png_address(path.read_bytes())
    except OSError as error:
        raise BiogripError(f"{path}: cannot be read: {error.strerror}.") from error
