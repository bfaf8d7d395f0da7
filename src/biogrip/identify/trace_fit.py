"""Identification of one trace with all that its instrument does to it.

Usually noise is white and the gripper known, and there is nothing to it but an optimum.
Otherwise the best fit, what noise it leaves, and what the gripper's uncertainty does to
its response are found in turn, until none of them changes.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from biogrip.arrays import Array, BoolArray
from biogrip.digits import counted, rounded
from biogrip.errors import BiogripError
from biogrip.identify.answer import Identification
from biogrip.identify.case_problem import CaseProblem
from biogrip.identify.multi_start import fit_from
from biogrip.identify.noise_colour import ColourLikelihood
from biogrip.identify.outliers import outliers_of
from biogrip.identify.problem import Problem
from biogrip.identify.uncertain_gripper import gripper_functions
from biogrip.response.whitening import MOST_SAMPLES, Colour

_ROUNDS = 5
# Shares and times that change by less change no limit in its third digit.
_SETTLED = 1e-2
# So does a fit that moves by less, in standard deviations.
_STAYED = 0.03
_WORTH_SAYING = 0.005

Find = Callable[[Problem], Identification]
"""Finds the global optimum of a problem."""


@dataclass(frozen=True)
class TraceFit:
    """A trace that was identified.

    Parameters
    ----------
    problem
        The trace without outliers; its residuals are white.
    found
        Its global optimum.
    colour
        What the noise is, unless it was taken for white.
    outliers : (n_samples,)
        Which samples were left out.
    """

    problem: Problem
    found: Identification
    colour: Colour | None
    outliers: BoolArray

    def noise_data(self) -> dict[str, float | None] | None:
        """Return what the noise was found to be as plain data."""
        if self.colour is None:
            return None
        shares = {"white": self.colour.white, **vars(self.colour)}
        return {
            **{name: rounded(share) for name, share in shares.items()},
            "degrees_of_freedom": rounded(self.problem.residuals.freedom),
            "outliers": int(np.count_nonzero(self.outliers)),
        }

    def notes(self) -> list[str]:
        """Say in sentences what the noise was found to be."""
        if self.colour is None:
            return []
        colour, left_out = self.colour, int(np.count_nonzero(self.outliers))
        parts = [f"{_percent(colour.white)} white"]
        if colour.relaxing >= _WORTH_SAYING:
            parts.append(f"{_percent(colour.relaxing)} correlated over some {colour.time_s:.2g} s")
        if colour.flicker >= _WORTH_SAYING:
            parts.append(f"{_percent(colour.flicker)} 1/f")
        said = [
            f"Noise model: of the variance {', '.join(parts)}; an offset and a drift of the "
            "instrument are fitted along, and the intervals allow for all of it."
        ]
        if left_out:
            samples = counted(left_out, "sample")
            said.append(f"Left out as outliers: {samples} of {len(self.outliers)}.")
        return said


def trace_fit(posed: CaseProblem, time_s: Array, rotation_rad: Array, find: Find) -> TraceFit:
    """Identify a trace, and what its instrument did to it.

    In coloured noise, samples that stand out are left out; an offset and a drift are fitted
    along; the rest of the noise may be white, relaxing and 1/f in any shares. What the gripper
    is not known to is a part of the noise, too.

    Parameters
    ----------
    posed
        What the identification assumes.
    time_s, rotation_rad : (n_samples,)
        The trace, times ascending.
    find
        How to find an optimum.

    Raises
    ------
    BiogripError
        If the noise of so many samples cannot be coloured.
    """
    kept = np.ones(len(time_s), dtype=bool)
    if not posed.coloured:
        plain = posed.of(time_s, rotation_rad)
        found = find(plain)
        if posed.plain:
            return TraceFit(plain, found, None, ~kept)
    else:
        if len(time_s) > MOST_SAMPLES:
            raise BiogripError(
                f"found {len(time_s)} samples, allowed are at most {MOST_SAMPLES} with a coloured "
                "noise model: average neighbouring samples."
            )
        posed = replace(posed, offset=True, drift=True)
        kept, plain, found = _without_outliers(posed, time_s, rotation_rad, find)
    time_s, rotation_rad = time_s[kept], rotation_rad[kept]
    problem, found, colour = _in_turn(posed, time_s, rotation_rad, plain, found)
    # What is slow counts less now, so that another basin may be the deepest.
    other = find(problem)
    if np.float32(other.misfit_rad) < np.float32(found.misfit_rad):
        found = other
    return TraceFit(problem, found, colour, ~kept)


def _without_outliers(
    posed: CaseProblem, time_s: Array, rotation_rad: Array, find: Find
) -> tuple[BoolArray, Problem, Identification]:
    kept = np.ones(len(time_s), dtype=bool)
    for _ in range(_ROUNDS):
        plain = posed.of(time_s[kept], rotation_rad[kept])
        found = find(plain)
        struck = outliers_of(plain.residuals(np.log(found.parameters))[0])
        if not struck.any():
            break
        kept[np.flatnonzero(kept)[struck]] = False
    return kept, posed.of(time_s[kept], rotation_rad[kept]), found


def _in_turn(
    posed: CaseProblem, time_s: Array, rotation_rad: Array, plain: Problem, found: Identification
) -> tuple[Problem, Identification, Colour | None]:
    """Find the noise that a fit leaves, and fit with that noise, until the fit stays."""
    problem, colour = plain, None
    for _ in range(_ROUNDS):
        start = np.log(found.parameters)
        residual, sensitivity = plain.residuals(start)
        inertia = problem.residuals.inertia
        uncertain = gripper_functions(posed, time_s, found.parameters, inertia=inertia)
        left = problem.residuals.free - len(found.parameters)
        noise_rad = posed.noise_rad or found.misfit_rad * np.sqrt(len(time_s) / left)
        before: Colour | None = colour
        if posed.coloured:
            nuisance = posed.nuisance(time_s)
            directions = np.vstack((sensitivity, nuisance, uncertain))
            likelihood = ColourLikelihood(time_s, residual, directions)
            colour = likelihood.best(near=before)
        condensed = posed.in_noise(time_s, colour, uncertain / noise_rad, inertia=inertia)
        problem = posed.of(time_s, rotation_rad, condensed=condensed)
        found = found.at(fit := fit_from([problem], start))
        slopes = problem.residuals.condensed_responses(fit.x)[0, 1:]
        moved = np.linalg.norm((fit.x[0] - start) @ slopes) / noise_rad
        if moved < _STAYED and _alike(before, colour):
            break
    if colour is not None:
        freedom = likelihood.freedom(colour, sensitivity / noise_rad, nuisance)
        problem = replace(problem, residuals=problem.residuals.with_freedom(freedom))
    return problem, found, colour


def _alike(one: Colour | None, other: Colour | None) -> bool:
    if one is None or other is None:
        return one is other
    shares = abs(one.relaxing - other.relaxing) + abs(one.flicker - other.flicker)
    times = min(one.relaxing, other.relaxing) * abs(np.log(one.time_s / other.time_s))
    return bool(shares + times < _SETTLED)


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %"
