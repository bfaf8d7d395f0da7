"""Fits of earlier recorded traces, as prior information for the next experiment."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from biogrip.design.earlier_traces import Earlier, estimate_from_traces
from biogrip.design.replicates import compute_common_noise, joint_problem
from biogrip.design.settings import noise_key
from biogrip.errors import BiogripError
from biogrip.experiment.random_streams import stream
from biogrip.identify.answer import Identification, silent
from biogrip.identify.identifier import best_fit
from biogrip.identify.problem import Problem
from biogrip.instrument.instrument import Instrument
from biogrip.own_traces.read_as import ReadAs
from biogrip.study.design_inputs import plausible_ends
from biogrip.study.study import Case
from biogrip.study.trace_file import trace_file_problem

# Misfit in units of the noise above which a trace counts as one of another sample.
_UNLIKE = 2.0


@dataclass(frozen=True)
class Recorded:
    """A recorded trace, with the case that describes how it was recorded."""

    case: Case
    """Case with the trace's protocol and gripper."""
    file: Path
    """CSV file."""


def estimate_from_recordings(
    traces: Sequence[Recorded], read_as: ReadAs, study_seed: int
) -> Earlier:
    """Fit the traces of one sample jointly, adding one after another.

    Search range, least squares and the block `design` are those of the first trace's case. Noise is
    assumed independent, and as in that block if the options do not say otherwise; readings with
    standard deviations of their own have weights accordingly.

    Raises
    ------
    BiogripError
        With the option, or file and line, if a trace cannot be used or contradicts the configs.
    """
    case = traces[0].case
    block = case.block.design
    assert block is not None
    read_as.check()
    if read_as.fit_start:
        raise BiogripError("--start: found fit, allowed with --after is a time.")
    _check_reading(read_as, case.instrument)
    given = [_make_problem(each, read_as, block.noise_level) for each in traces]
    problems, levels = [problem for problem, _ in given], [level for _, level in given]
    samples = [problem.residuals.samples for problem in problems]
    rng = stream(study_seed, case.name, 0, "after")

    def identify(problem: Problem) -> Identification:
        return best_fit(problem, case.method("least_squares"), rng, silent)

    earlier, ends = None, plausible_ends(case)
    unit = f" {case.instrument.read.unit}".rstrip()
    for count, recorded in enumerate(traces, 1):
        joint = joint_problem(problems[:count], levels[:count])
        noise_rad = compute_common_noise(samples[:count], levels[:count])
        earlier = estimate_from_traces(
            joint, noise_rad, identify, ends, block.plausible_samples, rng, earlier
        )
        if earlier.misfit_rad > _UNLIKE * noise_rad:
            raise BiogripError(
                f"--after: {recorded.file}: found {earlier.misfit_rad:.3g}{unit} that the best fit "
                f"leaves, allowed is at most {_UNLIKE:g} times the noise of {noise_rad:.3g}{unit} "
                f"(--noise, --noise-share or --sd, else design.{noise_key(case.instrument)}): "
                "is it of this sample, "
                "and was it recorded as the configs say?"
            )
    assert earlier is not None
    return earlier


def _check_reading(read_as: ReadAs, instrument: Instrument) -> None:
    """Refuse options of an instrument or a protocol other than those of the config."""
    read = instrument.read.name
    if read_as.reading and read_as.reading[0] != read:
        raise BiogripError(
            f"--reading: found '{read_as.reading[0]}', allowed is {read}, as in the config."
        )
    if read_as.hold is not None:
        raise BiogripError("--hold: does not go with --after; allowed is a protocol in the config.")


def _make_problem(recorded: Recorded, read_as: ReadAs, usual_rad: float) -> tuple[Problem, float]:
    """Return the problem of a trace and its noise in rad, which is as usual if nothing is given."""
    if wrong := trace_file_problem(recorded.file):
        raise BiogripError(f"--after: {wrong}")
    problem = recorded.case.problem
    share = read_as.noise_share or problem.noise_share
    case_problem = replace(
        problem,
        noise_rad=read_as.noise_rad or (None if share else usual_rad),
        noise_share=share,
        offset=problem.offset if read_as.offset is None else read_as.offset,
        drift=problem.drift if read_as.drift is None else read_as.drift,
    )
    trace = read_as.read(recorded.file, recorded.case.gripper, case_problem)
    case_problem = case_problem.weighted(trace.sd_rad)
    assert case_problem.noise_rad is not None
    return case_problem.of(trace.time_s, trace.rotation_rad[0]), case_problem.noise_rad
