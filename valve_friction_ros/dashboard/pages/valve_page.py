"""The page *Valve*: all that is known of one."""

from nicegui import ui

from valve_friction_ros.dashboard.board import Board

__all__ = ["valve_page"]


def valve_page(board: Board, query: dict[str, str]) -> None:
    """Draw the page."""
    ui.label(query.get("node", ""))
