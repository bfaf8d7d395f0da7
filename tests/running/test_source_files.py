import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from biogrip.study.modules import fingerprint, source_files


def stems(module: str) -> set[str]:
    root = Path(source_files(module)[0])
    while root.name != "biogrip":
        root = root.parent
    return {str(Path(file).relative_to(root)) for file in source_files(module)}


def test_a_stage_names_what_it_imports_and_nothing_else() -> None:
    files = stems("biogrip.stages.measurement")
    assert {"stages/measurement.py", "measurement.py", "random_streams.py", "traces.py"} <= files
    assert not {file for file in files if "identify" in file or "response" in file}


@pytest.mark.parametrize(
    "module",
    [
        *(f"biogrip.stages.{s}" for s in ("target", "measurement", "identification", "collection")),
        "biogrip.tables.evidence",
        "biogrip.stages.robustness",
        "biogrip.figures.fit",
        "biogrip.figures.robustness",
    ],
)
def test_no_module_that_python_loads_is_forgotten(module: str) -> None:
    """What an interpreter really imports is the independent count."""
    code = (
        f"import {module}, sys; "
        "print(*(m.__file__ for n, m in sys.modules.items() if n.startswith('biogrip')), sep='\\n')"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    # Packages on the way are loaded too, but hold nothing that could matter.
    loaded = {
        file
        for file in run.stdout.split()
        if not file.endswith("__init__.py") or "import" in Path(file).read_text()
    }
    assert loaded <= set(source_files(module))


def loaded_by(statement: str) -> set[str]:
    code = f"{statement}; import sys; print(*sys.modules)"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(run.stdout.split())


def test_what_starts_often_loads_no_library_that_it_does_not_use() -> None:
    """Start-up is what a job costs beyond its work."""
    heavy = {"matplotlib", "pandas", "scipy", "snakemake", "jinja2"}
    identification = "import biogrip.stages.identification, biogrip.identify.genetic"
    assert not heavy & loaded_by(identification)
    assert not heavy & loaded_by("import biogrip.stages.measurement, biogrip.stages.collection")
    assert not {*heavy, "numpy", "pyarrow"} & loaded_by("import biogrip.cli; biogrip.cli._parser()")


def test_a_fingerprint_changes_with_what_a_module_imports(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = Path(source_files("biogrip.stages.export")[0]).parent
    while package.name != "biogrip":
        package = package.parent
    shutil.copytree(package, tmp_path / "biogrip")
    of_original = fingerprint.__wrapped__("biogrip.stages.export")
    monkeypatch.setattr("biogrip.study.modules._PACKAGE", tmp_path / "biogrip")
    assert fingerprint.__wrapped__("biogrip.stages.export") == of_original
    for file, same in (("gripper.py", True), ("traces.py", False)):
        with (tmp_path / "biogrip" / file).open("a") as stream:
            stream.write("# edited\n")
        assert (fingerprint.__wrapped__("biogrip.stages.export") == of_original) is same
