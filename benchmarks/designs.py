"""Whole designs, against random search with the same processor time."""

import resource
import time
from collections.abc import Callable, Iterator

import numpy as np

from benchmarks.section import Row, Section, number
from benchmarks.setup import CONFIG
from biogrip.design.experiment import DesignInputs
from biogrip.design.neighbours import random_train
from biogrip.design.rating import LOST, Rater
from biogrip.design.schedule import planned
from biogrip.design.shapes import SHAPES, STEPS
from biogrip.design.waveform import Waveform
from biogrip.design.within_reach import plan_within_reach
from biogrip.experiment.random_streams import stream
from biogrip.study.design_inputs import make_design_inputs
from biogrip.study.load import load_study, read_configs

OURS, FAMILY = "biogrip", "biogrip, without climbing"
TRAINS, CYCLES = "random trains of 2 to 7 steps", "random trains of cycles"

_TRIED = 2000
_NEIGHBOURS = 4 * _TRIED
# Random torques whose jaws are checked and whose readings are listed as for a design.
_BEST = 128

_TEXT = f"""\
What to hold and when to read, for the three samples of `config/design.yaml`, by `biogrip design`
with its default of {_TRIED:,} candidates, and {_NEIGHBOURS:,} neighbours that are climbed over.
Random search rates torques in the same way for as much processor time: trains of few steps, even in
level and in the logarithm of time, or the cycles that the search itself chooses from. The best
{_BEST} get their readings as a design does, if the jaws press. The bound is the largest of the four
parameters', from the list of instants that is printed; the last column is how many times ours it
is."""


def designs_section() -> Section:
    """Design every case's experiment, and search at random for as long."""
    folder = CONFIG.parent
    files = [CONFIG, folder / "design.yaml"]
    study = load_study(read_configs(files), files)
    rows = [
        row
        for name, case in study.cases.items()
        if case.block.design is not None
        for row in compared(name, make_design_inputs(case), study.study_seed, _TRIED, _NEIGHBOURS)
    ]
    columns: dict[str, Callable[[Row], str]] = {
        "case": lambda row: row["case"].replace("_", " "),
        "way": lambda row: row["way"],
        "torques": lambda row: f"{row['torques']:,}",
        "processor time (s)": lambda row: number(row["processor_s"], 2),
        "bound": lambda row: f"{100 * row['bound']:.3g} %",
        "times ours": lambda row: number(row["times_ours"]),
    }
    return Section("designs", "Whole designs", _TEXT, columns, rows)


def compared(case: str, inputs: DesignInputs, seed: int, tried: int, neighbours: int) -> list[Row]:
    """Return a row for every way to design an experiment."""
    rows: list[Row] = []

    def add(way: str, torques: int, processor_s: float, bound: float) -> None:
        ours = rows[0]["bound"] if rows else bound
        columns = {"case": case, "way": way, "torques": torques, "processor_s": processor_s}
        rows.append({**columns, "bound": bound, "times_ours": bound / ours})

    spent_s = 0.0
    for way, more in ((OURS, neighbours), (FAMILY, 0)):
        rng = stream(seed, case, 0, "design")
        begun = _processor_s()
        _, plan = plan_within_reach(inputs, tried, rng, lambda *_: None, neighbours=more)
        taken = _processor_s() - begun
        spent_s = spent_s or taken
        add(way, tried + more, taken, inputs.typical_bound(plan.information))
    for way, draw in ((TRAINS, _trains), (CYCLES, _cycles)):
        found, count, taken = random_search(
            inputs, draw(inputs, stream(seed, case, 0, way)), spent_s
        )
        plan = planned(inputs, [Rater(inputs).torque(waveform) for waveform in found])
        add(way, count, taken, inputs.typical_bound(plan.information))
    return rows


def random_search(
    inputs: DesignInputs, drawn: Iterator[Waveform], longest_s: float
) -> tuple[list[Waveform], int, float]:
    """Return the best torques, how many were rated, and the processor time that it took."""
    rater, begun = Rater(inputs), time.process_time()
    rated: list[tuple[float, int, Waveform]] = []
    count = 0
    while (taken := time.process_time() - begun) < longest_s:
        waveform = next(drawn)
        count += 1
        value = rater.rate(waveform).logarithm
        if value < LOST:
            rated = sorted([*rated, (value, count, waveform)], key=lambda one: one[:2])[:_BEST]
    return [waveform for _, _, waveform in rated], count, taken


def _trains(inputs: DesignInputs, rng: np.random.Generator) -> Iterator[Waveform]:
    while True:
        yield random_train(inputs.limits, rng).waveform(inputs.limits)


def _cycles(inputs: DesignInputs, rng: np.random.Generator) -> Iterator[Waveform]:
    shape = SHAPES[STEPS]
    while True:
        yield shape.waveform(rng.random(shape.shares), inputs.limits)


def _processor_s() -> float:
    """Return the processor time of this process, and of those that it has waited for."""
    both = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(usage.ru_utime + usage.ru_stime for usage in both)
