"""What a trace tells on one page, with its figures inside."""

import base64
from pathlib import Path
from typing import Any

import jinja2

from biogrip.errors import BiogripError
from biogrip.files import write_text
from biogrip.identifiability.document import read_verdicts

_TEMPLATE = "summary.html.j2"


def run(settings: dict[str, Any], verdicts: Path, figures: list[Path], output: Path) -> None:
    """Write the summary of a case.

    Parameters
    ----------
    settings
        ``case``, ``title``, ``model`` (in print), ``trace`` (which one).
    verdicts
        Verdicts on its trace, JSON.
    figures
        Figures to show, PNG.
    output
        A page that needs nothing else, HTML.

    Raises
    ------
    BiogripError
        If an input cannot be read.
    """
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("biogrip", "."), autoescape=True, trim_blocks=True
    )
    page = environment.get_template(_TEMPLATE).render(
        **settings,
        found=read_verdicts(verdicts),
        figures=[(path.stem, _embedded(path)) for path in figures],
    )
    write_text(output, page)


def _embedded(path: Path) -> str:
    try:
        return "data:image/png;base64," + base64.b64encode(path.read_bytes()).decode()
    except OSError as error:
        raise BiogripError(f"{path}: cannot be read: {error.strerror}.") from error
