"""Fits of nested sample models to the same traces, and the choice of the simplest adequate one.

Each model is fitted from starts of its own and from the optima of the models nested in it, and then
with other relaxation times (`deepen`), so that none fits worse than a model nested in it. If one of
these still fits better, because its optimum lies outside the richer model's search range, its
optimum is the richer model's result, with elements that have vanished (`biogrip.physics.models`).

Models are compared by the information criteria AIC [1]_ and BIC [2]_; differences in BIC below
`WORTH_A_MENTION` prefer none, and below `STRONG` none that is not simpler [3]_.

References
----------
.. [1] H. Akaike, IEEE Transactions on Automatic Control 19 (1974), 716-723.
.. [2] G. Schwarz, Annals of Statistics 6 (1978), 461-464.
.. [3] R. E. Kass and A. E. Raftery, Journal of the American Statistical Association 90 (1995), 773.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

import biogrip.levels as levels
from biogrip.arrays import Array, BoolArray, parts
from biogrip.digits import counted, plain
from biogrip.fit.least_squares import LeastSquaresSettings, fit_from, identify_many, refit
from biogrip.fit.problem import Fit, TraceProblem, silent
from biogrip.physics.models import CANDIDATES, as_richer, contained, different_in

# Factors by which an element that has vanished exceeds a usual one, or falls short of it, at a
# start; and the usual relaxation time as a share of the length of the experiment.
_AWAY_FROM_USUAL, _USUAL_SHARE = (3.0, 100.0), 0.1
# Factors by which power laws have fewer points and fewer starts. Their responses take forty times
# as long; of 150 fits to 75 traces none had a chi^2 higher by more than 5e-7 than with all.
_FEWER_FOR_POWER_LAWS = 10, 2
# A decrease of chi^2 that is worth a fit, far below the 1 that a standard error changes it by.
_WORTH_A_FIT = 0.01
# Relaxation times that every branch of a single model tries.
_TRIED_TIMES = 6
# Models that are equivalent in other parameters may improve one another in turn.
_MOST_REFITS = 3

Fits = dict[str, Fit]
"""Fits of a trace by candidate."""
Worth = Callable[[str, int, Fits], bool]
"""Tells of a candidate, a trace, and its fits so far, if it is worth another."""


def deepen(problems: Sequence[TraceProblem], fits: Sequence[Fit]) -> list[Fit]:
    """Return the fits of traces by one model, or lower ones with another relaxation time.

    Random starts may all miss a basin in which an element hardly shows. So every spring and its
    damper start once more, as stiff as the others on average, with times from that of the closest
    readings to the trace's length.
    """
    model = problems[0].residuals.model
    names = model.names
    dampers = {name: f"c{name[1:]}" for name in names if name[0] == "k" and name != "k_p"}
    pairs = [(names.index(k), names.index(c)) for k, c in dampers.items() if c in names]
    if not pairs or model.power_law:
        return [*fits]
    springs, tries, starts = [spring for spring, _ in pairs], len(pairs) * _TRIED_TIMES, []
    for problem, fit in zip(problems, fits, strict=True):
        residuals, best = problem.residuals, np.log(fit.parameters)
        shortest_s, _ = residuals.course.spread_s(residuals.trace.time_s)
        tried = np.log(np.geomspace(shortest_s, residuals.duration_s, _TRIED_TIMES))
        for (spring, damper), log_time in product(pairs, tried):
            start = best.copy()
            start[spring] = np.mean(best[springs])
            start[damper] = start[spring] + log_time
            starts.append(np.clip(start, problem.low, problem.high))
    posed = [problem for problem in problems for _ in range(tries)]
    ends, deeper = fit_from(posed, np.array(starts), roughly=True), []
    for problem, fit, some in zip(problems, fits, parts(len(posed), tries), strict=True):
        lowest = some.start + int(np.argmin(ends.misfit[some].astype(np.float32)))
        is_lower = _is_noticeably_lower(float(ends.misfit[lowest]), fit.misfit, problem)
        deeper.append(_better_from(fit, problem, ends.x[lowest]) if is_lower else fit)
    return deeper


def fit_models(
    problems: Sequence[Mapping[str, TraceProblem]],
    settings: LeastSquaresSettings,
    rngs: Sequence[Mapping[str, np.random.Generator]],
    done: Callable[[], None] = lambda: None,
    near: Sequence[Mapping[str, Array]] | None = None,
    worth: Worth = lambda name, trace, fits: True,
) -> list[Fits]:
    """Fit nested models to traces by least squares; return the best fits of each trace.

    Of each trace, problems by candidate are given, random generators, and additional starts,
    (n_parameters,); `done` is called after every model. Parameters found may be zero or infinite. A
    fit worse than a nested model's within its own range has not converged. Models are fitted in the
    order of their numbers of parameters, each to the traces that are `worth` it.
    """
    fits: list[Fits] = [{} for _ in problems]
    for name in sorted({name for of_trace in problems for name in of_trace}, key=_cost):
        which = [
            trace
            for trace, of_trace in enumerate(problems)
            if name in of_trace and worth(name, trace, fits[trace])
        ]
        posed, further = [problems[trace][name] for trace in which], []
        for trace, problem in zip(which, posed, strict=True):
            starts = _of_contained(name, fits[trace], problem.residuals.duration_s)
            points = [within_range(start, problem) for start in starts]
            points += [near[trace][name]] if near and name in near[trace] else []
            further.append(np.reshape(points, (-1, len(problem.low))))
        budget, (fewer, few) = settings, _FEWER_FOR_POWER_LAWS
        if CANDIDATES[name].model.power_law:
            budget = LeastSquaresSettings(-(-budget.candidates // fewer), -(-budget.starts // few))
        if which:
            random = [rngs[trace][name] for trace in which]
            best = deepen(posed, identify_many(posed, budget, random, silent, further))
            for trace, fit in zip(which, best, strict=True):
                fits[trace][name] = fit
        done()
    for trace, of_trace in enumerate(problems):
        _let_none_be_worse(of_trace, fits[trace])
        fits[trace] = {name: fits[trace][name] for name in of_trace if name in fits[trace]}
    return fits


def _cost(name: str) -> tuple[int, bool, int]:
    """Return what models are fitted in the order of: parameters, and if it is a power law."""
    model = CANDIDATES[name].model
    return len(model.names), model.power_law, [*CANDIDATES].index(name)


def _of_contained(name: str, fits: Fits, longest_s: float) -> Iterator[Array]:
    """Yield nested optima as starts; what has vanished is noticeable, or hardly noticeable."""
    kinds = np.array([parameter.kind for parameter in CANDIDATES[name].model.parameters])
    for inner in different_in(name, [*fits]):
        parameters = as_richer(name, inner, fits[inner].parameters)
        gone = (kinds != "exponent") & ((parameters == 0) | ~np.isfinite(parameters))
        for times in _AWAY_FROM_USUAL if gone.any() else (1.0,):
            start = parameters.copy()
            for index in np.flatnonzero(gone):
                usual = _usual(kinds[index], kinds, parameters, ~gone, longest_s)
                start[index] = usual * times if parameters[index] else usual / times
            yield start


def _usual(kind: str, kinds: Array, values: Array, there: BoolArray, longest_s: float) -> float:
    """Return the mean size of a kind's elements, or one that relaxes within the experiment."""
    if np.any(alike := there & (kinds == kind)):
        return float(np.exp(np.mean(np.log(values[alike]))))
    others = values[there & (kinds != "exponent") & (values > 0)]
    relaxation_s = _USUAL_SHARE * longest_s if kind == "damping" else 1 / (_USUAL_SHARE * longest_s)
    return float(np.exp(np.mean(np.log(others)))) * relaxation_s


def _let_none_be_worse(problems: Mapping[str, TraceProblem], fits: Fits) -> None:
    """Let no model of a trace fit worse, in place, than one that is nested in it.

    Within its range it is fitted again. Else the better optimum of the nested model is its result.
    """
    for _ in range(_MOST_REFITS):
        before = dict(fits)
        for name, inner in _worse(fits):
            parameters, problem = as_richer(name, inner, fits[inner].parameters), problems[name]
            if is_within(parameters, problem):
                fits[name] = _better_from(fits[name], problem, within_range(parameters, problem))
        if all(fits[name] is before[name] for name in fits):
            break
    for name, inner in _worse(fits):
        simpler, parameters = fits[inner], as_richer(name, inner, fits[inner].parameters)
        reached = simpler.converged and not is_within(parameters, problems[name])
        fit = replace(fits[name], parameters=parameters, misfit=simpler.misfit)
        fits[name] = replace(fit, converged=reached)


def _worse(fits: Fits) -> Iterator[tuple[str, str]]:
    """Yield model and nested model where the nested one fits better; simple ones first."""
    for name in fits:
        for inner in filter(fits.__contains__, contained(name)):
            if _digits(fits[inner].misfit) < _digits(fits[name].misfit):
                yield name, inner


def _is_noticeably_lower(misfit: float, than: float, problem: TraceProblem) -> bool:
    """Return True if a misfit is lower by what the data could tell: see `_WORTH_A_FIT`."""
    gain = problem.residuals.samples * (than**2 - misfit**2)
    return gain > _WORTH_A_FIT * misfit**2


def _better_from(answer: Fit, problem: TraceProblem, start: Array) -> Fit:
    """Return the fit from a start if its misfit is lower, or else the answer itself."""
    again = refit(answer, problem, start)
    return again if _digits(again.misfit) < _digits(answer.misfit) else answer


def _digits(misfit: float) -> float:
    """Round a misfit to nine digits, below which processors differ."""
    return float(f"{misfit:.8e}")


def within_range(parameters: Array, problem: TraceProblem) -> Array:
    """Return log-parameters, clipped to the search range."""
    with np.errstate(divide="ignore"):
        return np.clip(np.log(parameters), problem.low, problem.high)


def is_within(parameters: Array, problem: TraceProblem) -> bool:
    """Return True if parameters, (n_parameters,), lie in the search range."""
    with np.errstate(divide="ignore"):
        x = np.log(parameters)
    return bool(np.all((x >= problem.low) & (x <= problem.high)))


def aic_and_bic(
    misfit: ArrayLike, samples: ArrayLike, parameters: ArrayLike
) -> tuple[Array, Array]:
    """Compute AIC and BIC for Gaussian noise of unknown standard deviation.

    AIC = n ln(misfit^2) + 2 (p + 1) and BIC = n ln(misfit^2) + (p + 1) ln n, the noise being one
    parameter more; of RMS misfits of best fits, n samples and p parameters, of any one shape.
    """
    free = np.asarray(parameters) + 1
    square = np.asarray(samples) * 2 * np.log(misfit)
    return square + 2 * free, square + free * np.log(samples)


def ranked(
    candidates: Sequence[str], misfits: Sequence[float], samples: int
) -> dict[str, tuple[float, float]]:
    """Compute AIC and BIC of the best fits of models to one trace, by name, over their lowest."""
    aic, bic = aic_and_bic(misfits, samples, [_count_parameters(name) for name in candidates])
    values = zip((aic - aic.min()).tolist(), (bic - bic.min()).tolist(), strict=True)
    return dict(zip(candidates, values, strict=True))


def _count_parameters(name: str) -> int:
    return len(CANDIDATES[name].model.names)


@dataclass(frozen=True)
class FittedModels:
    """Best fits of sample models to a trace, and which of them BIC prefers."""

    chosen: str
    """Sample model that the trace was identified with."""
    tried: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    """AIC and BIC of each model by its name, minus the lowest of the models tried."""
    answers: Mapping[str, Fit] = field(default_factory=dict)
    """Fit of each by its name, in the same order."""
    adequate: bool = True
    """False if that of the model which BIC prefers is rejected for what it leaves."""
    spared: tuple[str, ...] = ()
    """Models that were not fitted: their BIC could not be lower by `WORTH_A_MENTION`."""

    @property
    def lead(self) -> float:
        """How much lower than that of the chosen model the BIC of another is."""
        return self.tried.get(self.chosen, (0.0, 0.0))[1]

    def _lowest(self, names: Iterable[str]) -> str:
        """Return the model of lowest BIC."""
        return min(names, key=lambda name: self.tried[name][1])

    @property
    def preferred(self) -> str | None:
        """The model that BIC prefers to the chosen one by more than chance, if any."""
        name = self._lowest(self.tried) if self.tried else self.chosen
        simpler = _count_parameters(name) < _count_parameters(self.chosen)
        return name if self.lead >= (levels.WORTH_A_MENTION if simpler else levels.STRONG) else None

    @property
    def far_better(self) -> bool:
        """True if BIC prefers another model, simpler or richer, and not for its size alone."""
        if (name := self.preferred) is None:
            return False
        fewer = _count_parameters(self.chosen) - _count_parameters(name)
        # Difference of n ln(misfit^2), which leaves the number of parameters aside.
        worse = self.tried[self.chosen][0] - self.tried[name][0] - 2 * fewer
        return fewer <= 0 or worse > levels.WORTH_A_MENTION

    def one_branch_more(self) -> str | None:
        """Return the model with one branch more than the best, if it was not tried; else None.

        Where the best is not adequate, it is one more than the best Maxwell-Wiechert model.
        """
        branched = [name for name in CANDIDATES if CANDIDATES[name].model.free_branches]
        rich = [name for name in branched if not CANDIDATES[name].model.power_law]
        among = [] if self.adequate else [name for name in self.tried if name in rich]
        best = self._lowest(among or self.tried)
        richer = (name for name in branched if [*CANDIDATES[name].model.contains][:1] == [best])
        name = next(richer, None)
        return None if name in self.tried else name

    def advice(self) -> str:
        """State in a sentence whether BIC prefers another of the models tried to the chosen one."""
        title = CANDIDATES[self.chosen].model.title
        title = title[0].upper() + title[1:]
        best = self.preferred or self._lowest(self.tried)
        named = f"{CANDIDATES[best].model.title} (--model {best})"
        fewer = _count_parameters(self.chosen) - _count_parameters(best)
        count, lower = len(self.tried), f"BIC lower by {plain(self.lead)}"
        if self.preferred is None:
            more = f"; {len(self.spared)} more could not, however well they fit"
            said = f"{title}: none of the {count} models tried suits the trace better"
            said += f"{more if self.spared else ''}."
            as_good = f"{named} suits it as well with {counted(fewer, 'parameter')} less ({lower})."
            return f"{said} {as_good}" if fewer > 0 else said
        lower = f"with a {lower}"
        if not self.adequate:
            return (
                f"None of the {count} models tried is adequate: the best of them, {named}, "
                f"{lower}, leaves more than noise, too."
            )
        if not self.far_better:
            return f"A simpler model, {named}, fits as well, {lower}."
        what = "is not adequate" if fewer else "suits the trace less well"
        return f"{title} {what}: {named} is preferred, {lower}."

    def data(self, *, rejected: bool) -> dict[str, Any]:
        """Return one row per model, and advice in words, as plain data.

        If the fit of the chosen model is rejected, advice is only another model, simpler or richer,
        that may suit the trace.
        """
        rows = [
            {
                "model": name,
                "title": CANDIDATES[name].model.title,
                "parameters": _count_parameters(name),
                "misfit_rad": answer.misfit,
                "vanished": vanished(name, answer),
                "converged": answer.converged,
                "delta_aic": self.tried[name][0],
                "delta_bic": self.tried[name][1],
            }
            for name, answer in self.answers.items()
        ]
        return {
            "models": rows,
            "models_spared": [CANDIDATES[name].model.title for name in self.spared],
            "preferred_model": self.preferred if self.adequate else None,
            "advice": self.advice() if rows and (not rejected or self.far_better) else None,
        }


def vanished(candidate: str, answer: Fit) -> list[str]:
    """Name the elements that vanish in the best fit: parameters that are zero or infinite."""
    elements = zip(CANDIDATES[candidate].model.parameters, answer.parameters, strict=True)
    return [p.name for p, size in elements if size in (0, np.inf) and p.kind != "exponent"]
