"""The gate before a NiceGUI application, and who sits before a page of it."""

import time
from collections.abc import Callable
from functools import partial
from typing import Any

from nicegui import App, context, core, ui

from valve_friction_ros.dashboard.access.access import Access
from valve_friction_ros.dashboard.access.accounts import Account, Role
from valve_friction_ros.dashboard.access.connections import bounded_protocol
from valve_friction_ros.dashboard.access.gate import LOG_IN, STATE, Gate, token_of
from valve_friction_ros.dashboard.access.headers import is_own_origin
from valve_friction_ros.dashboard.access.sessions import Sessions

__all__ = ["Guard", "guard", "server_options"]

_WATCH = f"""<script>
setInterval(async () => {{
  const answer = await fetch("{STATE}", {{cache: "no-store"}}).catch(() => null);
  if (answer && answer.status === 401) location.reload();
}}, 15000);
</script>"""
"""Leads to the log-in when the session has ended: NiceGUI's page would reconnect for ever."""


class Guard:
    """Says who asks, in a page and in its handlers.

    Parameters
    ----------
    access : Access
        Who may see and operate.
    sessions : Sessions
        Who has logged in.
    """

    def __init__(self, access: Access, sessions: Sessions) -> None:
        self._access, self._sessions = access, sessions

    def _token(self) -> str | None:
        return token_of(context.client.request, self._access)

    def visitor(self) -> Account | None:
        """Return the account whose page this is; None where its session has ended.

        To be asked in a page's own code: while it is drawn, or in a handler of one of its events.
        """
        try:
            return self._sessions.account_of(self._token())
        except RuntimeError:  # NiceGUI's, where there is no page
            return None

    def name(self) -> str:
        """Return the name of the account whose page this is; empty where there is none."""
        visitor = self.visitor()
        return "" if visitor is None else visitor.name

    def may_operate(self) -> bool:
        """Tell whether services of identifiers may be called for this page now."""
        if not self._access.accounts:
            return True
        visitor = self.visitor()
        return visitor is not None and visitor.role is Role.OPERATE

    def log_out(self) -> None:
        """End the session of this page, and of all others that have the same."""
        self._sessions.end(self._token())
        ui.navigate.to(LOG_IN)


def guard(app: App, access: Access, log: Callable[[str], None]) -> Guard:
    """Put the gate before an application; to be called once, before it runs.

    `log` takes a line for each log-in and each wrong one.

    Raises
    ------
    ValueError, OSError
        If the file of sessions cannot be used.
    """
    sessions = Sessions(
        access.accounts, access.session_hours * 3600.0, time.time, access.session_file, log
    )
    build = app.build_middleware_stack

    def build_behind_gate() -> Any:
        """Build the stack with the gate outside all of it, also of what is added later."""
        return Gate(build(), access, sessions, log)

    app.build_middleware_stack = build_behind_gate  # type: ignore[method-assign]
    core.sio.eio.cors_allowed_origins = partial(_is_own, is_encrypted=access.is_encrypted)
    if access.accounts:
        ui.add_head_html(_WATCH, shared=True)
    return Guard(access, sessions)


def _is_own(origin: str | None, request: dict[str, Any], is_encrypted: bool) -> bool:
    return is_own_origin(origin, request.get("HTTP_HOST", ""), is_encrypted)


def server_options(access: Access, log: Callable[[str], None]) -> dict[str, Any]:
    """Return what `ui.run` needs to know of the access.

    `log` takes the lines on connections that were ended.
    """
    options: dict[str, Any] = {
        "host": access.host,
        # Else a header of the request would say its address, by which attempts are counted.
        "proxy_headers": False,
        "server_header": False,
        "http": bounded_protocol(log),
    }
    if access.certificate is not None and access.key is not None:
        options |= {"ssl_certfile": str(access.certificate), "ssl_keyfile": str(access.key)}
    return options
