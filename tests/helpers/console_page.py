"""A person at the console's page: a browser before a station."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Literal

from playwright.sync_api import Browser, Page

_TIMEOUT_MS = 8000

_SETTLED = (
    "() => [...farside.meanings.values()].every(({since}) => performance.now() - since > 510)"
)


class Visitor:
    """Somebody with the page open.

    Attributes:
        page: the page.
        said: warnings and errors of its console and its script.
        requests: every address that it asked for.
    """

    def __init__(self, page: Page) -> None:
        self.page = page
        self.said: list[str] = []
        self.requests: list[str] = []
        page.set_default_timeout(_TIMEOUT_MS)
        page.on("console", lambda message: self._hear(message.type, message.text))
        page.on("pageerror", lambda error: self.said.append(str(error)))
        page.on("request", lambda request: self.requests.append(request.url))
        page.on("websocket", lambda socket: self.requests.append(socket.url))

    def _hear(self, kind: str, text: str) -> None:
        if kind in {"error", "warning"}:
            self.said.append(text)

    def go(self, address: str) -> "Visitor":
        """Open an address and wait until the page shows what the station does."""
        self.page.goto(address)
        return self.here()

    def here(self) -> "Visitor":
        """Wait until the page shows what the station does."""
        self.page.wait_for_function("() => window.farside?.frames > 0")
        return self

    def settle(self) -> None:
        """Wait until every button has meant the same for long enough to be pressed."""
        self.page.wait_for_function(_SETTLED)

    def press(self, *keys: str) -> None:
        """Press keys, one after the other."""
        for key in keys:
            self.page.keyboard.press(key)

    def sees(self, text: str) -> None:
        """Wait until this stands somewhere on the page."""
        self.page.get_by_text(text).first.wait_for()

    def hears(self, text: str) -> None:
        """Wait until the page tells this."""
        self.page.locator(".q-notification", has_text=text).first.wait_for()


@contextmanager
def visiting(
    browser: Browser,
    address: str,
    *,
    width: int = 1280,
    height: int = 800,
    scheme: Literal["light", "dark"] = "light",
    script: str = "",
) -> Iterator[Visitor]:
    """Somebody opens the page in a browser of their own; `script` runs before the page's."""
    context = browser.new_context(viewport={"width": width, "height": height}, color_scheme=scheme)
    if script:
        context.add_init_script(script)
    try:
        yield Visitor(context.new_page()).go(address)
    finally:
        context.close()
