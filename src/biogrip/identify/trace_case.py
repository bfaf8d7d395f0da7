"""A recorded trace and the case that it is identified as."""

from dataclasses import dataclass

from biogrip.arrays import Array
from biogrip.fit.case_problem import CaseProblem
from biogrip.records.traces import Measurements
from biogrip.study.study import Case


@dataclass(frozen=True)
class TraceCase:
    """A recorded trace and the case that it is identified as."""

    case: Case
    """The case, with the search ranges of this trace."""
    recorded: Measurements
    """The trace."""
    problem: CaseProblem
    """Assumptions of its fit, with the standard deviations of its readings if they are known."""
    names_models: bool
    """True if the config names the sample models to compare."""

    @property
    def readings(self) -> tuple[Array, Array]:
        """Times and rotations, (n_samples,) each."""
        return self.recorded.time_s, self.recorded.rotation_rad[0]

    def is_like(self, other: "TraceCase") -> bool:
        """Return True if the model, the budget of fits and the confidence are the same."""
        own, others = self.case, other.case
        return (
            self.problem.searched == other.problem.searched
            and own.confidence == others.confidence
            and own.least_squares == others.least_squares
        )
