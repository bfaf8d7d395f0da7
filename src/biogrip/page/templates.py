"""Templates of pages, and files within them."""

import base64
import re
from html import escape
from pathlib import Path

import jinja2

from biogrip.digits import legible
from biogrip.terminal import visible, visible_lines

_FOLDER = Path(__file__).parent
_SYMBOL = re.compile(r"\b([kc])_(\w)\b")


def environment(*folders: Path) -> jinja2.Environment:
    """Return the templates of this package, and those in further folders."""
    templates = jinja2.Environment(
        loader=jinja2.FileSystemLoader([*folders, _FOLDER]),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    templates.filters |= {
        "legible": legible,
        "visible": visible,
        "visible_lines": visible_lines,
        "symbols": lambda text: _SYMBOL.sub(r"<i>\1</i><sub>\2</sub>", escape(text)),
    }
    templates.globals |= {
        name: (_FOLDER / file).read_text(encoding="utf-8")
        for name, file in (("style", "report.css"), ("script", "sliders.js"))
    }
    return templates


def data_url(kind: str, content: bytes) -> str:
    """Return a file as a data URL (RFC 2397)."""
    return f"data:{kind};base64,{base64.b64encode(content).decode()}"
