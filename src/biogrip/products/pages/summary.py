"""Summary page of one trace: confidence limits, notes and figures, self-contained."""

from dataclasses import dataclass
from pathlib import Path

import jinja2

from biogrip.errors import BiogripError
from biogrip.files import write_text
from biogrip.products.figures.judged_fit import JUDGED_FIT
from biogrip.products.figures.profiles import PROFILES
from biogrip.products.figures.valley import VALLEY
from biogrip.products.files.verdicts import PATH, read_verdicts
from biogrip.products.pages.png_address import png_address
from biogrip.products.plan import Plan, Wildcards
from biogrip.products.product import Product, Reads, the, wildcards_of
from biogrip.products.stages.judgement import TRACE
from biogrip.study.study import Study

_TEMPLATE = "summary.html.j2"


@dataclass(frozen=True)
class Settings:
    """Names and template of a case's summary page.

    Parameters
    ----------
    case, title, model
        Name of the case, its title, and title of its sample model.
    trace
        Description of the trace.
    template
        Jinja template of the page.
    """

    case: str
    title: str
    model: str
    trace: str
    template: str


def settings(study: Study, job: Wildcards) -> Settings:
    """Return names and template of a case's summary page."""
    case = study.case(job["case"])
    trace = case.file if case.recorded else f"seed {TRACE} of the simulated traces"
    template = Path(__file__).with_name(_TEMPLATE).read_text(encoding="utf-8")
    return Settings(case.name, case.title, case.sample.model.title, trace, template)


def write(settings: Settings, verdicts: Path, figures: list[Path], page: Path) -> None:
    """Write the summary of a case.

    Parameters
    ----------
    settings
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
    text = environment.from_string(settings.template).render(
        title=settings.title,
        model=settings.model,
        trace=settings.trace,
        found=read_verdicts(verdicts),
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


def _figures(plan: Plan, job: Wildcards) -> list[str]:
    valley = [VALLEY] if plan.study.case(job["case"]).has_valley else []
    return [figure.writes["png"].format(**job) for figure in (JUDGED_FIT, PROFILES, *valley)]


SUMMARY = Product(
    "summary",
    {"page": "results/summaries/{case}.html"},
    write,
    settings,
    lambda plan: wildcards_of(plan.study.cases),
    message="Writing the summary page of {case}",
    reads={"verdicts": the(PATH), "figures": Reads(_figures)},
    rule="case_figures",
    category="Summaries",
    item="summary",
    caption="Verdicts, notes and figures for one trace of this case.",
)
