"""How the page is served: who is let in, and what happens when it goes away."""

import socket
from collections.abc import Iterator
from urllib.error import HTTPError
from urllib.parse import urlsplit
from urllib.request import Request, urlopen

import pytest
from browsing import CHROMIUM
from console_page import Visitor
from fake_station import FakeStation
from playwright.sync_api import Browser
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect
from websockets.typing import Origin

from farside.console.page.serving import LOOPBACK, PageError, Serving, serving

WORD = "a-word"


@pytest.fixture(scope="module")
def served() -> Iterator[Serving]:
    with serving(FakeStation(), token=WORD) as page:
        yield page


def asked(served: Serving, path: str, **headers: str) -> tuple[int, str, str]:
    """The status, the text and the cookie that a request is answered with."""
    parts = urlsplit(served.address)
    request = Request(f"http://{parts.netloc}{path}", headers=headers)
    try:
        with urlopen(request) as answer:  # noqa: S310
            return answer.status, answer.read().decode(), answer.headers.get("set-cookie", "")
    except HTTPError as error:
        return error.code, error.read().decode(), ""


@pytest.mark.parametrize(
    "path",
    ["/", "/?token=wrong", "/farside/page.js", "/_nicegui_ws/socket.io/?EIO=4&transport=polling"],
)
def test_who_has_no_token_is_refused_in_one_plain_line(served: Serving, path: str) -> None:
    status, text, _ = asked(served, path, Cookie="farside=wrong")

    assert status == 403
    assert text.count("\n") == 1
    assert "open the whole address that `farside console` printed" in text


def test_the_cookie_of_the_first_visit_opens_all_the_rest(served: Serving) -> None:
    status, _, cookie = asked(served, f"/?token={WORD}")
    assert status == 200
    assert "HttpOnly" in cookie
    assert "SameSite=Strict" in cookie

    status, text, _ = asked(served, "/farside/page.js", Cookie=cookie.split(";")[0])
    assert status == 200
    assert "farside" in text


def test_the_page_of_another_site_is_refused(served: Serving) -> None:
    status, text, _ = asked(served, f"/?token={WORD}", Origin="http://elsewhere.example")
    assert (status, text) == (403, "Refused: asked for by the page of another site.\n")


@pytest.mark.parametrize(
    ("query", "origin"),
    [("", None), (f"&token={WORD}", Origin("http://elsewhere.example"))],
    ids=["no token", "another site"],
)
def test_a_websocket_is_refused_too(served: Serving, query: str, origin: Origin | None) -> None:
    host = urlsplit(served.address).netloc
    address = f"ws://{host}/_nicegui_ws/socket.io/?EIO=4&transport=websocket{query}"
    with pytest.raises(InvalidStatus) as refused, connect(address, origin=origin):
        pass
    assert refused.value.response.status_code == 403


def test_the_page_listens_on_this_machine_alone_unless_told_and_says_so(served: Serving) -> None:
    assert urlsplit(served.address).hostname == LOOPBACK
    assert len(served.lines) == 1


def test_a_port_that_is_taken_is_told_in_words() -> None:
    with socket.create_server((LOOPBACK, 0)) as other:
        port = other.getsockname()[1]
        with pytest.raises(PageError) as error, serving(FakeStation(), port=port):
            pass
    assert str(error.value) == f"port {port} of 127.0.0.1 is taken"


@pytest.mark.skipif(CHROMIUM is None, reason="needs chromium")
def test_a_page_whose_connection_is_lost_says_so_and_comes_back(browser: Browser) -> None:
    station = FakeStation()
    with browser.new_context() as context:
        with serving(station, token=WORD) as before:
            port = urlsplit(before.address).port or 0
            visitor = Visitor(context.new_page()).go(before.address)
            visitor.page.evaluate("socket.io.reconnectionDelay(50), socket.io.engine.close()")
            station.advance(1.0)
            visitor.sees("0:10:11.5")
        visitor.page.wait_for_selector("#popup[aria-hidden=false]")
        station.session.over = "The run is over: success."
        with serving(station, port=port, token=WORD):
            visitor.sees("The run is over: success.")
