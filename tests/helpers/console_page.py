"""A person at the console's page: a browser before a station."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Literal

from playwright.sync_api import Browser, Page

_TIMEOUT_MS = 20_000  # a machine may be busy; a page that fails is told late, and no less

_SETTLED = (
    "() => [...farside.meanings.values()].every(({since}) => performance.now() - since > 510)"
)
_MEANINGS = "() => ['proposal', 'paused'].map((name) => farside.meanings.get(name)?.meaning)"


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

    def shows(self, proposal: int, *, paused: bool) -> bool:
        """Whether this is what its keys answer by now, and whether time stands for them."""
        return bool(self.page.evaluate(_MEANINGS) == [proposal, paused])

    def look(self) -> None:
        """Look for as long as it takes until what has just changed can be clicked."""
        now = self.page.evaluate("performance.now()")
        self.page.wait_for_function("(since) => performance.now() - since > 600", arg=now)

    def press(self, *keys: str) -> None:
        """Press keys, one after the other."""
        for key in keys:
            self.page.keyboard.press(key)

    def texts(self) -> list[tuple[str, float, float]]:
        """The texts that are shown, each with its size in px and its contrast."""
        return [(text, size, contrast) for text, size, contrast in self.page.evaluate(_TEXTS)]

    def sends(self, name: str, detail: object) -> None:
        """Send the server what no key of the page sends."""
        self.page.evaluate(
            "([name, detail]) => document.querySelector('.farside-hands')"
            ".dispatchEvent(new CustomEvent(name, { detail }))",
            [name, detail],
        )

    def sees(self, text: str) -> None:
        """Wait until this stands somewhere on the page."""
        self.page.get_by_text(text).first.wait_for()

    def sees_no_dialog(self) -> None:
        """Wait until no dialog is open."""
        self.page.locator(".q-dialog").wait_for(state="detached")

    def hears(self, text: str) -> None:
        """Wait until the page tells this."""
        self.page.locator(".q-notification", has_text=text).first.wait_for()


_TEXTS = """() => {
  const channels = (colour) => colour.match(/[0-9.]+/g).map(Number);
  const light = (colour) => channels(colour).slice(0, 3).map((c) => c / 255)
    .map((c) => (c <= 0.03928 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4))
    .reduce((sum, c, i) => sum + c * [0.2126, 0.7152, 0.0722][i], 0);
  const ground = (node) => {
    for (let at = node; at; at = at.parentElement) {
      const colour = getComputedStyle(at).backgroundColor;
      if ((channels(colour)[3] ?? 1) > 0.5) return colour;
    }
    return 'rgb(255, 255, 255)';
  };
  const own = (node) => [...node.childNodes].some((one) => one.nodeType === 3 && one.data.trim());
  return [...document.querySelectorAll('.console *')].filter((node) => own(node)
    && node.checkVisibility() && !(node instanceof SVGElement)).map((node) => {
      const style = getComputedStyle(node);
      const [a, b] = [light(style.color), light(ground(node))].sort((a, b) => b - a);
      return [node.textContent, parseFloat(style.fontSize), (a + 0.05) / (b + 0.05)];
    });
}"""


@contextmanager
def visiting(
    browser: Browser,
    address: str,
    *,
    width: int = 1280,
    height: int = 800,
    scheme: Literal["light", "dark"] = "light",
) -> Iterator[Visitor]:
    """Somebody opens the page in a browser of their own."""
    context = browser.new_context(viewport={"width": width, "height": height}, color_scheme=scheme)
    try:
        yield Visitor(context.new_page()).go(address)
    finally:
        context.close()
