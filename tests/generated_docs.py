"""Parts of the documentation that are written from code and results; `make docs` renews them."""

import re
from pathlib import Path

import pandas as pd

from biogrip.study.reference import reference

ROOT = Path(__file__).parents[1]
ERRORS = ROOT / "results" / "published" / "tables" / "errors.csv"


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


GENERATED = {
    ROOT / "config" / "README.md": ("keys", config_keys),
    ROOT / "README.md": ("results", paper_against_study),
}


def renewed(path: Path) -> str:
    """Return a document with its generated part as it should be."""
    name, content = GENERATED[path]
    pattern = rf"(<!-- {name}: begin[^\n]*-->\n).*(<!-- {name}: end -->)"
    return re.sub(
        pattern,
        lambda match: f"{match[1]}\n{content()}\n\n{match[2]}",
        path.read_text(encoding="utf-8"),
        flags=re.DOTALL,
    )


if __name__ == "__main__":
    for document in GENERATED:
        document.write_text(renewed(document), encoding="utf-8")
