"""What the site shows beside docs/: documents and results from all over the repository."""

import re
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

ROOT = Path(__file__).parents[1]
SHOWN = (
    *("*.md", "CITATION.cff", "LICENSE", "config/*", "data/**/*", "docs/**/*", "profiles/**/*"),
    *("results/published/**/*", "benchmarks/**/results/*", "tests/*/test_*.py"),
)
_LEFT_OUT = {".lock", ".pyc"}
_COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Give every page the place that it has in the repository, where links look for it."""
    site = config.site_dir
    own = [file for file in files if file.src_dir != config.docs_dir]
    found = sorted({path for pattern in SHOWN for path in ROOT.glob(pattern)})
    shown = [
        File(path.relative_to(ROOT).as_posix(), str(ROOT), site, use_directory_urls=False)
        for path in found
        if path.is_file() and path.suffix not in _LEFT_OUT
    ]
    return Files([*own, *shown])


def on_page_markdown(markdown: str, **_: object) -> str:
    """Leave out comments: one at the beginning of a line would end its paragraph."""
    return _COMMENT.sub("", markdown)
