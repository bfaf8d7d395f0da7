"""Design of a case's experiment, compared with the experiment in its config."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from biogrip.arrays import Array
from biogrip.design.earlier_traces import Earlier
from biogrip.design.experiment import NO_BOUND, DesignInputs
from biogrip.design.schedule import Plan, forces
from biogrip.design.several import Several
from biogrip.design.within_reach import plan_within_reach
from biogrip.experiment.protocol import Phase, largest_load
from biogrip.experiment.random_streams import stream
from biogrip.instrument.instrument import Instrument
from biogrip.own_design.at_a_price import aim, in_lines
from biogrip.study.design_inputs import make_design_inputs
from biogrip.study.study import Case

NEIGHBOURS = 4
"""Neighbours of trains of steps that are rated, for each torque that the search tries."""


@dataclass(frozen=True)
class Designed:
    """A designed experiment."""

    case: Case
    """Case that the experiment is for."""
    inputs: DesignInputs
    """Inputs of the design, without parameters that no torque determines."""
    plan: Plan
    """The designed experiment."""
    before: Array
    """Relative bounds for the plausible samples with the config's protocol and sampling, at the
    same noise and of arms with inertia, (n, n_parameters)."""
    after: Array
    """The same with the plan."""
    force_time_s: Array
    """Times of the jaw force, (n_times,); none without jaws."""
    force_N: Array
    """Jaw force under the plan, (n, n_times)."""
    several: Several | None = None
    """Several experiments with each cell of a population, if they have a price."""
    number: int = 0
    """Number of the experiment in a chosen set, from one; zero if it is of none."""
    times: int = 1
    """How often it is made with each cell."""


def designed(
    case: Case,
    study_seed: int,
    progress: Callable[[int, float], None],
    earlier: Earlier | None = None,
) -> Designed:
    """Design the experiment of a case with a block `design`.

    The callback gets the number of torques tried and the lowest typical relative bound. With
    information from earlier traces all bounds include it, the first ones assuming that the config's
    experiment is repeated.

    Raises
    ------
    BiogripError
        If no torque keeps the jaws pressing throughout and determines the quantities.
    """
    block = case.block.design
    assert block is not None
    rng = stream(study_seed, case.name, 0, "design")
    inputs, plan = plan_within_reach(
        make_design_inputs(case, earlier),
        block.candidates,
        rng,
        progress,
        neighbours=NEIGHBOURS * block.candidates,
        configured=case.phases,
    )
    history = inputs.averaged(case.phases)
    before = inputs.bounds(inputs.information(history, case.sampling.over(history.end_s)))
    network = inputs.model.network(inputs.parameters)
    time_s, force_N = np.zeros(0), np.zeros((len(inputs.parameters), 0))
    if inputs.instrument.has_jaws:
        time_s, force_N = forces(inputs.gripper, network, plan.phases)
    after = inputs.bounds(plan.information)
    return Designed(case, inputs, plan, before, after, time_s, force_N)


def in_words(found: Designed) -> str:
    """Return a design in words: settings, and bounds before and after."""
    model = found.inputs.model
    lines = [f"{found.case.title}: {_setting(found)}."]
    worst = [np.max(bounds, axis=0) for bounds in (found.before, found.after)]
    several = f", worst of {len(found.after)} plausible samples" if len(found.after) > 1 else ""
    lines.append(f"  bound (1 standard deviation{several}): as configured | designed")
    width = max(map(len, model.names)) + 13
    for name, before, after in zip(model.names, *worst, strict=True):
        lines.append(f"  {name} {percent(before):>{width - len(name)}} | {percent(after)}")
    if found.inputs.out_of_reach:
        lines.append(f"  {left_out(found.inputs)}")
    lines.append(f"  {best_in_words(found)}{_pressed(found)}")
    if found.several:
        lines += [f"  {line}" for line in in_lines(found.several, aim(found.case, found.several))]
    return "\n".join(lines)


def best_in_words(found: Designed) -> str:
    """Return how far the readings may be from the best ones of what is held, without a period."""
    controlled, gap = found.inputs.instrument.controlled.name, found.plan.gap
    if np.isnan(gap):
        text = f"how much better other readings of this {controlled} may be is not known, as the "
        return f"{text}noise has memory"
    return f"no other sampling of this {controlled} is better by more than {100 * gap:.2g} %"


def noise_in_words(inputs: DesignInputs) -> str:
    """Return the noise that all bounds are of, such as ``white noise of 3 µrad``."""
    noise, instrument = inputs.noise, inputs.instrument
    parts = []
    if noise.ar1:
        parts.append(f"AR(1) of {noise.ar1.time_s:g} s ({100 * noise.ar1.share:g} %)")
    if noise.flicker:
        parts.append(f"1/f ({100 * noise.flicker.share:g} %)")
    if noise.white_share > 0:
        parts.append(f"white ({100 * noise.white_share:g} %)" if parts else "white")
    level = f"{inputs.noise_rad:.3g} {instrument.read.unit}".rstrip()
    if instrument.has_jaws:
        level = f"{1e6 * inputs.noise_rad:.3g} µrad"
    along = ["offset"] * noise.fits_offset + ["drift"] * noise.fits_drift
    fitted = f", {' and '.join(along)} fitted along" if along else ""
    exposed = f", readings averaged over {noise.exposure_s:g} s each" if noise.exposure_s else ""
    return f"{', '.join(parts)} noise of {level}{fitted}{exposed}"


def _pressed(found: Designed) -> str:
    if not found.inputs.instrument.has_jaws:
        return ""
    return f"; the jaws press throughout, with at most {1e6 * found.force_N.max():.3g} µN"


def left_out(inputs: DesignInputs) -> str:
    """Return a sentence on parameters that no torque determines, and on remedies."""
    names = ", ".join(inputs.model.names[index] for index in sorted(inputs.out_of_reach))
    controlled = inputs.instrument.controlled.name
    return (
        f"left out, as no {controlled} that was tried determines it with readings at "
        f"{inputs.fastest_Hz:g} Hz: {names}; the other bounds allow for a factor of e to the "
        f"{NO_BOUND:g} in it. Faster readings (fastest_Hz), more {controlled} or other shapes may "
        "help."
    )


def _setting(found: Designed) -> str:
    plan = found.plan
    scale, unit = shown_unit(found.inputs.instrument)
    largest = f"{scale * largest_load(plan.phases):.4g}"
    unit = unit or found.inputs.instrument.controlled.name
    return (
        f"{in_numbers(plan.phases)} of up to {largest} {unit} "
        f"over {plan.torque.end_s:g} s, {len(plan.time_s)} samples in {len(plan.bursts)} bursts; "
        f"{noise_in_words(found.inputs)}"
    )


def in_numbers(phases: Sequence[Phase]) -> str:
    """Return the number of phases of each kind, e.g. ``4 sinusoids, 1 step``."""
    kinds = Counter(map(kind, phases))
    return ", ".join(f"{count} {name}{'s' * (count > 1)}" for name, count in kinds.items())


def kind(phase: Phase) -> str:
    """Return the kind of a phase: sinusoid, ramp or step."""
    if phase.left.harmonics:
        return "sinusoid"
    return "ramp" if phase.left.slope_Nm_per_s else "step"


def shown_unit(instrument: Instrument) -> tuple[float, str]:
    """Return the factor and the unit with which what is held is shown."""
    return (1e9, "nN m") if instrument.has_jaws else (1.0, instrument.controlled.unit)


def percent(bound: float) -> str:
    """Return a relative bound as text."""
    return "none" if bound > NO_BOUND else f"{100 * bound:.2g} %"
