"""Source files that a stage is made of, so that the workflow can track them.

Snakemake does not follow imports. Here every ``import`` statement inside the
package is followed, without running anything; but not to what only says what there
is to do, nor to the lists of methods and models that there are: what a job uses of
these is in the digest of what it uses (`biogrip.products.digest`), or among the
modules that its product names.
"""

import ast
import hashlib
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import biogrip

_PACKAGE = Path(biogrip.__file__).parent
_SAYING = (
    "biogrip.study",
    "biogrip.fit.methods",
    "biogrip.experiment.models",
    *(f"biogrip.products.{name}" for name in ("declared", "product", "plan", "digest", "uses")),
    "biogrip.tables.declared",
    "biogrip.figures.declared",
)


@cache
def fingerprint(*modules: str) -> str:
    """Hash of what `source_files` names: one value where a list of files would be long."""
    digest = hashlib.sha256()
    for file in source_files(*modules):
        digest.update(hashlib.sha256(Path(file).read_bytes()).digest())
    return digest.hexdigest()[:16]


def source_files(*modules: str) -> list[str]:
    """Files of modules, by dotted names, and of all of the package that they import, sorted."""
    visited: set[str] = set()
    waiting = list(modules)
    while waiting:
        name = waiting.pop()
        if name not in visited:
            visited.add(name)
            waiting += _imports(name)
    return sorted(str(_file(name)) for name in visited)


def _file(module: str) -> Path | None:
    path = _PACKAGE.joinpath(*module.split(".")[1:])
    for file in (path.with_suffix(".py"), path / "__init__.py"):
        if file.is_file():
            return file
    return None


@cache
def _imports(module: str) -> list[str]:
    file = _file(module)
    assert file is not None
    found: set[str] = set()
    for node in _executed(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module and node.level == 0:
            found.add(node.module)
            found.update(f"{node.module}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.Import):
            found.update(alias.name for alias in node.names)
    return [name for name in sorted(found) if followed(name)]


def _executed(tree: ast.Module) -> Iterator[ast.stmt]:
    """Walk over all statements, for in no other place is an import, but for a type checker's."""
    waiting: list[ast.stmt] = [*tree.body]
    while waiting:
        statement = waiting.pop()
        if isinstance(statement, ast.If) and ast.unparse(statement.test) == "TYPE_CHECKING":
            waiting += statement.orelse
            continue
        yield statement
        for branch in (statement, *_of_branches(statement)):
            for name in ("body", "orelse", "finalbody"):
                waiting += getattr(branch, name, [])


def _of_branches(statement: ast.stmt) -> list[ast.ExceptHandler] | list[ast.match_case]:
    """Return parts of a ``try`` or a ``match`` that hold statements without being one."""
    if isinstance(statement, ast.Try | ast.TryStar):
        return statement.handlers
    return statement.cases if isinstance(statement, ast.Match) else []


@cache
def followed(name: str) -> bool:
    """Return True if a module is the package's, and not one that only says what there is to do."""
    says_only = any(name == said or name.startswith(f"{said}.") for said in _SAYING)
    return name.startswith("biogrip.") and not says_only and _file(name) is not None
