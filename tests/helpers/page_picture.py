"""The picture of the page in the README: ``python -m tests.helpers.page_picture PAGE PICTURE``."""

import sys
from pathlib import Path

from tests.helpers.browser import chromium

# From the title to the first figure.
WIDTH, HEIGHT = 1060, 1290


def main(page: Path, picture: Path) -> None:
    """Open a page as wide as a reader's, and keep what is seen of it."""
    with chromium() as browser:
        opened = browser.new_page(viewport={"width": WIDTH, "height": HEIGHT})
        opened.goto(page.resolve().as_uri())
        opened.screenshot(path=picture)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
