"""What a trace tells on one page, with its figures inside."""

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
    """What the page says of the case.

    Parameters
    ----------
    case, title, model
        Its name, and in print its name and its sample model.
    trace
        Which trace.
    template
        The page's own source.
    """

    case: str
    title: str
    model: str
    trace: str
    template: str


def settings(study: Study, job: Wildcards) -> Settings:
    """Choose what the page of a case says."""
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
        Verdicts on its trace, JSON.
    figures
        Figures to show, PNG.
    page
        A page that needs nothing else, HTML.

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
    """Return a PNG as an address that holds it.

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
    message="Writing what a trace of {case} tells on one page",
    reads={"verdicts": the(PATH), "figures": Reads(_figures)},
    sheet="case_figures",
    category="Summaries",
    item="summary",
    caption="What one trace of this case tells, on one page.",
)
