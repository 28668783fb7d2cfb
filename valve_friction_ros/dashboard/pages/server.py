"""The server of the pages."""

import socket
from collections.abc import Callable

from fastapi import Request
from nicegui import app, run, ui

from valve_friction_ros.dashboard.board import Board
from valve_friction_ros.dashboard.pages.plant_page import plant_page
from valve_friction_ros.dashboard.pages.theme import load_style
from valve_friction_ros.dashboard.pages.valve_page import valve_page

__all__ = ["require_free", "serve"]

_GRACE = 1
"""Time, s, that open connections have at the end."""


def require_free(host: str, port: int) -> None:
    """Raise ValueError if an address cannot be listened at."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    with socket.socket(family) as tried:
        tried.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            tried.bind((host, port))
        except OSError as error:
            raise ValueError(
                f"{host}:{port} cannot be listened at ({error.strerror}): give another port"
            ) from None


def serve(board: Board, started: Callable[[], None]) -> None:
    """Serve the pages until Ctrl-C or SIGTERM; call `started` once they can be opened."""
    load_style()
    pages = {"/": plant_page, "/valve": valve_page}
    for path, draw in pages.items():
        _add_page(board, path, draw)

    async def begin() -> None:
        await run.io_bound(board.kept.refresh)
        started()

    app.on_startup(begin)
    ui.run(
        host=board.options.host,
        port=board.options.port,
        title="Valve friction",
        dark=None,
        language="en-US",
        reload=False,
        show=False,
        show_welcome_message=False,
        tailwind=False,
        binding_refresh_interval=None,
        reconnect_timeout=10.0,
        timeout_graceful_shutdown=_GRACE,
    )


def _add_page(board: Board, path: str, draw: Callable[[Board, dict[str, str]], None]) -> None:
    @ui.page(path)
    def page(request: Request) -> None:
        draw(board, dict(request.query_params))
