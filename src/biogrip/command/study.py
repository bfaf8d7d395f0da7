"""The command ``biogrip study``: the config of a study of traces, as `identify` is asked for them.

The study's page then says of each trace what the command says.
"""

import os
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import yaml

from biogrip.command.files import traces_of
from biogrip.command.options import Setting
from biogrip.command.settings import Asked, read_trace, study_of
from biogrip.errors import BiogripError
from biogrip.files import scratch_path, write_text
from biogrip.identify.prepare import prepare
from biogrip.study.case_blocks import OVERRIDABLE
from biogrip.study.source import default_config, overlaid, snakefile
from biogrip.study.study import read_configs
from biogrip.terminal import visible
from biogrip.traces.columns import trace_file_problem


def write_study(
    files: Sequence[Path],
    config: Path | None = None,
    settings: Sequence[Setting] = (),
    folder: Path | None = None,
) -> None:
    """Write the config of a study of traces into a new folder, and print how it is run.

    Parameters are those of `identify_files`. A `BiogripError` says that the folder exists, or which
    trace, option or key cannot be used; then nothing is written.
    """
    folder = folder or files[0].with_name(f"{files[0].stem}_study")
    if folder.exists() or folder.is_symlink():
        raise BiogripError(f"--output: {folder} exists; allowed is the name of a new folder.")
    if not folder.parent.is_dir():
        raise BiogripError(f"--output: there is no folder {folder.parent}.")
    study: dict[str, Any] = {"methods": ["least_squares"], "only": [], "cases": {}}
    for asked in traces_of(files, config, settings):
        name, own, case = _blocks_of(asked, folder)
        name += f"_{len(study['only']) + 1}" * (name in study["cases"])
        study = overlaid(study, own | {"only": [*study["only"], name], "cases": {name: case}})
    scratch = scratch_path(folder)
    scratch.mkdir()
    write_text(scratch / "study.yaml", yaml.safe_dump(study, sort_keys=False, allow_unicode=True))
    scratch.rename(folder)
    here, rules = Path("Snakefile"), snakefile()
    named = [] if here.is_file() and rules.samefile(here) else ["-s", str(rules)]
    given = ["--directory", str(folder), "--configfile", str(folder / "study.yaml")]
    print(f"Written to {visible(folder / 'study.yaml')}. Run the study, and open its page:\n")
    print(f"  {shlex.join(['snakemake', '-j2', *named, *given])}")
    print(f"  {visible(folder / 'results' / 'report.html')}")


def _blocks_of(asked: Asked, folder: Path) -> tuple[str, dict[str, Any], dict[str, Any]]:
    """Return a trace's name, and what differs from the default study: the study's, the case's."""
    if problem := trace_file_problem(asked.trace):
        raise BiogripError(f"{asked.place}: {problem}")
    recording, case = read_trace(asked)
    if case.record is not None:
        raise BiogripError("--load: a study takes what was held by --hold or --config only.")
    prepare(recording, case.judged_experiment)
    name, merged, _, _ = study_of(asked)
    default = read_configs([default_config()])
    of_case = merged.pop("cases")[name]
    own = {key: value for key, value in merged.items() if default.get(key) != value}
    usual = default["measurement"].items()
    measurement = dict(item for item in own["measurement"].items() if item not in usual)
    measurement["file"] = os.path.relpath(asked.trace, folder)
    of_case |= {key: own.pop(key) for key in [*own] if key in OVERRIDABLE}
    return name, own, of_case | {"measurement": measurement}
