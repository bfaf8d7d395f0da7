"""Parts of the documentation that are written from code and results; `make docs` renews them."""

import re
from collections.abc import Callable
from functools import partial
from pathlib import Path

import pandas as pd

from biogrip.study.reference import file_schema, reference
from tests.published_numbers import renewed_numbers

ROOT = Path(__file__).parents[1]
PUBLISHED = ROOT / "results" / "published"
ERRORS = PUBLISHED / "tables" / "errors.csv"


def config_keys() -> str:
    """Tables of every config key."""
    return reference(ROOT / "config" / "config.yaml")


def paper_against_study() -> str:
    """The README's table "paper | this study", from the published error table."""
    rows = []
    for row in pd.read_csv(ERRORS, dtype=str, keep_default_na=False).to_dict("records"):
        if row["parameter"] in ("c_p",):
            continue
        low, high = (f"{float(row[key]):.3g}" for key in ("p05_identified", "p95_identified"))
        error = row["paper_error_percent"]
        rows.append(
            {
                "case": row["case"].replace("_", " "),
                "parameter": f"{row['parameter']} ({row['unit']})",
                "target": f"{float(row['target']):.4g}",
                "paper": f"{float(row['paper_identified']):.4g} ({_percent(error)})",
                "this study: typical seed": f"{float(row['typical_identified']):.3g} "
                f"({_percent(row['typical_error_percent'])})",
                "5-95 % of seeds": f"{low} to {high}",
                "seeds near the noise": f"{100 * float(row['near_noise_share']):.0f} %",
            }
        )
    return str(pd.DataFrame(rows).to_markdown(index=False, disable_numparse=True))


def _percent(text: str) -> str:
    try:
        return f"{float(f'{float(text):.2g}') + 0.0:g} %"
    except ValueError:
        return f"{text} %"


def published_table(name: str) -> str:
    """A published table, caption and all; until it is published, its name."""
    file = PUBLISHED / "tables" / f"{name}.md"
    if not file.is_file():
        return (
            f"(Table `{name}`: in `results/tables/` after a run, not yet among the published ones.)"
        )
    return file.read_text(encoding="utf-8").strip()


PARTS: dict[Path, dict[str, Callable[[], str]]] = {
    ROOT / "config" / "README.md": {"keys": config_keys},
    ROOT / "README.md": {"results": paper_against_study},
    ROOT / "docs" / "model.md": {
        name: partial(published_table, name) for name in ("contact_loss", "mechanics", "left_out")
    },
}
"""Parts of documents that are written, by what."""

SCHEMA = ROOT / "config" / "schema.json"
GENERATED = (
    SCHEMA,
    ROOT / "config" / "README.md",
    ROOT / "README.md",
    *sorted((ROOT / "docs").glob("*.md")),
)


def renewed(path: Path) -> str:
    """Return a document with its generated parts, and its numbers, as they should be."""
    if path == SCHEMA:
        return file_schema()
    text = path.read_text(encoding="utf-8")
    for name, content in PARTS.get(path, {}).items():
        match = re.search(
            rf"<!-- {name}: begin[^\n]*-->\n(.*)<!-- {name}: end -->", text, re.DOTALL
        )
        if match is None:
            raise ValueError(f"{path}: has no part {name} to be written.")
        text = f"{text[: match.start(1)]}\n{content()}\n\n{text[match.end(1) :]}"
    return renewed_numbers(text)


if __name__ == "__main__":
    for document in GENERATED:
        document.write_text(renewed(document), encoding="utf-8")
