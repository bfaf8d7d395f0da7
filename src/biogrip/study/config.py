"""The study as its config describes it."""

from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from biogrip.sample import SampleModel
from biogrip.study import build
from biogrip.study.source import overlaid, read_config, read_places
from biogrip.study.sweeps import Sweep, point_blocks, sweeps_of
from biogrip.study.validation import OVERRIDABLE, check, with_numbers


@dataclass(frozen=True)
class Case:
    """One sample of the study.

    Parameters
    ----------
    name, title
        Name in files; name in print.
    model
        Constitutive model.
    parameters
        True values by name, SI units; nobody knows them of a recorded trace.
    blocks
        The case's own version of every block of `OVERRIDABLE`, as in the config.
    branches
        Number of Maxwell branches of a generalized model.
    size_m
        Diameter of the sample, if it is given.
    fixed
        Parameters that are not identified, by name.
    assumed_gripper
        ``"calibrated"``, or the keys in which the gripper that the
        identification believes in differs from the true one.
    published
        What the paper reports, or nothing.
    """

    name: str
    title: str
    model: SampleModel
    parameters: dict[str, float]
    blocks: dict[str, dict[str, Any]]
    branches: int
    size_m: float | None
    fixed: dict[str, float]
    assumed_gripper: str | dict[str, Any]
    published: dict[str, Any]

    @property
    def recorded(self) -> bool:
        """Whether its trace was recorded, not simulated."""
        return "file" in self.blocks["measurement"]


@dataclass(frozen=True)
class Study:
    """A checked study.

    Parameters
    ----------
    config
        The whole config, for tables that show it.
    cases
        By name.
    sweeps
        By name.
    points
        The cases that the points of the sweeps are, by name.
    """

    config: dict[str, Any]
    cases: dict[str, Case]
    sweeps: dict[str, Sweep]
    points: dict[str, Case]

    @property
    def seeds(self) -> int:
        """Number of noisy traces a case."""
        return int(self.config["seeds"])

    @property
    def methods(self) -> list[str]:
        """Identifiers; tables and figures that show one show the first."""
        return list(self.config["methods"])

    @property
    def batch_size(self) -> int | None:
        """Number of seeds a job, if the study says."""
        size: int | None = self.config.get("batch_size")
        return size


def read_configs(files: Iterable[Path]) -> dict[str, Any]:
    """Read config files and lay each over the ones before.

    Raises
    ------
    BiogripError
        With file and line, if one cannot be used whatever its keys mean.
    """
    merged: dict[str, Any] = {}
    for file in files:
        merged = overlaid(merged, read_config(file))
    return merged


def load_study(
    config: Mapping[str, Any],
    files: Sequence[str | Path],
    command_line: Iterable[Hashable] = (),
    *,
    for_workflow: bool = True,
) -> Study:
    """Check and type a merged config.

    Parameters
    ----------
    config
        The config in force: all files, the later laid over the earlier.
    files
        The files it came from, to name lines in messages.
    command_line
        Top-level keys that were set on the command line.
    for_workflow
        Whether it is to be run by the workflow, which names of files must suit.

    Raises
    ------
    BiogripError
        If anything in the config cannot be used.
    """
    places = read_places(files, command_line)
    complete = _fill_in(with_numbers(config))
    check(complete, places, for_workflow=for_workflow)
    cases = {name: _case(name, block) for name, block in complete["cases"].items()}
    points = {name: _case(name, block) for name, block in point_blocks(complete).items()}
    return Study(complete, cases, sweeps_of(complete), points)


def _fill_in(config: dict[str, Any]) -> dict[str, Any]:
    """Give every case the study's blocks under its own; drop cases set to nothing."""
    cases = config.get("cases")
    if not isinstance(cases, dict):
        return config
    filled = {}
    for name, case in cases.items():
        if case is None:
            continue
        if isinstance(case, dict):
            case = dict(case)
            for block in OVERRIDABLE:
                if isinstance(config.get(block), dict):
                    case[block] = overlaid(config[block], case.get(block, {}))
        filled[name] = case
    return {**config, "cases": filled}


def _case(name: str, block: dict[str, Any]) -> Case:
    sample = block["sample"]
    model = build.sample_model(sample)
    return Case(
        name=name,
        title=block.get("title", name),
        model=model,
        parameters={symbol: float(sample[symbol]) for symbol in model.names if symbol in sample},
        blocks={key: block[key] for key in OVERRIDABLE},
        branches=sample.get("branches", 1),
        size_m=sample.get("size_m"),
        fixed={symbol: float(value) for symbol, value in block.get("fixed", {}).items()},
        assumed_gripper=block.get("assumed_gripper", {}),
        published=block.get("published", {}),
    )
