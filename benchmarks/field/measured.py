"""Measured creep and relaxation (`data/measured`), and what every program leaves of them.

What a fit leaves is evaluated exactly, by biogrip, from the parameters that a program prints, and
beside it by the curve that the program draws. Programs weigh readings differently, some with no way
to change that: a fit is compared with the best one in its own measure.
"""

import io
import logging
import signal
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass, field, replace
from functools import cache, cached_property, partial
from pathlib import Path
from typing import TypeVar

import numpy as np

from benchmarks.report import Row, Section, number
from benchmarks.timing import Timed, clocked
from biogrip.arrays import Array, BoolArray
from biogrip.config.loading import read_configs
from biogrip.fit.experiment import Experiment
from biogrip.fit.problem import Fit
from biogrip.identify.prepare import prepare, ranges_of
from biogrip.judging.diagnosis import diagnose
from biogrip.judging.profiles import DETERMINED
from biogrip.library import Phase, Sample, hold, identify_sample, one_blas_thread, simulate
from biogrip.traces.reader import Recording, read_recording
from biogrip_study.config.study import load_study

ROOT = Path(__file__).parents[2]
CONFIGS = ("config/config.yaml", "config/measured.yaml")
_ROUNDS = 3
# Of a fit, and once more of its limits.
_TIME_LIMIT_S = 60.0

KNOWN, RELATIVE, EQUAL = "known", "relative", "equal"
"""What readings are divided by before their squares are summed: their known standard deviations,
themselves, or nothing."""

Result = TypeVar("Result")
Said = Mapping[str, tuple[float | None, float | None, float | None]]
"""Value and limits by parameter, as a program prints them; what it does not give is none."""


@cache
def _recorded(name: str) -> tuple[Recording, Experiment]:
    files = [ROOT / file for file in CONFIGS]
    case = load_study(read_configs(files), files).cases[name]
    file = ROOT / f"data/measured/{name}.csv"
    return prepare(read_recording(file, case.block.measurement), case.experiment)


@dataclass(frozen=True)
class Task:
    """A measured trace, a case of `config/measured.yaml`, and the model to fit."""

    title: str
    name: str
    sample: Sample
    fixed: Mapping[str, float] = field(default_factory=dict)
    """What of the model is known."""
    load_s: tuple[float, float] | None = None
    """Start and end of the stretch that is taken for a step, if not the whole recording is."""

    @cached_property
    def _chosen(self) -> BoolArray:
        time_s = _recorded(self.name)[0].time_s
        start, end = self.load_s or (-np.inf, np.inf)
        chosen: BoolArray = (time_s > start) & (time_s < end)
        return chosen

    @property
    def time_s(self) -> Array:
        """Times since the step, (n_samples,)."""
        start = self.load_s[0] if self.load_s else 0.0
        return np.asarray(_recorded(self.name)[0].time_s[self._chosen] - start)

    @property
    def data(self) -> Array:
        """Readings in SI units, (n_samples,)."""
        return np.asarray(_recorded(self.name)[0].readings[self._chosen])

    def deviations(self, measure: str) -> Array | None:
        """Return what readings are divided by, (n_samples,), or none if by nothing."""
        if measure == RELATIVE:
            return np.abs(self.data)
        return _recorded(self.name)[0].sd if measure == KNOWN else None

    def experiment(self, measure: str) -> Experiment:
        """Return what biogrip is told, with the search ranges of `biogrip identify`."""
        given = _recorded(self.name)[1]
        phases: tuple[Phase, ...] = given.phases
        if self.load_s:
            phases = (hold(self.load_s[1] - self.load_s[0], 1.0),)
        problem = Experiment(
            given.gripper,
            phases,
            given.ranges,
            replace(self.sample, stiffness=given.sample.stiffness),
            self.fixed,
            given.instrument,
        ).weighted(self.deviations(measure))
        own = ranges_of(problem, self.time_s, self.data)
        return replace(problem, ranges={**given.ranges, **own})

    def curve(self, parameters: Mapping[str, float]) -> Array:
        """Return the exact response of a sample, (n_samples,)."""
        return simulate(self.experiment(EQUAL), {**self.fixed, **parameters}, self.time_s)

    def left(self, curve: Array, measure: str) -> float:
        """Return the sum of squares that a curve leaves; infinite for no number."""
        deviations = self.deviations(measure)
        rest = (curve - self.data) / (1.0 if deviations is None else deviations)
        found = float(rest @ rest)
        return found if np.isfinite(found) else np.inf


STRETCH_S = (1.0, 5.0)
_NO_DAMPER = {"c_p": 0.0}
TASKS = (
    Task("HL60 cell, recovery too", "hl60", Sample("springpot")),
    Task("HL60 cell, while stretched", "hl60", Sample("springpot"), load_s=STRETCH_S),
    Task("Mucus", "mucus", Sample("springpot_beside_damper")),
    Task("Mucus, Maxwell branches", "mucus", Sample("generalized_maxwell", 2), _NO_DAMPER),
    Task("Fish muscle", "fish_muscle", Sample("springpots_in_series")),
    Task(
        "Fish muscle, Maxwell branches", "fish_muscle", Sample("generalized_maxwell", 3), _NO_DAMPER
    ),
    Task("Fish muscle, a damper beside", "fish_muscle", Sample("fractional_jeffreys")),
    Task("Cellulose hydrogel", "cellulose_hydrogel", Sample("fractional_kelvin_voigt")),
    Task(
        "Cellulose hydrogel, Maxwell branches",
        "cellulose_hydrogel",
        Sample("generalized_maxwell", 2),
        _NO_DAMPER,
    ),
)


@dataclass(frozen=True)
class Answer:
    """What a program found."""

    curve: Array | float
    """What it draws through the readings, (n_samples,), or what it says that this leaves."""
    parameters: Mapping[str, float] | None
    """By name, if the program has the model; else none."""
    said: Callable[[], Said]
    """Returns what it prints of its parameters."""


@dataclass(frozen=True)
class Program:
    """A program, the tasks that it can take, and in which measure it fits them."""

    name: str
    fit: Callable[[Task], Answer]
    takes: Callable[[Task], bool]
    measure: Callable[[Task], str]
    timed: bool = True


def natural(task: Task) -> str:
    """Return the measure of the config: with the standard deviations of the file, if it has any."""
    return EQUAL if task.deviations(KNOWN) is None else KNOWN


def by_biogrip(task: Task, measure: str | None = None) -> Answer:
    """Identify a sample as `identify_sample` does, and judge the fit alone."""
    experiment = task.experiment(measure or natural(task))
    found = identify_sample(experiment, task.time_s, task.data)
    value = dict(zip(experiment.searched.names, map(float, found.parameters), strict=True))
    return Answer(task.curve(value), value, partial(_judged, task, experiment, found))


@one_blas_thread
def _judged(task: Task, experiment: Experiment, found: Fit) -> Said:
    problem = experiment.of(task.time_s, task.data)
    diagnosis = diagnose(problem, found, confidence=0.95)
    return {
        f.quantity.label: (f.value if f.verdict == DETERMINED else None, f.low, f.high)
        for f in diagnosis.findings
        if f.quantity.label in experiment.searched.names
    }


OURS = "biogrip"
BIOGRIP = Program(OURS, by_biogrip, lambda task: True, natural)

# Parameters and sums of relative squares that pyRheo's demonstrations print; see data/measured.
_PRINTED: Mapping[str, tuple[Mapping[str, float], float]] = {
    "mucus": (
        {"k_alpha": 0.5592623161935315, "alpha": 0.10559343301296215, "c_p": 0.311345334419145},
        0.001431460447772356,
    ),
    "fish_muscle": (
        {
            "k_alpha": 869957.8100803907,
            "alpha": 0.6743835722938449,
            "k_beta": 22074.487016914965,
            "beta": 0.1100620057209222,
        },
        0.01075590006240943,
    ),
}


def by_pyrheo(task: Task) -> Answer:
    """Return what pyRheo's demonstrations print, with its Padé approximation `Pade54`."""
    parameters, left = _PRINTED[task.name]
    return Answer(left, parameters, lambda: {n: (v, None, None) for n, v in parameters.items()})


def _is_pyrheos(task: Task) -> bool:
    return task.name in _PRINTED and set(task.sample.model.names) == set(_PRINTED[task.name][0])


PYRHEO = Program("pyRheo, as published", by_pyrheo, _is_pyrheos, lambda task: RELATIVE, timed=False)


@contextmanager
def _kept_in_bounds() -> Iterator[None]:
    """Keep quiet whoever prints, warns or logs, and stop whoever takes too long."""

    def stop(*_: object) -> None:
        raise TimeoutError

    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, _TIME_LIMIT_S)
    logging.disable(logging.CRITICAL)
    try:
        with warnings.catch_warnings(), redirect_stdout(io.StringIO()):
            warnings.simplefilter("ignore")
            yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
        logging.disable(logging.NOTSET)


def _attempt(call: Callable[[], Result], failures: Counter[str]) -> Result | None:
    """Call others' code: whatever it raises is a result, too, and is counted by its kind."""
    try:
        with _kept_in_bounds():
            return call()
    except Exception as error:
        failures[type(error).__name__] += 1
        return None


def compared(programs: Sequence[Program], task: Task) -> list[Row]:
    """Fit a task by every program that takes it, in turn; a row a program."""
    own = [program for program in programs if program.takes(task)]
    failures = {program.name: Counter[str]() for program in own}
    seconds: dict[str, list[tuple[float, float]]] = {program.name: [] for program in own}
    answers: dict[str, Answer | None] = {}
    said: dict[str, Said] = {}
    for _ in range(1 + _ROUNDS):
        for name, fit in ((program.name, program.fit) for program in own):
            fit_s, answer = clocked(partial(_attempt, partial(fit, task), failures[name]))
            asked = answer.said if answer else dict
            said_s, found = clocked(partial(_attempt, asked, failures[name]))
            seconds[name].append((fit_s, fit_s + said_s))
            answers[name], said[name] = answer, found or {}
    # The first round is a warm-up.
    times = {name: np.array(spent[1:]).T for name, spent in seconds.items()}
    fits, whole = (Timed({name: spent[i] for name, spent in times.items()}) for i in (0, 1))
    exact = {
        name: task.curve(answer.parameters) if answer and answer.parameters else None
        for name, answer in answers.items()
    }
    best = {}
    for measure in {program.measure(task) for program in own}:
        curves = (*exact.values(), np.asarray(by_biogrip(task, measure).curve))
        best[measure] = min(_left(task, curve, measure) for curve in curves)
    rows: list[Row] = []
    for program in own:
        name, measure = program.name, program.measure(task)
        row: Row = {
            "task": task.title,
            "program": name,
            "measure": measure,
            "best": best[measure],
            "drawn": _over(best[measure], _drawn(task, answers[name], measure)),
            "exact": _over(best[measure], _left(task, exact[name], measure)),
            "said": {quantity: list(of) for quantity, of in said[name].items()},
            "failures": dict(failures[name]),
        }
        if program.timed:
            row |= {f"fit_{key}": value for key, value in fits.against(name, OURS).items()}
            row |= {f"whole_{key}": value for key, value in whole.against(name, OURS).items()}
        rows.append(row)
    return rows


def _left(task: Task, curve: Array | None, measure: str) -> float:
    return np.inf if curve is None else task.left(curve, measure)


def _drawn(task: Task, answer: Answer | None, measure: str) -> float:
    if answer is None:
        return np.inf
    return answer.curve if isinstance(answer.curve, float) else task.left(answer.curve, measure)


def _over(best: float, left: float) -> float | None:
    """JSON has no infinity."""
    return left / best if np.isfinite(left) else None


def _ratio(value: float | None) -> str:
    return "–" if value is None else number(value, 5)


def _time(row: Row, key: str) -> str:
    return number(row[key], 2) if key in row else ""


def _says(row: Row) -> str:
    said = "; ".join(f"{n} {_limited(*of)}" for n, of in row["said"].items())
    failed = ", ".join(f"{kind} {count} times" for kind, count in row["failures"].items())
    return "; ".join(filter(None, [said, failed]))


def _limited(value: float | None, low: float | None, high: float | None) -> str:
    ends = [None if x is None or not np.isfinite(x) else number(x, 4) for x in (low, high)]
    between = f"({ends[0] or 'open'} to {ends[1] or 'open'})"
    if value is None:
        return between if any(ends) else "not determined"
    return f"{number(value, 4)} {between}" if any(ends) else f"{number(value, 4)}, no limits"


_COLUMNS: dict[str, Callable[[Row], str]] = {
    "trace, model": lambda row: row["task"] if row["program"] == OURS else "",
    "program": lambda row: row["program"],
    "weights": lambda row: row["measure"],
    "leaves, of the best": lambda row: _ratio(row["exact"]),
    "by its own curve": lambda row: _ratio(row["drawn"]),
    "time of the fit (ms)": lambda row: _time(row, "fit_time_ms"),
    "times ours": lambda row: _time(row, "fit_times_ours"),
    "with limits, times ours": lambda row: _time(row, "whole_times_ours"),
    "what it says (95 % limits)": _says,
}

_TEXT = f"""\
The traces of `data/measured`, each with the model that was published for it. Maxwell branches are
fitted too, and to a step of strain a parallel damper, which acts at the step only, where nothing is
read (`benchmarks/field/measured.py`; the other programs: `measured_peers.py`).

*Leaves, of the best*: the sum of squares that the printed parameters leave, evaluated exactly, over
the least that any program with the model leaves. Beside it stands that of the curve that the
program draws. *Weights*: readings are divided by their known standard deviations, by themselves
(relative), or by nothing (equal). Every program is compared in its own weights, and biogrip is
fitted in all of them; its rows have those of `config/measured.yaml`. A dash: the printed parameters
are not those of springs, dampers and springpots of the model.

RheoJAX takes no standard deviations, and steps only, not HL60's recovery. lmfit has no models, and
is given biogrip's curve. Its limits are those of `conf_interval`; where that fails, or takes
{_TIME_LIMIT_S:g} s, they are 1.96 of its standard errors, and without those there are none.
pyRheo cannot be installed from PyPI. Its rows are what its demonstrations print, fitted with the
Padé approximation `Pade54` of Mittag-Leffler functions; that of the hydrogel is of other readings.
Parameters have the names that each program prints. Times are medians of {_ROUNDS} rounds after a
warm-up."""


def section(programs: Sequence[Program]) -> Section:
    """Return the comparison of programs on all tasks."""

    def measure() -> list[Row]:
        return [row for task in TASKS for row in compared(programs, task)]

    return Section("measured", "Measured traces", _TEXT, _COLUMNS, measure)
