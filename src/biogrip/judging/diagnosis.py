"""Diagnosis of one trace: best fit, a verdict on every quantity, and doubts about the result.

Quantities are profiled (`compute_findings`), and combinations of those not determined. If a profile
comes below the optimum, all is done again from there. Then notes are taken, in this order:

1. A confidence set in parts is harmless.
2. A parameter at an end of its search range, with chi^2 lower beyond it, rejects the fit.
3. Residuals that are not white noise (`biogrip.judging.doubts`) make it doubtful; a misfit of 2 %
   of the peak or more rejects it. Limits allow for a smaller one.
4. Jaws that would have to pull are harmless.
5. A fit that has not converged is doubtful, and so are arms that ring.
"""

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial

import numpy as np

import biogrip.levels as levels
from biogrip.arrays import Array
from biogrip.digits import plain
from biogrip.fit.experiment import Experiment
from biogrip.fit.least_squares import fit_from, refit
from biogrip.fit.nested_fits import FittedModels
from biogrip.fit.problem import Fit, TraceProblem
from biogrip.fit.trace_fit import TraceFit
from biogrip.judging.doubts import (
    DOUBT,
    HARMLESS,
    REJECTED,
    REJECTION,
    RING,
    FindNotes,
    Note,
    compute_status,
    examine_residuals,
)
from biogrip.judging.likelihood import (
    Likelihood,
    characteristic_times,
    check_rows,
    make_likelihood,
    parameters_and_sum,
)
from biogrip.judging.profiles import DETERMINED, Finding, Trade, compute_findings, find_trade_offs
from biogrip.judging.what_moves import Move, find_moves
from biogrip.judging.without_model import KINDS, WithoutModel, tell_without_model, times_told
from biogrip.physics.response import Grip
from biogrip.physics.sample_model import C_P
from biogrip.traces.reader import Recording

# Widening of a range, and the start beyond its end, in e-folds; and rounding.
_RANGE_WIDENING, _START_BEYOND, _AT_RANGE_END = np.log(1e3), 1.0, 1e-9


@dataclass(frozen=True)
class Diagnosis:
    """The diagnosis of one trace: best fit, verdicts, contact force and doubts."""

    likelihood: Likelihood
    """Best fit and noise."""
    findings: list[Finding]
    """A verdict on every parameter and on the sum of the exchangeable ones."""
    trades: list[Trade] = field(default_factory=list)
    """Parameters of which only a combination is determined."""
    lowest: Array | None = None
    """Log-parameters at which profiles come below the best fit."""
    converged: bool = True
    """False if the best fit has not converged."""
    grip: Grip | None = None
    """Force of the jaws on the sample of the best fit."""
    notes: list[Note] = field(default_factory=list)
    """Notes on the result, with weights."""
    recording: Recording | None = None
    """The trace as it was fitted, of a trace that was identified."""
    experiment: Experiment | None = None
    """What was assumed of it, with what follows from the trace."""
    fit: TraceFit | None = None
    """The fit that was judged first, with the model of its noise."""
    models: FittedModels | None = None
    """Fits of other sample models."""
    onset_limits_s: tuple[float, float] | None = None
    """Limits of a fitted onset, from it."""

    @property
    def identified(self) -> tuple[Recording, Experiment]:
        """The trace and what was assumed of it, of a trace that was identified."""
        assert self.recording is not None
        assert self.experiment is not None
        return self.recording, self.experiment

    @property
    def status(self) -> str:
        """Status of the fit by these notes: ok, doubtful or rejected."""
        return compute_status(self.notes)

    def without_model(
        self, at_s: Sequence[float] = (), kinds: Collection[str] = KINDS
    ) -> WithoutModel:
        """Tell what any linear sample would show, see `tell_without_model`.

        Where none gives the trace, as the best of them would be rejected, nothing is told.
        """
        residuals = self.likelihood.problem.residuals
        tell = partial(tell_without_model, confidence=self.likelihood.confidence, kinds=kinds)
        told = tell(residuals, at_s=at_s)
        if self.onset_limits_s:
            starts, times = map(residuals.later, self.onset_limits_s), times_told(*told.covered_s)
            told = told.widened([tell(start, at_s=at_s or times) for start in starts])
        beyond_noise = told.misfit**2 - residuals.noise_scale**2
        far_off = beyond_noise > (levels.FAR_OFF * residuals.peak) ** 2
        hopeless = far_off and not told.is_linear and self.status == REJECTED
        return replace(told, told=[]) if hopeless else told

    @cached_property
    def moves(self) -> list[Move]:
        """What errors of the instrument do to determined quantities, none of a rejected fit."""
        of = [each.quantity for each in self.findings if each.verdict == DETERMINED]
        if self.status == REJECTED or not of or self.likelihood.problem.residuals.parts:
            return []
        return find_moves(self.likelihood, of, start_fitted=self.onset_limits_s is not None)

    def __repr__(self) -> str:
        """Return status and verdicts, a line each."""
        lines = (f"  {finding.quantity.label}  {finding.words()}" for finding in self.findings)
        return "\n".join([f"fit {self.status}", *lines])


def diagnose(problem: TraceProblem, fit: Fit, *, confidence: float) -> Diagnosis:
    """Judge the identification of one trace by profile likelihoods, as `diagnose_all` does."""
    return diagnose_all([problem], [fit], confidence=confidence)[0]


def diagnose_all(
    problems: Sequence[TraceProblem],
    fits: Sequence[Fit],
    *,
    confidence: float,
) -> list[Diagnosis]:
    """Judge the identification of each of several traces, by one model, by profile likelihoods.

    No diagnosis depends on the other traces. Fits are their global optima, as far as is known. The
    noise of a trace, if its standard deviation is not known, is that of the residual. Limits have a
    confidence, e.g. 0.95.
    """
    judged = settled(problems, fits, profile_all, confidence=confidence)
    return [with_notes(diagnosis, find_notes()) for diagnosis, find_notes in judged]


def profile_all(likelihoods: Sequence[Likelihood]) -> list[Diagnosis]:
    """Profile all quantities of traces, by one model, and combinations of those not determined."""
    model = likelihoods[0].problem.residuals.model
    every = compute_findings(likelihoods, parameters_and_sum(model))
    trades = map(find_trade_offs, likelihoods, every)
    return list(map(profiled, likelihoods, every, trades))


def settled(
    problems: Sequence[TraceProblem],
    fits: Sequence[Fit],
    profile: Callable[[Sequence[Likelihood]], list[Diagnosis]],
    *,
    confidence: float,
) -> list[tuple[Diagnosis, FindNotes]]:
    """Profile traces until no profile comes below a best fit.

    1. What each best fit leaves is examined: limits may have to allow for a misfit.
    2. `profile` computes profiles around all best fits.
    3. Where one of them comes below the best fit, the trace is fitted from its lowest point, and
       1 to 3 are repeated for this trace.

    Returns diagnoses, without notes, and what finds those of 1. See `diagnose_all` for the
    parameters.
    """
    best, done = list(fits), dict[int, tuple[Diagnosis, FindNotes]]()
    while left := [trace for trace in range(len(problems)) if trace not in done]:
        examined = []
        for trace in left:
            likelihood = make_likelihood(
                problems[trace],
                np.log(best[trace].parameters),
                best[trace].misfit,
                confidence=confidence,
                noise_sd=problems[trace].residuals.trace.known_noise,
            )
            check_rows(likelihood)
            examined.append(examine_residuals(likelihood))
        likelihoods, finders = zip(*examined, strict=True)
        for trace, judged, find_notes in zip(left, profile(likelihoods), finders, strict=True):
            lower = lower_fit(judged, best[trace])
            if lower is None:
                done[trace] = replace(judged, converged=best[trace].converged), find_notes
            else:
                best[trace] = lower
    return [done[trace] for trace in range(len(problems))]


def lower_fit(judged: Diagnosis, fit: Fit) -> Fit | None:
    """Return the fit from the lowest point of the profiles, if it is below the best fit."""
    exact = levels.EXACT * judged.likelihood.problem.residuals.peak
    if judged.lowest is None or fit.misfit < exact:
        return None
    missed = refit(fit, judged.likelihood.problem, judged.lowest)
    return None if judged.likelihood.increase(missed.misfit) > -levels.MISSED else missed


def profiled(likelihood: Likelihood, findings: list[Finding], trades: list[Trade]) -> Diagnosis:
    """Return a diagnosis without notes, with the lowest point of its profiles."""
    every = [*findings, *(trade.finding for trade in trades)]
    lowest = min(every, key=lambda finding: float(finding.increases.min()))
    missed = lowest.lowest if lowest.increases.min() < -levels.MISSED else None
    return Diagnosis(likelihood, findings, trades, lowest=missed)


def with_times(diagnoses: Sequence[Diagnosis]) -> list[Diagnosis]:
    """Return diagnoses with findings on relaxation and retardation times after the others.

    A sum that holds provided that branches relax within the experiment has no such condition where
    the limits of their times say so.
    """
    likelihoods = [diagnosis.likelihood for diagnosis in diagnoses]
    if not (times := characteristic_times(likelihoods[0].problem.residuals.model)):
        return [*diagnoses]
    every = compute_findings(likelihoods, times)
    pairs = zip(diagnoses, every, strict=True)
    return [
        replace(own, findings=[*(_unconditional(each, more, own) for each in own.findings), *more])
        for own, more in pairs
    ]


def _unconditional(finding: Finding, times: Sequence[Finding], judged: Diagnosis) -> Finding:
    """Return a finding without the conditions that the limits of relaxation times show to hold."""
    longest_s = judged.likelihood.problem.residuals.duration_s
    shown = {each.quantity.members[::-1] for each in times if (each.high or np.inf) < longest_s}
    left = (it for it in finding.quantity.penalties if it.before or it.branch not in shown)
    return replace(finding, quantity=replace(finding.quantity, penalties=tuple(left)))


def with_notes(judged: Diagnosis, of_rest: list[Note]) -> Diagnosis:
    """Return a diagnosis with the force of the jaws, and all notes: those on the rest, too."""
    likelihood, findings = judged.likelihood, judged.findings
    residuals = likelihood.problem.residuals
    grip = residuals.grip(likelihood.best)
    notes = [
        Note(
            HARMLESS,
            f"The confidence set of {finding.quantity.label} has {1 + len(finding.gaps)} separate "
            "parts; the limits are the outermost ones.",
        )
        for finding in findings
        if finding.gaps
    ]
    notes += [*_range_ends(likelihood), *of_rest]
    notes += _pulling(grip, residuals.duration_s)
    if not judged.converged:
        text = (
            "The fit has not converged: more steps would lower chi-squared a little. Rely on its "
            "verdicts, not on its digits."
        )
        notes.append(Note(DOUBT, text))
    notes += _ringing(judged, rejected=compute_status(notes) == REJECTED)
    return replace(judged, grip=grip, notes=notes)


def _range_ends(likelihood: Likelihood) -> Iterator[Note]:
    """Yield a note for each parameter that a wider range takes clearly beyond an end of its."""
    problem, x = likelihood.problem, likelihood.best
    for index, parameter in enumerate(problem.residuals.model.parameters):
        for end, outward, word in ((problem.low, -1.0, "lower"), (problem.high, 1.0, "upper")):
            # An exponent at its upper end is that of a damper: there is nothing beyond.
            bounded = outward > 0 and np.isfinite(parameter.below)
            if bounded or abs(x[index] - end[index]) > _AT_RANGE_END:
                continue
            start, low, high = x.copy(), problem.low.copy(), problem.high.copy()
            start[index] += outward * _START_BEYOND
            (low if outward < 0 else high)[index] += outward * _RANGE_WIDENING
            wider = fit_from([replace(problem, low=low, high=high)], start, roughly=True)
            if likelihood.increase(float(wider.misfit[0])) < -levels.BEYOND_THE_RANGE:
                unit = f" {parameter.unit}" if parameter.unit else ""
                yield Note(
                    REJECTION,
                    f"{parameter.name} is at the {word} end of its search range, "
                    f"{np.exp(end[index]):.3g}{unit}, and beyond it the trace fits better: widen "
                    f"search_range.{parameter.name} in the config, or check the set-up. Until "
                    "then nothing is determined.",
                )


def _ringing(judged: Diagnosis, *, rejected: bool) -> Iterator[Note]:
    """Yield a note if the arms, with the least parallel damper, ring in the trace."""
    likelihood = judged.likelihood
    residuals = likelihood.problem.residuals
    network = residuals.model.network(np.exp(likelihood.best))
    damper = [finding for finding in judged.findings if finding.quantity.label == C_P.name]
    if damper:
        network = replace(network, c_p=np.array([damper[0].low or 0.0]))
    misfit = rejected or np.isfinite(likelihood.independent)
    noise_sd = residuals.noise_scale if misfit else likelihood.noise_sd
    if ring := residuals.ring(network, noise_sd):
        yield Note(
            REJECTION if rejected else DOUBT,
            "The arms ring: their inertia, which fits leave out, changes readings of this sample "
            f"by up to {plain(ring.largest, 2)} times the noise. Leave out the readings of the "
            f"first {_rounded_up(1e3 * ring.lasts_s)} ms after each change of the torque.",
            RING,
        )


def _rounded_up(value: float) -> str:
    """Return a number of two digits that is not below the value."""
    unit = 10.0 ** (np.floor(np.log10(value)) - 1) if value > 0 else 1.0
    return f"{unit * np.ceil(value / unit * (1 - 1e-9)):.6g}"


def _pulling(grip: Grip | None, last_s: float) -> Iterator[Note]:
    """Yield a note if, with the best fit, the jaws would have to pull at the sample."""
    if grip is not None and grip.pulls_from_s is not None and grip.pulls_from_s <= last_s:
        yield Note(
            HARMLESS,
            f"With the best fit {grip.words()}. Without adhesion the jaws lost contact "
            "there: fit only the samples before that.",
        )
