"""One more of each thing that CONTRIBUTING says how to add, added as it says, to a copied tree."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from tests.helpers.runs import replaced


@dataclass(frozen=True)
class Recipe:
    """What is typed to add something, but for what `make docs` and `make pinned` write.

    Parameters
    ----------
    thing
        First cell of its row in CONTRIBUTING.
    new
        Files that are written, below ``src/biogrip``.
    edits
        Of files that are there, pieces of text and what takes their place.
    """

    thing: str
    new: Mapping[str, str] = field(default_factory=dict)
    edits: Mapping[str, Mapping[str, str]] = field(default_factory=dict)

    @property
    def files(self) -> list[str]:
        """All of them."""
        return [*self.new, *self.edits]

    @property
    def lines(self) -> int:
        """How many lines are more in files that were there."""
        pairs = [pair for pieces in self.edits.values() for pair in pieces.items()]
        return sum(new.count("\n") - old.count("\n") for old, new in pairs)

    def follow(self, tree: Path) -> None:
        """Type it."""
        package = tree / "src" / "biogrip"
        for name, text in self.new.items():
            (package / name).write_text(text)
        for name, pieces in self.edits.items():
            file = package / name
            for old, new in pieces.items():
                file.write_text(replaced(file.read_text(), old, new))


METHOD = Recipe(
    "a method",
    new={
        "identify/random_search.py": '''"""The best of points drawn in the search range."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from biogrip.identify.answer import History, Identification, Progress, Row, silent
from biogrip.identify.problem import Problem
from biogrip.keys import Block


@dataclass(frozen=True)
class RandomSearchSettings(Block):
    """Random search, in the logarithms of the parameters."""

    draws: Annotated[int, Field(ge=1, le=1_000_000)] = 1000
    """Points drawn in a round."""
    rounds: Annotated[int, Field(ge=1, le=1000)] = 5
    """Rounds."""


def identify_many(
    problems: Sequence[Problem],
    settings: RandomSearchSettings,
    rngs: Sequence[np.random.Generator],
    progress: Progress = silent,
) -> list[Identification]:
    """Identify samples one after the other, as `biogrip.identify.methods` says."""
    pairs = zip(problems, rngs, strict=True)
    return [_identified(problem, settings, rng, progress) for problem, rng in pairs]


def _identified(
    problem: Problem, settings: RandomSearchSettings, rng: np.random.Generator, progress: Progress
) -> Identification:
    rows: list[Row] = []
    for drawn in range(1, settings.rounds + 2):
        points = np.exp(rng.uniform(problem.low, problem.high, (settings.draws, len(problem.low))))
        misfits = problem.misfit(points)
        best = points[np.argmin(misfits)], float(misfits.min())
        if rows and rows[-1][1] < best[1]:
            best = rows[-1][:2]
        rows.append((*best, float(np.median(misfits)), drawn * settings.draws))
        progress(rows[-1][3], best[1])
    return Identification(
        *best, settings.rounds, rows[-1][3], "all points are drawn", History.of(rows)
    )
'''
    },
    edits={
        "identify/methods.py": {
            "    for method in (\n": """    for method in (
        Method(
            "random_search",
            "random search",
            {"random_search": "RandomSearchSettings"},
            "round",
            "sky",
            ":",
        ),
"""
        }
    },
)
MODEL = Recipe(
    "a sample model",
    new={
        "experiment/jeffreys.py": '''"""The Jeffreys fluid: a Maxwell liquid beside a damper."""

import numpy as np
from numpy.typing import ArrayLike

from biogrip.experiment.network import Network, columns_of
from biogrip.experiment.sample_model import C_P, C, K, SampleModel


def jeffreys(parameters: ArrayLike) -> Network:
    """Jeffreys fluid; columns k, c, c_p."""
    k, c, c_p = columns_of(parameters)
    return Network(k_p=np.zeros_like(k), c_p=c_p, k=k[:, None], c=c[:, None])


JEFFREYS = SampleModel(
    "jeffreys",
    "Jeffreys fluid",
    (K, C, C_P),
    jeffreys,
    example=(2.0, 50.0, 3.0),
    contains={"maxwell": lambda k, c: (k, c, 0.0)},
    within={"generalized_maxwell": lambda k, c, c_p: (k, 0.0, c, c_p)},
)
'''
    },
    edits={
        "experiment/models.py": {
            "from biogrip.experiment.maxwell_models import": "from biogrip.experiment.jeffreys "
            "import JEFFREYS\nfrom biogrip.experiment.maxwell_models import",
            "        BURGERS,\n": "        BURGERS,\n        JEFFREYS,\n",
        }
    },
)
FIGURE = Recipe(
    "a figure",
    new={
        "products/figures/heights.py": '''"""How high samples' responses rise."""

from pathlib import Path

from matplotlib.figure import Figure

from biogrip.products.figures.declared import drawing
from biogrip.products.figures.style import COLUMN_IN, figure
from biogrip.products.files.traces import TARGETS, read_target
from biogrip.products.product import of_cases
from biogrip.products.uses import simulated
from biogrip.study.study import Study


def draw(_: Study, targets: list[Path]) -> Figure:
    """Draw the largest rotation of every case."""
    drawn = figure(COLUMN_IN, 2)
    highest = [read_target(target)[2].max() for target in targets]
    drawn.subplots().bar([target.stem for target in targets], highest)
    return drawn


HEIGHTS = drawing(
    draw,
    name="heights",
    caption="How high every case rises, side by side.",
    reads={"targets": of_cases(TARGETS, simulated)},
    rule="study_figures",
)
'''
    },
)
TABLE = Recipe(
    "a table",
    new={
        "products/tables/noise_levels.py": '''"""How noisy the cases' traces are."""

from biogrip.products.tables.declared import table
from biogrip.products.tables.layout import Column, Table
from biogrip.products.uses import each, from_study, simulated
from biogrip.study.study import Study


def levels(study: Study) -> Table:
    """List kind and level of the cases' noise."""
    columns = (Column("case", "Case"), Column("kind", "Kind"), Column("level", "Level"))
    noises = {name: case.noise for name, case in study.cases.items()}
    return Table(
        "Noise of the cases.", columns, [(name, n.kind, n.level) for name, n in noises.items()]
    )


NOISE_LEVELS = table(
    levels,
    name="noise_levels",
    item="noise",
    caption="Kind and level of the noise of every case.",
    uses=from_study(cases=each(simulated, "noise")),
    rule="tables",
)
'''
    },
)
KEY = Recipe(
    "a config key",
    edits={
        "experiment/noise.py": {
            "    def problems(self)": """\
    resolution_rad: Annotated[float | None, Field(ge=1e-12, le=1)] = None
    \"\"\"Smallest step that is recorded. By default any.\"\"\"

    def problems(self)""",
            "    return noisy\n": """    if noise.resolution_rad is not None:
        noisy = noise.resolution_rad * np.round(noisy / noise.resolution_rad)
    return noisy
""",
        }
    },
)
NOISE = Recipe(
    "a kind of noise",
    edits={
        "experiment/noise.py": {
            '    "uniform": ': '    "laplace": lambda rng, count: rng.laplace(0, np.sqrt(0.5), '
            'count),\n    "uniform": '
        }
    },
)
RECIPES = (METHOD, MODEL, FIGURE, TABLE, KEY, NOISE)

CONFIG = """
seeds: 2
measurement: {rate_Hz: 0.5, noise: {kind: laplace, resolution_rad: 1e-6}}
methods: [random_search, least_squares]
random_search: {draws: 30}
least_squares: {candidates: 50, starts: 3}
identifiability: {coverage_seeds: 2}
model_selection: {models: [maxwell, jeffreys]}
only: [my_cell]
cases:
  my_cell:
    sample: {model: jeffreys, k: 2.0, c: 50.0, c_p: 3.0}
"""
"""A study of all of them, and little else."""
