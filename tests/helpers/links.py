"""Links of an HTML page."""

import re
from pathlib import Path


def links_of(page: Path) -> tuple[list[str], list[str]]:
    """Return the links of a page to files and to its own places, and those that are dead."""
    text = page.read_text(encoding="utf-8")
    every = re.findall(r'(?:href|src)="([^"]*)"', text)
    own = [link for link in every if not re.match(r"https?:|data:|mailto:", link)]
    places = {f"#{name}" for name in re.findall(r'\bid="([^"]+)"', text)}
    return own, [it for it in own if it not in places and not (page.parent / it).is_file()]
