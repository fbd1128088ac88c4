"""The guard at the page's door: no request without the token, none from another site's page."""

from http.cookies import CookieError, SimpleCookie
from secrets import compare_digest
from urllib.parse import parse_qs, urlsplit

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

_INCOMPLETE = (
    "This address lacks the token: open the whole address that `farside console` printed.\n"
)
_FOREIGN = "Refused: asked for by the page of another site.\n"


class Guard:
    """Lets through what brings the token in its address, or the cookie that was set from it.

    Args:
        app: what is guarded.
        token: the token.
        port: the port that the page is served at; browsers share cookies between the ports of a
            host, so it is part of the cookie's name.
    """

    def __init__(self, app: ASGIApp, token: str, port: int) -> None:
        self._app, self._token, self._cookie = app, token, f"farside-{port}"

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass on a request, or refuse it."""
        if scope["type"] not in {"http", "websocket"}:
            await self._app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        brought = parse_qs(scope["query_string"].decode("latin-1")).get("token", [""])[0]
        in_address = self._is_token(brought)
        if not (in_address or self._is_token(self._kept(headers))):
            await _refuse(scope, receive, send, _INCOMPLETE)
        elif not _is_own(headers):
            await _refuse(scope, receive, send, _FOREIGN)
        else:
            await self._app(scope, receive, self._keeping(send) if in_address else send)

    def _is_token(self, word: str) -> bool:
        return compare_digest(word.encode(), self._token.encode())

    def _kept(self, headers: Headers) -> str:
        try:
            morsel = SimpleCookie(headers.get("cookie", "")).get(self._cookie)
        except CookieError:
            return ""
        return morsel.value if morsel else ""

    def _keeping(self, send: Send) -> Send:
        """The answer sets the cookie."""

        async def sending(message: Message) -> None:
            if message["type"] == "http.response.start":
                cookie = f"{self._cookie}={self._token}; Path=/; HttpOnly; SameSite=Strict"
                MutableHeaders(scope=message).append("set-cookie", cookie)
            await send(message)

        return sending


def _is_own(headers: Headers) -> bool:
    """Whether a request comes from the page itself, or from nobody's page."""
    origin = headers.get("origin")
    return origin is None or urlsplit(origin).netloc == headers.get("host")


async def _refuse(scope: Scope, receive: Receive, send: Send, why: str) -> None:
    if scope["type"] == "http":
        await PlainTextResponse(why, status_code=403)(scope, receive, send)
        return
    await receive()  # websocket.connect
    await send({"type": "websocket.close", "code": 1008})  # before it is accepted: 403
