"""A browser for tests of pages: Debian's chromium, driven by playwright."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Literal

from playwright.sync_api import Browser, Page, sync_playwright

CHROMIUM = shutil.which("chromium")
"""Where it is; `None` if the machine has none. CI installs it."""


@contextmanager
def chromium() -> Iterator[Browser]:
    """The browser, for as long as it is used."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM)
        yield browser
        browser.close()


class Opened:
    """A page in a browser, and all that it said, asked for or failed at.

    Attributes:
        page: the page.
        said: warnings and errors of its console and of its script.
        requests: every address that it asked for but its own.
    """

    def __init__(
        self,
        browser: Browser,
        path: Path,
        *,
        hash_: str = "",
        width: int = 1280,
        scheme: Literal["light", "dark"] = "light",
    ) -> None:
        self.said: list[str] = []
        self.requests: list[str] = []
        context = browser.new_context(viewport={"width": width, "height": 900}, color_scheme=scheme)
        self.page: Page = context.new_page()
        self.page.on("console", lambda message: self._hear(message.type, message.text))
        self.page.on("pageerror", lambda error: self.said.append(str(error)))
        self.page.on("request", lambda request: self.requests.append(request.url))
        self.page.goto(f"{path.as_uri()}{hash_}")
        self.requests = [url for url in self.requests if not url.startswith(path.as_uri())]

    def _hear(self, kind: str, text: str) -> None:
        if kind in {"error", "warning"}:
            self.said.append(text)

    def settle(self) -> None:
        """Wait until what was asked of the page is drawn."""
        self.page.evaluate(
            "() => new Promise((drawn) => "
            "requestAnimationFrame(() => requestAnimationFrame(() => drawn())))"
        )

    def slide(self, t_s: float) -> None:
        """Move the slider to a time."""
        self.page.evaluate(
            "(t) => { const slider = document.getElementById('slider'); slider.value = t;"
            " slider.dispatchEvent(new Event('input')); }",
            t_s * 1000,
        )
        self.settle()

    def as_ground(self) -> None:
        """Turn the switch."""
        self.page.click("#switch")
        self.settle()

    def text(self, selector: str) -> str:
        """The text of an element that is shown."""
        return self.page.inner_text(selector)

    def path(self, selector: str) -> str:
        """What the paths that match draw."""
        drawn = self.page.eval_on_selector_all(
            selector, "(paths) => paths.map((path) => path.getAttribute('d'))"
        )
        return " ".join(drawn)

    def colour(self, selector: str, name: str) -> str:
        """A computed colour."""
        found = self.page.eval_on_selector(
            selector, "(node, name) => getComputedStyle(node)[name]", name
        )
        return str(found)

    def close(self) -> None:
        """Close it."""
        self.page.context.close()
