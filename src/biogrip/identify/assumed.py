"""Record of all that an identification assumes, so that it can be repeated."""

from collections.abc import Mapping, Sequence
from importlib.metadata import version
from typing import Any

from biogrip.fit.case_problem import CaseProblem
from biogrip.keys import plain
from biogrip.study.study import Case


def assumed(case: Case, tried: Sequence[str]) -> dict[str, Any]:
    """Return what an identification relies on, as plain data: its model, and a config.

    Parameters
    ----------
    case
        The case that the trace was identified as.
    tried
        Names of the sample models that were tried.
    """
    blocks = ["instrument", "protocol", "search_range", "measurement", "models", "least_squares"]
    blocks += ["gripper"] if case.instrument.has_jaws else []
    return {
        "model": case.sample.candidate,
        **{name: plain(getattr(case.block, name)) for name in blocks},
        **({"actuator": plain(case.actuator)} if case.instrument.has_jaws else {}),
        "fixed": case.fixed,
        "identifiability": {"confidence": case.confidence},
        "model_selection": {"models": list(tried)},
        "study_seed": case.study.study_seed,
    }


def gripper_in_limits(case_problem: CaseProblem) -> str:
    """Return a sentence on the part that the gripper's uncertainty has in the limits."""
    if not case_problem.instrument.has_jaws:
        controlled = case_problem.instrument.controlled.name
        return f"Limits are statistical only: the {controlled} is taken as exact."
    if not case_problem.uncertain_keys:
        return "Limits are statistical only: the gripper is taken as exact."
    keys = ", ".join(key.removesuffix(".share") for key in case_problem.uncertain_keys)
    return f"Limits include uncertainties of the gripper: {keys}."


def by_default(given: Mapping[str, Any]) -> list[str]:
    """Return which of ``gripper`` and ``protocol`` the user's blocks omit, so that defaults hold.

    Uncertainties alone are no gripper.
    """
    blocks = ("gripper", "protocol")
    return [name for name in blocks if not set(given.get(name) or ()) - {"uncertainty"}]


def names_models(given: Mapping[str, Any]) -> bool:
    """Return True if blocks of a config name the models to try (``model_selection.models``)."""
    return "models" in (given.get("model_selection") or {})


def versions() -> dict[str, str]:
    """Return the versions of biogrip, NumPy and SciPy."""
    return {name: version(name) for name in ("biogrip", "numpy", "scipy")}
