"""Loading of config files into a checked study."""

from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from biogrip.study.case_blocks import OVERRIDABLE
from biogrip.study.config import StudyConfig
from biogrip.study.schema import schema_of
from biogrip.study.source import KeyPath, overlaid, read_config, read_places
from biogrip.study.study import Study
from biogrip.study.validation import checked_study


def read_configs(files: Iterable[Path]) -> dict[str, Any]:
    """Read config files and merge them, the later over the earlier.

    Raises
    ------
    BiogripError
        With file and line, if a file is no valid config at all, see `read_config`.
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
    over: Sequence[tuple[str, Mapping[KeyPath, int]]] = (),
) -> Study:
    """Check and type a merged config; the files it came from give the line numbers in messages.

    Some top-level keys may be of the command line, and some keys of a row in a table of traces:
    `over` has the table, and the row's line by key. For a workflow, paths of traces are refused
    that Snakemake would read as wildcards.

    Raises
    ------
    BiogripError
        If anything in the config cannot be used.
    """
    places = replace(read_places(files, command_line), over=tuple(over))
    numbered = schema_of(StudyConfig).with_numbers(config)
    return Study(checked_study(_fill_in(numbered), places, for_workflow=for_workflow))


def _fill_in(config: Mapping[str, Any]) -> Mapping[str, Any]:
    """Merge the study's blocks into every case; drop cases set to nothing."""
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
                elif block in config:
                    case.setdefault(block, config[block])
        filled[name] = case
    return {**config, "cases": filled}
