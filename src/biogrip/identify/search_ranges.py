"""Search ranges that follow from a recorded trace."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from biogrip.arrays import Array
from biogrip.fit.case_problem import CaseProblem
from biogrip.fit.genome import GeneRange
from biogrip.physics.protocol import largest_load
from biogrip.physics.whitening import estimate_noise
from biogrip.records.traces import Measurements
from biogrip.study.study import Case

# Largest ratio of trace to noise that widens a range, and a margin, for scales are rough.
_CLEAREST, _MARGIN = 1e5, 10.0
_LEAST, _MOST = -16, 18


def with_own_ranges(case: Case, recorded: Measurements, given: Mapping[str, Any]) -> Case:
    """Return a case whose search ranges follow from its trace, where the user gives none."""
    case_problem = case.problem.weighted(recorded.sd_rad)
    found = ranges_of(case_problem, recorded.time_s, recorded.rotation_rad[0])
    own = given.get("search_range", {})
    chosen = {name: genes for name, genes in found.items() if name not in own}
    search_range = replace(case.block.search_range, **chosen)
    return replace(case, block=replace(case.block, search_range=search_range))


def ranges_of(
    case_problem: CaseProblem, time_s: Array, rotation_rad: Array
) -> dict[str, GeneRange]:
    """Compute search ranges of springs and dampers from the scales of a trace.

    Torque over rotation is the scale of stiffness at the jaws, and load over deformation that of
    other instruments. A spring changes the trace by less than its noise if it is softer by more
    than the ratio of the trace to the noise, over all readings, or if it turns by less than what
    all readings together resolve. A damper is as stiff as c/t after a time t, which is between the
    shortest sampling interval and the duration; so is a springpot, with a power of t.

    Parameters
    ----------
    case_problem
        Gripper, protocol, and the noise if it is known.
    time_s, rotation_rad : (n_samples,)
        The trace.

    Returns
    -------
    dict
        Ranges by name, without that of exponents.
    """
    turned = rotation_rad - np.mean(rotation_rad) if case_problem.offset else rotation_rad
    noise_rad = case_problem.sd_rad
    if noise_rad is None:
        own = case_problem.noise_rad or estimate_noise(rotation_rad)
        noise_rad = np.full(len(turned), own)
    turn_rad = float(np.max(np.abs(turned)))
    ratios = np.linalg.norm([turned / noise_rad, turn_rad / noise_rad], axis=1)
    softer, stiffer = _MARGIN * np.clip(ratios, 1.0, _CLEAREST)
    torque_Nm = abs(largest_load(case_problem.phases))
    stiffness = torque_Nm / (case_problem.gripper.lever_m**2 * turn_rad)
    if case_problem.instrument.deforms:
        stiffness = turn_rad / torque_Nm
    low, high = stiffness / softer, stiffness * stiffer
    short_s, long_s = float(np.min(np.diff(time_s))), float(np.ptp(time_s))
    dampers = _decades(low * short_s, high * long_s)
    springpots = _decades(low * min(short_s, 1.0), high * max(long_s, 1.0))
    return {"k": springpots, "k_p": _decades(low, high), "c": dampers, "c_p": dampers}


def _decades(low: float, high: float) -> GeneRange:
    ends = int(np.floor(np.log10(low))), int(np.ceil(np.log10(high)))
    least, most = (min(max(end, _LEAST), _MOST) for end in ends)
    return GeneRange((least, most), (1, 9))
