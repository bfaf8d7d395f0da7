"""Loading of config files into a checked study."""

from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from biogrip.errors import BiogripError
from biogrip.study.case_blocks import OVERRIDABLE
from biogrip.study.config import StudyConfig
from biogrip.study.measurement_block import OF_FILE
from biogrip.study.named_blocks import KEY as BLOCKS
from biogrip.study.named_blocks import read_named_blocks
from biogrip.study.schema import schema_of
from biogrip.study.sheet import read_sheet
from biogrip.study.sheet_text import FILE
from biogrip.study.source import ConfigFiles, KeyPath, overlaid, read_config, read_places
from biogrip.study.study import Study
from biogrip.study.traces_block import KEY as TRACES
from biogrip.study.traces_block import READ
from biogrip.study.validation import brackets_problem, checked_study, measurement_problem
from biogrip.traces.columns import place as place_of

NOT_OF_TRACES = (TRACES, BLOCKS, "cases", "only", "seeds", "batch_size", "sweeps")
"""Keys that say nothing of recorded traces."""


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

    Some top-level keys may be of the command line, and some keys of a sheet's row: `over` has its
    sheet, and its line by key. For a workflow, paths of traces are refused that
    Snakemake would read as wildcards.

    Raises
    ------
    BiogripError
        If anything in the config cannot be used.
    """
    places = replace(read_places(files, command_line), over=tuple(over))
    numbered = schema_of(StudyConfig).with_numbers(config)
    complete = _fill_in(_with_rows(numbered, files, places))
    return Study(checked_study(complete, places, for_workflow=for_workflow))


def _with_rows(
    config: Mapping[str, Any], files: Sequence[str | Path], places: ConfigFiles
) -> Mapping[str, Any]:
    """Return a config with the rows of its sheet of traces, if it has one.

    Rows are laid over what files and command line give beyond the first file, the default study.
    Its cases are left out unless some are given, too.
    """
    block = config.get(TRACES)
    block = {"sheet": block} if isinstance(block, str) else block
    if not isinstance(block, Mapping) or not isinstance(block.get("sheet"), str):
        return config
    for name in set(block) & set(READ):
        place = places.place((TRACES, name))
        raise BiogripError(f"{place}: {TRACES}.{name}: is not for a config; leave it out.")
    own = [Path(file) for file in files[1:]]
    given = read_configs(own)
    given |= {key: config[key] for key in config if key in places.command_line}
    naming = [file for file in own if BLOCKS in read_config(file)]
    blocks = read_named_blocks(naming[-1] if naming else None)
    sheet = read_sheet(Path(block["sheet"]), blocks)
    blocks.refuse_unused(sheet.named)
    for row in sheet.rows:
        if problem := brackets_problem(str(row.file)):
            raise BiogripError(f"{place_of(sheet.path, row.line, FILE)}: {problem}")
    rows = [
        {
            "file": str(row.file),
            "cell": row.cell,
            "line": row.line,
            "factors": dict(row.factors),
            "settings": dict(row.settings),
        }
        for row in sheet.rows
    ]
    kept = {key: value for key, value in given.items() if key not in NOT_OF_TRACES}
    filled = {**config, TRACES: {**block, "rows": rows, "given": kept}}
    if isinstance(measured := config.get("measurement"), Mapping):
        filled["measurement"] = _without_columns(measured, places)
    return filled if "cases" in given else {**filled, "cases": {}, "reconstructed": []}


def _without_columns(measured: Mapping[str, Any], places: ConfigFiles) -> dict[str, Any]:
    """Return a study's ``measurement`` without what is of its traces alone."""
    for key in (key for key in OF_FILE if key in measured):
        if problem := measurement_problem(key, measured[key]):
            place = places.place(("measurement", key))
            raise BiogripError(f"{place}: measurement.{key}: {problem}")
    return {key: value for key, value in measured.items() if key not in OF_FILE}


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
