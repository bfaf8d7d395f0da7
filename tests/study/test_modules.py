import subprocess
import sys
from pathlib import Path

import pytest

from biogrip.study.modules import source_files


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
