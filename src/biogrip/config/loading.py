"""From config files to checked blocks, or to messages that name file, line and key.

A config is laid over the defaults of every trace. Blocks that several cases share are merged into
each before it is checked.
"""

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import fields
from difflib import get_close_matches
from functools import reduce
from pathlib import Path
from typing import Any, TypeVar

from biogrip.config.messages import checked, with_numbers
from biogrip.config.source import KeyPath, Source, dotted, overlaid, place, read_config, read_source
from biogrip.config.trace_blocks import IntervalBlock
from biogrip.errors import BiogripError
from biogrip.fit.problem import GeneRange, SearchRange
from biogrip.keys import Complaint, built

T = TypeVar("T")

# Most complaints in a message.
_SHOWN = 6
# Likeness from which a name is a key with a mistake, and not another key.
_MISSPELT = 0.8


def trace_defaults() -> Path:
    """Return the config file of what every trace takes unless it is told otherwise."""
    return Path(__file__).with_name("defaults.yaml")


def default_ranges() -> dict[str, GeneRange]:
    """Return the search ranges that every trace takes."""
    return dict(vars(built(SearchRange, read_config(trace_defaults())["search_range"])))


def read_configs(files: Iterable[Path]) -> dict[str, Any]:
    """Read config files and merge them, the later over the earlier, see `read_config`."""
    return reduce(overlaid, map(read_config, files), {})


def load(
    kind: Callable[..., T],
    config: Mapping[str, Any],
    sources: Sequence[Source],
    shared: Collection[str] = (),
) -> T:
    """Check and type a merged config, whose keys came from some sources.

    `shared` are blocks that are merged into each of its ``cases``. A `BiogripError` names file,
    line and key of the first few complaints, with what was found and what is allowed.
    """
    typed, complaints = checked(kind, _fill_in(with_numbers(kind, config), shared))
    refuse(complaints, sources, shared)
    assert typed is not None
    return typed


def refuse(
    complaints: Iterable[Complaint], sources: Sequence[Source], shared: Collection[str] = ()
) -> None:
    """Raise a `BiogripError` of complaints, if there are any."""
    messages: dict[str, None] = {}
    for path, text in complaints:
        # A complaint in a block that cases inherit is reported once, not once per case.
        origin = _origin(path, sources, shared)
        messages[f"{place(origin, sources)}: {dotted(origin)}: {text}"] = None
    if messages:
        shown = [*messages][:_SHOWN]
        more = [f"... and {len(messages) - _SHOWN} more."] if len(messages) > _SHOWN else []
        raise BiogripError("\n".join([*shown, *more]))


def read_config_of(kind: Any, files: Sequence[Path]) -> tuple[dict[str, Any], list[str]]:
    """Read config files, and return the keys that a kind of block has, and a note on each other.

    These may be of a study; one that is nearly a key of the block stays, to be refused.
    """
    config, sources, notes = read_configs(files), [*map(read_source, files)], list[str]()
    kinds: dict[tuple[str, ...], Any] = {(): kind, ("identifiability",): IntervalBlock}
    for above, block_kind in kinds.items():
        block: Any = config.get(above[0]) if above else config
        known = [field.name for field in fields(block_kind)]
        for name in [*block] if isinstance(block, dict) else ():
            if not get_close_matches(name, known, n=1, cutoff=_MISSPELT):
                path = (*above, name)
                notes.append(f"{place(path, sources)}: {dotted(path)}: is not used here.")
                del block[name]
    return config, notes


def _origin(path: KeyPath, sources: Sequence[Source], shared: Collection[str]) -> KeyPath:
    """Return the path of the shared key that a case inherits, or the path itself."""
    if len(path) < 3 or path[0] != "cases" or path[2] not in shared:
        return path
    for length in range(len(path), 2, -1):
        if any(path[:length] in lines for _, lines in sources):
            return path
        if any(path[2:length] in lines for _, lines in sources):
            break
    return path[2:]


def _fill_in(config: Mapping[str, Any], shared: Collection[str]) -> Mapping[str, Any]:
    """Merge shared blocks into every case; drop cases set to nothing."""
    if not shared or not isinstance(cases := config.get("cases"), dict):
        return config
    blocks = {name: config[name] for name in shared if name in config}
    filled = {name: overlaid(blocks, case) for name, case in cases.items() if case is not None}
    return {**config, "cases": filled}
