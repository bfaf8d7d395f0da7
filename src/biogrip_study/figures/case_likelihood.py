"""Profile likelihoods of a case."""

from pathlib import Path

from matplotlib.figure import Figure

from biogrip.figures.likelihood import draw_profiles_of
from biogrip_study.config.study import Case
from biogrip_study.records.identifications import read_verdicts


def draw_profiles(case: Case, verdicts: Path, expected: list[Path]) -> Figure:
    """Draw the profile of every quantity of a case, with confidence limits."""
    others = [read_verdicts(path) for path in expected]
    return draw_profiles_of(read_verdicts(verdicts), others, case.title, case.parameters)
