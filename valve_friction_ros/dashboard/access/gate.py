"""The gate before all pages, files and WebSockets: own names, own origin, a session."""

import asyncio
import time
from collections.abc import Callable, Mapping
from urllib.parse import parse_qs, urlencode

from starlette.datastructures import MutableHeaders
from starlette.requests import HTTPConnection, Request
from starlette.responses import HTMLResponse, PlainTextResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from valve_friction_ros.dashboard.access.access import Access
from valve_friction_ros.dashboard.access.accounts import Account
from valve_friction_ros.dashboard.access.attempt_limit import AttemptLimit
from valve_friction_ros.dashboard.access.headers import (
    ENCRYPTED_ONLY,
    OF_LOG_IN,
    OF_PAGES,
    host_of,
    is_own_origin,
    own_path,
)
from valve_friction_ros.dashboard.access.log_in import LogIn, Refusal
from valve_friction_ros.dashboard.access.sessions import Sessions
from valve_friction_ros.outside_text import printable
from valve_friction_ros.page_template import page_environment

__all__ = ["LOG_IN", "STATE", "Gate", "token_of"]

LOG_IN = "/login"
"""Path of the log-in."""
STATE = "/login/state"
"""Path that answers 204 in a session and 401 out of it."""

_LONGEST_FORM = 4096
_LONGEST_NAME = 64
_MOST_LINES = 60
"""Refused log-ins that are logged in a minute."""
_PATIENCE = 10.0
"""Time for a form to arrive, s."""


def _cookie(asked: HTTPConnection, access: Access) -> str:
    """Return the cookie's name: by the port, since the cookies of a host know none."""
    prefix = "__Host-" if access.is_encrypted else ""
    return f"{prefix}valve_friction_{asked.scope['server'][1]}"


def token_of(asked: HTTPConnection, access: Access) -> str | None:
    """Return the token of a session that a request holds."""
    return asked.cookies.get(_cookie(asked, access))


class Gate:
    """An ASGI application around another, which only who may see it reaches.

    Parameters
    ----------
    app : ASGI application
        The pages.
    access : Access
        Who may see them.
    sessions : Sessions
        Who has logged in.
    log : callable
        Takes a line for each log-in and each refused one, of these 60 a minute at most.
    """

    def __init__(
        self, app: ASGIApp, access: Access, sessions: Sessions, log: Callable[[str], None]
    ) -> None:
        self._app, self._access, self._sessions, self._log = app, access, sessions, log
        self._log_in = LogIn(access, sessions)
        self._lines = AttemptLimit(_MOST_LINES, 60.0, time.monotonic)
        self._page = page_environment(__package__).get_template("log_in.html")

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request, refuse it, or let it through."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        asked = HTTPConnection(scope)
        if scope["type"] == "http":
            send = _with_headers(send, ENCRYPTED_ONLY if self._access.is_encrypted else {})
        response = self._refusal(asked)
        if response is None and self._access.accounts:
            response = await self._without_session(asked, receive)
        if response is None:
            await self._let_through(asked, receive, _with_headers(send, OF_PAGES))
        elif scope["type"] == "websocket":
            await send({"type": "websocket.close", "code": 1008})
        else:
            await response(scope, receive, send)

    def _account(self, asked: HTTPConnection) -> Account | None:
        return self._sessions.account_of(token_of(asked, self._access))

    def _refusal(self, asked: HTTPConnection) -> Response | None:
        """Refuse foreign names and foreign pages."""
        host = asked.headers.get("host", "")
        if not self._access.answers_to(host_of(host), asked.scope["server"][0]):
            words = f"no such host here: {printable(host, 100)!r}; see host_names of the dashboard"
            return PlainTextResponse(words, 400, OF_LOG_IN)
        origin = asked.headers.get("origin")
        if not is_own_origin(origin, host, self._access.is_encrypted):
            return PlainTextResponse("refused: asked by another site", 403, OF_LOG_IN)
        return None

    async def _without_session(self, asked: HTTPConnection, receive: Receive) -> Response | None:
        """Answer the log-in, and who has no session; None where there is one."""
        path = asked.scope["path"]
        if asked.scope["type"] == "http" and path == LOG_IN:
            if asked.scope["method"] == "POST":
                return await self._logged_in(Request(asked.scope, receive))
            return self._form(own_path(asked.query_params.get("next", "/")))
        if self._account(asked) is not None:
            return Response(status_code=204, headers=OF_LOG_IN) if path == STATE else None
        if path == STATE or "text/html" not in asked.headers.get("accept", ""):
            return PlainTextResponse("log in first", 401, OF_LOG_IN)
        query = asked.scope["query_string"].decode("latin-1")
        there = own_path(path + (f"?{query}" if query else ""))
        return RedirectResponse(f"{LOG_IN}?{urlencode({'next': there})}", 303, OF_LOG_IN)

    def _form(self, there: str, trouble: str = "", status: int = 200) -> Response:
        page = self._page.render(path=LOG_IN, next=there, trouble=trouble)
        return HTMLResponse(page, status, OF_LOG_IN)

    async def _logged_in(self, request: Request) -> Response:
        """Compare a form with the accounts."""
        try:
            fields = await asyncio.wait_for(_fields(request), _PATIENCE)
        except (asyncio.TimeoutError, ValueError):  # the builtin one only since Python 3.11
            return PlainTextResponse("no form of a log-in", 400, OF_LOG_IN)
        there = own_path(fields.get("next", "/"))
        address = request.client.host if request.client else ""
        name = fields.get("name", "")
        found = await self._log_in.attempt(name, fields.get("password", ""), address)
        if isinstance(found, Refusal):
            self._tell_refused(name, address, found)
            if found.wait > 0:
                minutes = -(-found.wait // 60)
                page = self._form(there, f"Too many attempts: try again in {minutes} min.", 429)
                page.headers["Retry-After"] = str(found.wait)
                return page
            return self._form(there, "Wrong name or password.", 401)
        self._log(f"{printable(name)} has logged in from {printable(address)}")
        self._sessions.end(token_of(request, self._access))  # of whoever sat there before
        response = RedirectResponse(there, 303, OF_LOG_IN)
        response.set_cookie(
            _cookie(request, self._access),
            found,
            max_age=round(self._access.session_hours * 3600),
            secure=self._access.is_encrypted,
            httponly=True,
            samesite="lax",
        )
        return response

    def _tell_refused(self, name: str, address: str, refusal: Refusal) -> None:
        """Log a refused log-in, within a bound: whoever tries may try without end."""
        if self._lines.wait("") > 0:
            return
        self._lines.count("")
        why = "too many attempts" if refusal.wait > 0 else "wrong name or password"
        shown = printable(name, _LONGEST_NAME)
        self._log(f"refused log-in of {shown!r} from {printable(address)}: {why}")

    async def _let_through(self, asked: HTTPConnection, receive: Receive, send: Send) -> None:
        if asked.scope["type"] == "http":
            await self._app(asked.scope, receive, send)
            return

        async def receive_in_session() -> Message:
            """Close a WebSocket whose session has ended, at its next message (or pong)."""
            message = await receive()
            if self._access.accounts and self._account(asked) is None:
                return {"type": "websocket.disconnect", "code": 1008}
            return message

        await self._app(asked.scope, receive_in_session, send)


def _with_headers(send: Send, more: Mapping[str, str]) -> Send:
    async def send_with_headers(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            for name, value in more.items():
                headers.setdefault(name, value)
        await send(message)

    return send_with_headers


async def _fields(request: Request) -> dict[str, str]:
    """Return the fields of a form; raises ValueError if it is too long or none."""
    body = b""
    async for part in request.stream():
        body += part
        if len(body) > _LONGEST_FORM:
            raise ValueError
    found = parse_qs(body.decode(), max_num_fields=10)
    return {name: values[0] for name, values in found.items()}
