"""The element that draws the valves of a plant in the browser."""

from collections.abc import Mapping
from typing import Any

from nicegui import ui

__all__ = ["AddressBar", "PlantTable"]


class PlantTable(ui.element, component="plant_table.js"):
    """Rows or tiles; the browser keeps them, and is sent what has changed.

    Parameters
    ----------
    initial : mapping
        All rows and the order.
    columns : list of dict
        Columns of the table: key, title, unit, sort and css of each.
    """

    def __init__(self, initial: Mapping[str, Any], columns: list[dict[str, str]]) -> None:
        super().__init__()
        self._props["initial"] = dict(initial)
        self._props["columns"] = columns

    def send(self, news: Mapping[str, Any]) -> None:
        """Send what has changed: ``now``, and at will ``rows``, ``order`` and the view."""
        self.run_method("update", dict(news))


class AddressBar(ui.element, component="address.js"):
    """The address of the page, which holds its state."""

    def show(self, address: str) -> None:
        """Show another address without loading it."""
        self.run_method("replace", address)
