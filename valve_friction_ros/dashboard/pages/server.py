# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The server of the pages."""

import asyncio
import gc
import logging
import socket
import time
from collections.abc import Awaitable, Callable
from pathlib import Path

from fastapi import Request, Response
from fastapi.middleware.gzip import GZipMiddleware
from fastapi.responses import FileResponse
from nicegui import app, run, ui
from starlette.types import ASGIApp, Receive, Scope, Send

from valve_friction_ros.dashboard.accounts import Access
from valve_friction_ros.dashboard.context import DashboardContext, ValveFiles
from valve_friction_ros.dashboard.gate import Guard, guard, server_options
from valve_friction_ros.dashboard.pages.alarm_page import AlarmSelection, alarm_page
from valve_friction_ros.dashboard.pages.plant_page import compare_page, plant_page
from valve_friction_ros.dashboard.pages.valve_page import valve_page
from valve_friction_ros.history import HistoryError, alarms_as_csv

_Draw = Callable[[DashboardContext, dict[str, str]], Awaitable[None] | None]

_FILES = "/files/"
"""Prefix of the paths of reports and bags."""
_GRACE = 1
"""Time for open connections to finish at shutdown, s."""


def require_free(host: str, port: int) -> None:
    """Raise ValueError if the server cannot listen on an address."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    with socket.socket(family) as tried:
        tried.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            tried.bind((host, port))
        except OSError as error:
            raise ValueError(
                f"{host}:{port} cannot be opened ({error.strerror}): use another port"
            ) from None


class _Gone(logging.Filter):
    """Drops the errors logged when a browser leaves before its page is ready, and at a hasty end.

    A second request to stop, such as that of ``ros2 launch`` without a terminal, cancels the end.
    """

    def filter(self, record: logging.LogRecord) -> bool:
        error = record.exc_info[1] if record.exc_info else None
        is_hasty = record.getMessage().rstrip().endswith("asyncio.exceptions.CancelledError")
        return str(error) != "No response returned." and not is_hasty


def guarded(access: Access, log: Callable[[str], None]) -> Guard:
    """Put the gate before the pages; `log` takes a line for each log-in."""
    return guard(app, access, log)


class _Resting:
    """Answers 503 to every request while the node of the dashboard is inactive."""

    def __init__(self, application: ASGIApp, is_active: Callable[[], bool]) -> None:
        self._application, self._is_active = application, is_active

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "lifespan" or self._is_active():
            await self._application(scope, receive, send)
        elif scope["type"] == "websocket":
            await send({"type": "websocket.close", "code": 1013})
        else:
            words = (
                "The dashboard is inactive: configure and activate its node with "
                "`ros2 lifecycle set`."
            )
            await Response(words, 503, media_type="text/plain")(scope, receive, send)


def serve(
    context: DashboardContext,
    started: Callable[[], None],
    log: Callable[[str], None],
    is_active: Callable[[], bool],
) -> None:
    """Serve the pages until Ctrl-C or SIGTERM, and call `started` once they can be opened.

    `log` takes the lines on ended connections. Pages are refused unless `is_active`.
    """
    app.add_middleware(_Resting, is_active=is_active)
    ui.add_css(Path(__file__).with_name("dashboard.css"), shared=True)
    app.config.quasar_config["loadingBar"]["skipHijack"] = True  # it has no name for screen readers
    logging.getLogger("uvicorn.error").addFilter(_Gone())
    pages: dict[str, _Draw] = {
        "/": plant_page,
        "/alarms": alarm_page,
        "/valve": valve_page,
        "/compare": compare_page,
    }
    for path, draw in pages.items():
        _add_page(context, path, draw)

    _add_files(ValveFiles.of(context.options))
    _add_export(context)

    async def begin() -> None:
        await run.io_bound(context.history.refresh)
        gc.freeze()  # what stays is not searched when a page is closed
        started()

    app.on_startup(begin)
    # A closed page is thousands of objects in a cycle, which would be left until many more are.
    app.on_delete(lambda: asyncio.get_running_loop().call_soon(gc.collect))
    ui.run(
        **server_options(context.options.access, log),
        port=context.options.port,
        title="Valve friction",
        dark=None,
        language="en-US",
        reload=False,
        show=False,
        show_welcome_message=False,
        tailwind=False,
        binding_refresh_interval=None,
        reconnect_timeout=5.0,
        gzip_middleware_factory=LightlyPacked,
        timeout_graceful_shutdown=_GRACE,
    )


class LightlyPacked(GZipMiddleware):
    """Compresses responses lightly: at the default level 9 a first visit takes a second.

    Reports and bags are not compressed: bags are large and hardly shrink.
    """

    def __init__(self, application: ASGIApp) -> None:
        super().__init__(application, minimum_size=1000, compresslevel=1)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request."""
        is_file = scope["type"] == "http" and scope["path"].startswith(_FILES)
        await (self.app if is_file else super().__call__)(scope, receive, send)


def _add_page(context: DashboardContext, path: str, draw: _Draw) -> None:
    @ui.page(path)
    async def page(request: Request) -> None:
        drawing = draw(context, dict(request.query_params))
        if drawing is not None:
            await drawing


def _add_export(context: DashboardContext) -> None:
    """Serve the alarms selected by an address as CSV."""

    def exported(request: Request) -> Response:
        selection = AlarmSelection.from_query(dict(request.query_params))
        chosen = selection.chosen(time.time_ns())
        try:
            events = context.history.alarms(chosen, selection.is_journal)
        except HistoryError as error:
            return Response(str(error), 503, media_type="text/plain")
        name = {"Content-Disposition": 'attachment; filename="alarms.csv"'}
        return Response(alarms_as_csv(events), media_type="text/csv", headers=name)

    app.add_api_route("/alarms.csv", exported, methods=["GET"])


_SANDBOX = "sandbox; default-src 'none'; img-src data:; style-src 'unsafe-inline'"
"""Policy for reports: they come from outside, so they run no script and load nothing."""


def _add_files(files: ValveFiles) -> None:
    """Serve reports and bags, only from their folders."""

    def offered(kind: str, path: str) -> Response:
        found = files.found(kind, path)
        if found is None:
            return Response("There is no such file.", 404, media_type="text/plain")
        is_page = found.suffix.lower() == ".html"
        headers = {"Content-Security-Policy": _SANDBOX, "X-Content-Type-Options": "nosniff"}
        return FileResponse(
            found,
            media_type="text/html" if is_page else "application/octet-stream",
            filename=None if is_page else found.name,
            headers=headers,
        )

    app.add_api_route(_FILES + "{kind}/{path:path}", offered, methods=["GET"])
