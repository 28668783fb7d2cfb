# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The gate before all pages, files and WebSockets: host name, origin, session and bounds.

uvicorn does not bound connections per client: its timeouts begin after a response, and its
concurrency limit counts all clients together. The protocol here adds both: a request must arrive in
time, and one client cannot take all connections.
"""

import asyncio
import time
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any
from urllib.parse import parse_qs, urlencode, urlsplit

from nicegui import App, context, core, ui
from starlette.datastructures import MutableHeaders
from starlette.requests import HTTPConnection, Request
from starlette.responses import HTMLResponse, PlainTextResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol

from valve_friction_ros.dashboard.accounts import Access, Account, Role
from valve_friction_ros.dashboard.log_in import LogIn, Sessions, limited, network_of
from valve_friction_ros.outside_text import page_environment, printable

_BASE = {
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    # Not no-referrer, which would make the origin of our own form "null".
    "Referrer-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Permissions-Policy": "camera=(), geolocation=(), microphone=(), payment=(), usb=()",
    "Cache-Control": "no-store",
}
_NO_FRAMES = "frame-ancestors 'none'; base-uri 'none'; form-action 'self'"

OF_PAGES = {
    **_BASE,
    # NiceGUI's page has inline scripts and styles and evaluates code from the server, so both must
    # be allowed. Nothing is loaded from, or sent to, another host.
    "Content-Security-Policy": "default-src 'self'; "
    "script-src 'self' 'unsafe-inline' 'unsafe-eval'; style-src 'self' 'unsafe-inline'; "
    "img-src 'self' data: blob:; font-src 'self' data:; "
    f"connect-src 'self'; object-src 'none'; {_NO_FRAMES}",
}
"""Default headers of the pages and their files."""

ENCRYPTED_ONLY = {"Strict-Transport-Security": "max-age=86400"}
"""Header with a certificate: for a day, the browser then uses https only."""

OF_LOG_IN = {
    **_BASE,
    "Content-Security-Policy": f"default-src 'none'; style-src 'unsafe-inline'; {_NO_FRAMES}",
}
"""Headers of the log-in page, which has no script."""


def host_of(header: str) -> str:
    """Return the name or address in a ``Host`` header; empty if there is none."""
    try:
        return urlsplit(f"//{header}").hostname or ""
    except ValueError:
        return ""


def is_own_origin(origin: str | None, host: str, is_encrypted: bool = False) -> bool:
    """Return whether a request comes from a page of this host.

    A browser states the origin of each WebSocket and form; a client without an origin is not a
    browser. With a certificate the page came by https; without one it may have too, from a proxy.
    """
    if origin is None:
        return True
    try:
        asking = urlsplit(origin)
        schemes = ("https",) if is_encrypted else ("http", "https")
        is_here = bool(host) and asking.netloc.lower() == host.lower()
        return is_here and asking.scheme in schemes
    except ValueError:
        return False


def own_path(text: str) -> str:
    """Return a path on this host, or ``/`` if the text could lead to another host."""
    is_own = text.startswith("/") and not text.startswith("//")
    return text if is_own and text.isprintable() and "\\" not in text else "/"


ARRIVAL_TIME = 10.0
"""Time for a complete request to arrive, s, from the connection or from its first byte."""

MOST_OF_A_CLIENT = 256
"""Maximum number of open connections per address. Chosen: a browser takes seven to open a page and
one to keep it, so 30 visitors behind one proxy can open pages at once; the usual limit of a process
is 1024 open files."""


class _Bounded(HttpToolsProtocol):
    """uvicorn's protocol with a timeout per request and a connection limit per client."""

    def __init__(self, *arguments: Any, log: Callable[[str], None], **named: Any) -> None:
        super().__init__(*arguments, **named)
        self._log = log
        self._network = ""
        self._due: asyncio.TimerHandle | None = None
        self._has_begun = False

    @property
    def since(self) -> float:
        """Time when a request is overdue, s of the loop's clock; infinite if none is awaited."""
        return float("inf") if self._due is None else self._due.when()

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Accept a connection; above the limit, end the client's longest-waiting connection."""
        super().connection_made(transport)
        self._network = network_of(_host(self))
        self._await_request()
        own = [one for one in self.connections if network_of(_host(one)) == self._network]
        if len(own) > MOST_OF_A_CLIENT:
            waiting = [one for one in own if isinstance(one, _Bounded)]
            oldest = min(waiting, key=lambda one: one.since)
            oldest.end(f"more than {MOST_OF_A_CLIENT} were open")

    def connection_lost(self, exc: Exception | None) -> None:
        self._has_arrived()
        super().connection_lost(exc)

    def end(self, why: str) -> None:
        """End the connection at once, and log the reason."""
        self._has_arrived()
        self._log(f"a connection of {printable(self._network)} was closed: {why}")
        self.connections.discard(self)
        self.transport.abort()

    def _await_request(self) -> None:
        if self._due is None:
            self._due = self.loop.call_later(ARRIVAL_TIME, self._overdue)

    def _overdue(self) -> None:
        if self._has_begun:
            self.end(f"its request did not arrive within {ARRIVAL_TIME:g} s")
        else:  # browsers open connections in advance
            self.transport.abort()

    def _has_arrived(self) -> None:
        if self._due is not None:
            self._due.cancel()
            self._due = None

    def on_message_begin(self) -> None:
        self._has_begun = True
        self._await_request()
        super().on_message_begin()

    def on_message_complete(self) -> None:
        self._has_arrived()
        super().on_message_complete()


def _host(connection: object) -> str:
    """Return the client address of a connection, also for a WebSocket."""
    client = getattr(connection, "client", None)
    return client[0] if client else ""


LOG_IN = "/login"
"""Path of the log-in."""
STATE = "/login/state"
"""Path that answers 204 with a session and 401 without."""

_LONGEST_FORM = 4096
_LONGEST_NAME = 64
_PATIENCE = 10.0
"""Timeout for a form to arrive, s."""


def _cookie(asked: HTTPConnection, access: Access) -> str:
    """Return the name of the cookie; it includes the port, since cookies apply to all ports."""
    prefix = "__Host-" if access.is_encrypted else ""
    return f"{prefix}valve_friction_{asked.scope['server'][1]}"


def token_of(asked: HTTPConnection, access: Access) -> str | None:
    """Return the session token of a request."""
    return asked.cookies.get(_cookie(asked, access))


class Gate:
    """An ASGI application that lets only authorised requests through to another.

    `log` takes a line for each log-in, and for refused ones at a limited rate.
    """

    def __init__(
        self, app: ASGIApp, access: Access, sessions: Sessions, log: Callable[[str], None]
    ) -> None:
        self._app, self._access, self._sessions, self._log = app, access, sessions, log
        self._log_in = LogIn(access, sessions)
        self._log_refusal = limited(log)
        self._page = page_environment("valve_friction_ros.dashboard").get_template("log_in.html")

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer, refuse or pass on a request."""
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
        """Refuse foreign host names and requests from foreign pages."""
        host = asked.headers.get("host", "")
        if not self._access.answers_to(host_of(host), asked.scope["server"][0]):
            words = f"no such host here: {printable(host, 100)!r}; see host_names of the dashboard"
            return PlainTextResponse(words, 400, OF_LOG_IN)
        origin = asked.headers.get("origin")
        if not is_own_origin(origin, host, self._access.is_encrypted):
            return PlainTextResponse("refused: requested by another site", 403, OF_LOG_IN)
        return None

    async def _without_session(self, asked: HTTPConnection, receive: Receive) -> Response | None:
        """Answer the log-in and requests without a session; return None with a session."""
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
        """Check a log-in form against the accounts."""
        try:
            fields = await asyncio.wait_for(_fields(request), _PATIENCE)
        except (asyncio.TimeoutError, ValueError):  # equals the builtin one only since Python 3.11
            return PlainTextResponse("not a log-in form", 400, OF_LOG_IN)
        there = own_path(fields.get("next", "/"))
        address = request.client.host if request.client else ""
        name = fields.get("name", "")
        found = await self._log_in.attempt(name, fields.get("password", ""), address)
        if isinstance(found, int):
            return self._refused(name, address, there, found)
        self._log(f"{printable(name)} has logged in from {printable(address)}")
        self._sessions.end(token_of(request, self._access))  # any earlier session of this browser
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

    def _refused(self, name: str, address: str, there: str, wait: int) -> Response:
        why = "too many attempts" if wait > 0 else "wrong name or password"
        shown = printable(name, _LONGEST_NAME)
        self._log_refusal(f"refused log-in of {shown!r} from {printable(address)}: {why}")
        if wait <= 0:
            return self._form(there, "Wrong name or password.", 401)
        page = self._form(there, f"Too many attempts: try again in {-(-wait // 60)} min.", 429)
        page.headers["Retry-After"] = str(wait)
        return page

    async def _let_through(self, asked: HTTPConnection, receive: Receive, send: Send) -> None:
        if asked.scope["type"] == "http":
            await self._app(asked.scope, receive, send)
            return

        async def receive_in_session() -> Message:
            """Close a WebSocket at its next message or pong once its session has ended."""
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
    """Return the fields of a form; raises ValueError if it is too long or invalid."""
    body = b""
    async for part in request.stream():
        body += part
        if len(body) > _LONGEST_FORM:
            raise ValueError
    found = parse_qs(body.decode(), max_num_fields=10)
    return {name: values[0] for name, values in found.items()}


_WATCH = f"""<script>
setInterval(async () => {{
  const answer = await fetch("{STATE}", {{cache: "no-store"}}).catch(() => null);
  if (answer && answer.status === 401) location.reload();
}}, 15000);
</script>"""
"""Script that returns to the log-in when the session has ended.

Without it NiceGUI's page would try to reconnect for ever."""


class Guard:
    """Identifies the visitor in a page and in its handlers."""

    def __init__(self, access: Access, sessions: Sessions) -> None:
        self._access, self._sessions = access, sessions

    def _token(self) -> str | None:
        return token_of(context.client.request, self._access)

    def visitor(self) -> Account | None:
        """Return the account of this page, or None if its session has ended.

        Call this only in the code of a page: while it is drawn, or in one of its event handlers.
        """
        try:
            return self._sessions.account_of(self._token())
        except RuntimeError:  # raised by NiceGUI outside a page
            return None

    def name(self) -> str:
        """Return the name of the account of this page; empty without an account."""
        return visitor.name if (visitor := self.visitor()) else ""

    def may_operate(self) -> bool:
        """Return whether this page may call services of identifiers now."""
        if not self._access.accounts:
            return True
        visitor = self.visitor()
        return visitor is not None and visitor.role is Role.OPERATE

    def log_out(self) -> None:
        """End the session of this page and of all other pages that share it."""
        self._sessions.end(self._token())
        ui.navigate.to(LOG_IN)


def guard(app: App, access: Access, log: Callable[[str], None]) -> Guard:
    """Put the gate before an application; call this once, before the application runs.

    `log` takes a line for each log-in and each refused one. Raises ValueError or OSError if the
    session file cannot be used.
    """
    sessions = Sessions(
        access.accounts, access.session_hours * 3600.0, time.time, access.session_file, log
    )
    build = app.build_middleware_stack
    # The gate surrounds the whole stack, including middleware added later.
    app.build_middleware_stack = lambda: Gate(build(), access, sessions, log)  # type: ignore[method-assign]

    def is_own(origin: str | None, request: dict[str, Any]) -> bool:
        return is_own_origin(origin, request.get("HTTP_HOST", ""), access.is_encrypted)

    core.sio.eio.cors_allowed_origins = is_own
    if access.accounts:
        ui.add_head_html(_WATCH, shared=True)
    return Guard(access, sessions)


def server_options(access: Access, log: Callable[[str], None]) -> dict[str, Any]:
    """Return the access options for `ui.run`.

    `log` takes the lines on ended connections, at a limited rate.
    """
    options: dict[str, Any] = {
        "host": access.host,
        # With proxy headers a request could forge its address, by which attempts are counted.
        "proxy_headers": False,
        "server_header": False,
        "http": partial(_Bounded, log=limited(log)),
    }
    if access.certificate is not None and access.key is not None:
        options |= {"ssl_certfile": str(access.certificate), "ssl_keyfile": str(access.key)}
    return options
