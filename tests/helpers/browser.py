"""Pages in a browser, see `tests.conftest`."""

from pathlib import Path
from typing import Any

from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Browser


class Opened:
    """A page, what went wrong in it, and what it asked for beside itself."""

    def __init__(self, browser: Browser, page: Path | str, **context: Any) -> None:
        address = page if isinstance(page, str) else page.as_uri()
        # A page from a file asks for nothing; one from an address for what is below that.
        self._own = (address if address.startswith("http:") else "file:", "data:", "blob:")
        self.problems: list[str] = []
        self.asked: list[str] = []
        self.page = browser.new_page(**context)
        self.page.on("pageerror", lambda error: self.problems.append(str(error)))
        self.page.on("console", self._said)
        self.page.on("request", self._requested)
        self.page.goto(address)

    def close(self) -> None:
        assert (self.problems, self.asked) == ([], [])
        self.page.close()

    def _said(self, message: Any) -> None:
        if message.type == "error":
            self.problems.append(message.text)

    def _requested(self, request: Any) -> None:
        if not request.url.startswith(self._own):
            self.asked.append(request.url)

    def barriers(self, *rules: str) -> list[tuple[str, list[str]]]:
        """What Axe finds that is serious, by some of its rules or by all."""
        # Of what passes it then tells the rule alone.
        options = {"resultTypes": ["violations"]} | ({"runOnly": list(rules)} if rules else {})
        found = Axe().run(self.page, options=options).response
        assert len(found["passes"]) > (0 if rules else 20)
        serious = [v for v in found["violations"] if v["impact"] in ("serious", "critical")]
        return [(v["id"], [node["html"] for node in v["nodes"]]) for v in serious]
