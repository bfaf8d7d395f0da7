"""Declarations of what a product uses of the config: it can read nothing else."""

from collections.abc import Callable, Iterable, Mapping
from operator import attrgetter
from typing import Any, NoReturn

from biogrip.fit.case_problem import CaseProblem
from biogrip.products.plan import Wildcards
from biogrip.study.study import Case, Study


class Used:
    """Read-only view of a study or a case, with the attributes that a product declares."""

    def __init__(self, values: Mapping[str, object]) -> None:
        vars(self).update(values)

    def __getattr__(self, name: str) -> NoReturn:
        """Refuse what is not declared."""
        declared = ", ".join(vars(self)) or "nothing"
        raise AttributeError(f"{name} is not among what the product uses: {declared}.")

    def __setattr__(self, name: str, value: object) -> NoReturn:
        """Refuse any change."""
        raise AttributeError(f"{name}: a product reads the config, and changes nothing in it.")


def using(names: str = "", **computed: Callable[[Any], object]) -> Callable[[Any], Any]:
    """Return a function that makes the view of a study or a case.

    Names of attributes are separated by spaces, with dots for parts of them, e.g. ``"title
    study.study_seed"``; a part of a mapping is an item. Computed ones are less than those of the
    whole, as functions of it.
    """
    parts: dict[str, list[str]] = {}
    for name in names.split():
        head, _, rest = name.partition(".")
        parts.setdefault(head, []).append(rest)

    def view(whole: Any) -> Any:
        keyed = isinstance(whole, Mapping)
        values = {head: whole[head] if keyed else getattr(whole, head) for head in parts}
        values = {
            head: value if "" in parts[head] else using(" ".join(parts[head]))(value)
            for head, value in values.items()
        }
        values |= {name: compute(whole) for name, compute in computed.items()}
        return values if keyed else Used(values)

    return view


def each(
    cases: Callable[[Study], Iterable[str]], names: str = "", **computed: Callable[[Case], object]
) -> Callable[[Study], dict[str, Any]]:
    """Return a function that makes views of some of a study's cases, by name; see `using`."""
    view = using(names, **computed)
    return lambda study: {name: view(study.case(name)) for name in cases(study)}


Uses = Callable[[Study, Wildcards], Any]
"""Function that makes the view of a job."""


def from_study(names: str = "", **computed: Callable[[Study], object]) -> Uses:
    """Declare what a product uses of the study, see `using`."""
    view = using(names, **computed)
    return lambda study, _: view(study)


NOTHING = from_study()
"""Nothing of the config."""


def from_case(names: str = "", **computed: Callable[[Case], object]) -> Uses:
    """Declare what a product uses of its case, see `using`; names may hold the job's wildcards."""
    return lambda study, job: using(names.format(**job), **computed)(study.case(job["case"]))


every, simulated, gripped, covered, published = (
    attrgetter(name) for name in ("cases", "simulated", "gripped", "covered", "published")
)
"""Names of a study's cases, or of some of them."""


def to_identify(case: Case) -> CaseProblem:
    """Return a case's assumptions without noise model, gripper uncertainty and unused ranges."""
    return case.problem.to_identify()


def searched_for(case: Case) -> CaseProblem:
    """Return a case's assumptions without unused search ranges."""
    return case.problem.searched_for()


def marked(block: str) -> Callable[[Study], tuple[str, ...]]:
    """Return a function that names the reconstructed keys of a block."""
    return lambda study: tuple(
        key for key in study.reconstructed if key == block or key.startswith(f"{block}.")
    )
