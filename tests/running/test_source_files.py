import ast
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import biogrip
from biogrip.products.source_files import _SAYING, fingerprint, source_files
from tests.helpers.places import EXAMPLE


def stems(module: str) -> set[str]:
    root = Path(source_files(module)[0])
    while root.name != "biogrip":
        root = root.parent
    return {str(Path(file).relative_to(root)) for file in source_files(module)}


def test_a_stage_names_what_it_imports_and_nothing_else() -> None:
    files = stems("biogrip.stages.measurement")
    wanted = {"stages/measurement.py", "records/traces.py"}
    assert wanted | {"experiment/noise.py", "experiment/random_streams.py"} <= files
    assert not {file for file in files if file.startswith(("identify/", "response/"))}


# In the place of what only says what there is to do, something that loads nothing.
STUBS = """
import importlib, importlib.abc, importlib.machinery, sys, types
from unittest.mock import MagicMock
from biogrip.products.source_files import _SAYING

class Stub(types.ModuleType):
    __path__ = []
    def __getattr__(self, name):
        return MagicMock()

class Finder(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    def find_spec(self, name, *_):
        said = any(name == s or name.startswith(f"{s}.") for s in _SAYING)
        return importlib.machinery.ModuleSpec(name, self) if said else None
    def create_module(self, spec):
        return Stub(spec.name)
    def exec_module(self, module):
        pass

before = set(sys.modules)
sys.meta_path.insert(0, Finder())
importlib.import_module(sys.argv[1])
loaded = [m for n, m in sys.modules.items() if n.startswith("biogrip") and n not in before]
print(*(m.__file__ for m in loaded if not isinstance(m, Stub)), sep="\\n")
"""
STAGES = ("target", "measurement", "identification", "identifications", "sweep_points")


@pytest.mark.parametrize(
    "module",
    [
        *(f"biogrip.stages.{s}" for s in STAGES),
        "biogrip.tables.evidence",
        "biogrip.figures.fit",
        "biogrip.figures.robustness",
    ],
)
@pytest.mark.nightly
def test_no_module_that_python_loads_is_forgotten(module: str) -> None:
    """What an interpreter really imports is the independent count."""
    command = [sys.executable, "-c", STUBS, module]
    run = subprocess.run(command, capture_output=True, text=True, check=True)
    assert f"{module.replace('.', '/')}.py" in run.stdout
    # Packages on the way are loaded too, but hold nothing that could matter.
    loaded = {
        file
        for file in run.stdout.split()
        if not file.endswith("__init__.py") or "import" in Path(file).read_text()
    }
    assert loaded <= set(source_files(module))


EVERYWHERE = """
import biogrip.a_top
from biogrip import a_name
if TYPE_CHECKING:
    import biogrip.never
elif True:
    import biogrip.an_elif
else:
    import biogrip.an_else
try:
    import biogrip.a_try
except ImportError:
    import biogrip.a_handler
else:
    import biogrip.a_success
finally:
    import biogrip.a_last
try:
    pass
except* ImportError:
    import biogrip.a_group
def f():
    for _ in ():
        with g():
            import biogrip.a_body
    while h():
        match k():
            case 1:
                import biogrip.a_case
class C:
    async def m(self):
        import biogrip.a_method
"""


def test_an_import_is_found_wherever_it_stands(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """But for a type checker's."""
    named = set(re.findall(r"\b(?:a|an)_\w+", EVERYWHERE))
    for name in {*named, "never"}:
        (tmp_path / f"{name}.py").write_text("")
    (tmp_path / "whole.py").write_text(EVERYWHERE)
    monkeypatch.setattr("biogrip.products.source_files._PACKAGE", tmp_path)
    files = source_files("biogrip.whole")
    assert len(named) == 12
    assert {Path(file).stem for file in files} == {*named, "whole"}


def loaded_by(statement: str) -> set[str]:
    code = f"{statement}; import sys; print(*sys.modules)"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(run.stdout.split())


def test_what_starts_often_loads_no_library_that_it_does_not_use() -> None:
    """Start-up is what a job costs beyond its work."""
    heavy = {"matplotlib", "pandas", "scipy", "snakemake", "jinja2"}
    identification = "import biogrip.stages.identification, biogrip.fit.genetic"
    assert not heavy & loaded_by(identification)
    stages = "biogrip.stages"
    assert not heavy & loaded_by(f"import {stages}.measurement, {stages}.identifications")
    assert not {*heavy, "numpy", "pyarrow"} & loaded_by("import biogrip.cli; biogrip.cli._parser()")
    # Tables and figures are of a page that was not asked for.
    read = "import biogrip.identify.identify; from biogrip.traces.plain_rows import plain_rows"
    read += f"; from pathlib import Path; plain_rows(Path({str(EXAMPLE)!r}), 1, 2, (0, 1), ',')"
    assert loaded_by(read) & {*heavy, "pyarrow"} == {"pyarrow", "scipy"}


def test_a_fingerprint_changes_with_what_a_module_imports(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    module = "biogrip.stages.single_trace"
    package = Path(source_files(module)[0]).parent
    while package.name != "biogrip":
        package = package.parent
    shutil.copytree(package, tmp_path / "biogrip")
    of_original = fingerprint.__wrapped__(module)
    monkeypatch.setattr("biogrip.products.source_files._PACKAGE", tmp_path / "biogrip")
    assert fingerprint.__wrapped__(module) == of_original
    for file, same in (("fit/genetic.py", True), ("records/traces.py", False)):
        edited = tmp_path / "biogrip" / file
        edited.write_text(edited.read_text() + "# edited\n")
        assert (fingerprint.__wrapped__(module) == of_original) is same


LISTS = {"METHODS": "biogrip.fit.methods", "MODELS": "biogrip.experiment.models"}
# Candidates are the models with numbers of branches; their module holds more, and is followed.
LISTED = {*LISTS, "CANDIDATES"}
DECLARING = ("products", "records", "stages", "tables", "figures", "page")


def test_what_products_use_of_methods_and_models_is_in_their_settings() -> None:
    """No digest follows the lists of them; so products name modules from these, no more."""
    assert set(LISTS.values()) <= set(_SAYING)
    (folder,) = map(Path, biogrip.__path__)
    uses = 0
    for file in (one for name in DECLARING for one in (folder / name).rglob("*.py")):
        if file.name == "digest.py":
            continue
        tree = ast.parse(file.read_text(encoding="utf-8"))
        chosen = [node for node in ast.walk(tree) if isinstance(node, ast.Lambda)]
        allowed = {id(inner) for node in chosen for inner in ast.walk(node)}
        for node in ast.walk(tree):
            if isinstance(node, ast.Name) and node.id in LISTED:
                uses += 1
                assert id(node) in allowed, f"{file.name}, line {node.lineno}"
    assert uses >= 4
