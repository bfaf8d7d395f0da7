"""From config files to a checked study, or to messages that name file, line and key.

The study's blocks are merged into every case before it is checked. Points of sweeps, and cases
under other readings of the paper, are checked as if they were cases of the config.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from biogrip.errors import BiogripError
from biogrip.keys import Complaint, below, plain
from biogrip.study.case_blocks import OVERRIDABLE, CaseBlock
from biogrip.study.config import StudyConfig
from biogrip.study.messages import checked, schema_of
from biogrip.study.source import (
    KeyPath,
    Source,
    default_config,
    dotted,
    overlaid,
    place,
    read_config,
    read_source,
    values_in,
)
from biogrip.study.study import Study
from biogrip.study.sweeps import list_points, point_blocks

_SHOWN = 6


def read_configs(files: Iterable[Path]) -> dict[str, Any]:
    """Read config files and merge them, the later over the earlier, see `read_config`."""
    merged: dict[str, Any] = {}
    for file in files:
        merged = overlaid(merged, read_config(file))
    return merged


def load_given_study(given: Mapping[str, Any], files: Sequence[Path]) -> Study:
    """Lay a config over the default study's, and check and type it, see `load_study`.

    What is not in the files as it is in the config, was given on Snakemake's command line.
    """
    read = dict(values_in(read_configs(files)))
    typed = [path for path, value in values_in(given) if read.get(path) != value]
    over = ("command line, --config", dict.fromkeys(typed))
    config = overlaid(read_config(default_config()), given)
    return load_study(config, [default_config(), *files], [over])


def load_study(
    config: Mapping[str, Any], files: Iterable[Path], over: Iterable[Source] = ()
) -> Study:
    """Check and type a merged config, which came from files, and from what is `over` them.

    A `BiogripError` names file, line and key of the first few complaints, with what was found and
    what is allowed.
    """
    sources = [*map(read_source, files), *over]
    study, complaints = checked(StudyConfig, _fill_in(schema_of(StudyConfig).with_numbers(config)))
    _refuse(complaints, sources)
    assert study is not None
    study = replace(study, cases={it: study.cases[it] for it in study.only or study.cases})
    _refuse([*_point_complaints(study), *_reading_complaints(study)], sources)
    return Study(study)


def _refuse(complaints: Iterable[Complaint], sources: Sequence[Source]) -> None:
    """Raise an error that lists the first few complaints, if there are any."""
    found: dict[str, None] = {}
    for path, text in complaints:
        # A complaint in a block that cases inherit is reported once, not once per case.
        origin = _origin(path, sources)
        found[f"{place(origin, sources)}: {dotted(origin)}: {text}"] = None
    if found:
        shown = [*found][:_SHOWN]
        more = [f"... and {len(found) - _SHOWN} more."] if len(found) > _SHOWN else []
        raise BiogripError("\n".join(["The study's configuration cannot be used.", *shown, *more]))


def _origin(path: KeyPath, sources: Sequence[Source]) -> KeyPath:
    """Return the path of the study-wide key that a case inherits, or the path itself."""
    if len(path) < 3 or path[0] != "cases" or path[2] not in OVERRIDABLE:
        return path
    for length in range(len(path), 2, -1):
        if any(path[:length] in lines for _, lines in sources):
            return path
        if any(path[2:length] in lines for _, lines in sources):
            break
    return path[2:]


def _point_complaints(study: StudyConfig) -> Iterator[Complaint]:
    """Check every point of every sweep as if it were a case of the config."""
    blocks = point_blocks(study.sweeps, study.cases)
    for name, point in list_points(study.sweeps):
        case, found = checked(CaseBlock, blocks[point.name])
        for complaint in case.comb_complaints(study.actuator) if case else found:
            yield from below(("sweeps", name), [study.sweeps[name].placed(point, complaint)])


def _reading_complaints(study: StudyConfig) -> Iterator[Complaint]:
    """Check every simulated case under every reading as if it were a case of the config."""
    for name, block in study.readings.items():
        for case in study.cases.values():
            if not case.recorded:
                complaints = checked(CaseBlock, overlaid(plain(case), block.changes))[1]
                yield from below(("readings", name, "changes"), complaints)


def _fill_in(config: Mapping[str, Any]) -> Mapping[str, Any]:
    """Merge the study's blocks into every case; drop cases set to nothing."""
    if not isinstance(cases := config.get("cases"), dict):
        return config
    shared = {name: config[name] for name in OVERRIDABLE if name in config}
    filled = {name: overlaid(shared, case) for name, case in cases.items() if case is not None}
    return {**config, "cases": filled}
