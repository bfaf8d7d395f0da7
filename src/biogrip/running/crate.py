"""The command ``biogrip crate``: a finished study as a Workflow Run RO-Crate.

The profile is https://w3id.org/ro/wfrun/workflow/0.5. Recorded sizes and hashes of files are
included.
"""

import platform
import re
from collections.abc import Iterator
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

from biogrip import __version__
from biogrip.digits import counted
from biogrip.files import atomic_write
from biogrip.running.manifest import Manifest
from biogrip.running.provenance import finished
from biogrip.running.records import Record
from biogrip.running.resolved import NAME as STUDY
from biogrip.running.resolved import read_study
from biogrip.study.defaults import default_config, snakefile

if TYPE_CHECKING:
    from rocrate.model.entity import Entity
    from rocrate.rocrate import ROCrate

_PROFILES = {
    "https://w3id.org/ro/wfrun/process/0.5": ("Process Run Crate", "0.5"),
    "https://w3id.org/ro/wfrun/workflow/0.5": ("Workflow Run Crate", "0.5"),
    "https://w3id.org/workflowhub/workflow-ro-crate/1.0": ("Workflow RO-Crate", "1.0"),
}
_TERMS = {"sha256": "https://w3id.org/ro/terms/workflow-run#sha256"}
"""Term of the profile that the context of RO-Crate 1.1 lacks."""

_FORMATS = {
    ".csv": "text/csv",
    ".html": "text/html",
    ".json": "application/json",
    ".md": "text/markdown",
    ".parquet": "application/vnd.apache.parquet",
    ".pdf": "application/pdf",
    ".png": "image/png",
    ".rst": "text/x-rst",
    ".tex": "application/x-tex",
    ".yaml": "application/yaml",
}


def write_crate(results: Path, output: Path) -> str:
    """Pack a finished study as an RO-Crate.

    Parameters
    ----------
    results
        Results folder of the study.
    output
        ZIP file to write.

    Returns
    -------
    str
        Summary of what was packed.

    Raises
    ------
    BiogripError
        If the study is not finished, or a result was edited or belongs to another study.
    """
    from rocrate.rocrate import ROCrate

    study = read_study(results)
    manifest = Manifest(results)
    names = [STUDY, *finished(results, manifest)]
    records = {name: manifest.last(name) for name in names}
    times = [_time(records[name]) for name in names]
    begun, ended = min(times), max(times)

    crate = ROCrate(version="1.1")
    crate.metadata.extra_terms.update(_TERMS)
    crate.name = f"biogrip: {', '.join(study.cases)}"
    crate.description = (
        "How well a MEMS microgripper identifies the viscoelastic parameters of a cell: "
        "the workflow, the study that it was run on, and what came out."
    )
    # License of the workflow; that of the user's traces is unknown.
    crate.license = "https://spdx.org/licenses/MIT"
    crate.datePublished = ended
    workflow = _workflow(crate)
    for uri, (name, version) in _PROFILES.items():
        profile = _described(crate, uri, "CreativeWork", name=name, version=version)
        crate.root_dataset.append_to("conformsTo", profile)

    given = _added(crate, results / STUDY, f"results/{STUDY}", records[STUDY])
    slot = crate.add_formal_parameter("study", "File", "#study", valueRequired=True)
    slot["workExample"] = given
    given["exampleOfWork"] = slot
    workflow["input"] = slot
    traces = [
        _added(crate, Path(study.case(name).file), f"traces/{name}.csv") for name in study.recorded
    ]
    made = [_added(crate, results / n, f"results/{n}", records[n]) for n in names[1:]]
    action = crate.add_action(
        workflow,
        "#run",
        object=[given, *traces],
        result=made,
        properties={
            "name": "Run of the study",
            "description": "From the first file that is on record to the last, pauses included.",
            "startTime": begun,
            "endTime": ended,
            "actionStatus": {"@id": "http://schema.org/CompletedActionStatus"},
        },
    )
    crate.root_dataset.append_to("mentions", action)
    with atomic_write(output) as scratch:
        crate.write_zip(scratch)
    return f"{counted(len(made), 'result')} of {results} packed in {output}."


def _time(record: Record) -> str:
    """Return the time at which a file was recorded, ISO 8601."""
    return datetime.fromtimestamp(record.recorded_ns / 1e9, UTC).isoformat(timespec="seconds")


def _workflow(crate: "ROCrate") -> "Entity":
    """Add the Snakefile, its parts, and the software that runs it."""
    top = snakefile().parent
    workflow = crate.add_workflow(
        snakefile(),
        "Snakefile",
        main=True,
        lang="snakemake",
        lang_version=metadata.version("snakemake"),
        properties={"name": "biogrip", "version": __version__},
        record_size=True,
    )
    parts = [default_config(), *sorted((top / "workflow").rglob("*.*"))]
    workflow["hasPart"] = [
        _added(crate, part, part.relative_to(top).as_posix()) for part in parts if part.is_file()
    ]
    workflow["softwareRequirements"] = [
        _described(crate, uri, "SoftwareApplication", name=name, softwareVersion=version)
        for uri, name, version in _software()
    ]
    return workflow


def _software() -> Iterator[tuple[str, str, str]]:
    """Yield identifier, name and version of required software in this environment."""
    yield "https://www.python.org/", "Python", platform.python_version()
    yield f"pkg:pypi/biogrip@{__version__}", "biogrip", __version__
    for needed in metadata.requires("biogrip") or []:
        if "extra ==" not in needed:
            name = re.split(r"[^\w.-]", needed)[0]
            version = metadata.version(name)
            yield f"pkg:pypi/{name}@{version}", name, version


def _added(crate: "ROCrate", file: Path, name: str, record: Record | None = None) -> "Entity":
    """Add a file, with size and hash from its record if there is one."""
    described: dict[str, Any] = {"name": name}
    if file.suffix in _FORMATS:
        described["encodingFormat"] = _FORMATS[file.suffix]
    if record is not None:
        described |= {
            "contentSize": str(record.size),
            "sha256": record.sha256,
            "dateModified": _time(record),
        }
    return crate.add_file(file, name, properties=described, record_size=record is None)


def _described(crate: "ROCrate", uri: str, kind: str, **properties: str) -> "Entity":
    from rocrate.model.contextentity import ContextEntity

    return crate.add(ContextEntity(crate, uri, properties={"@type": kind, **properties}))
