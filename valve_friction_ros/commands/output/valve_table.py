"""The table of one valve, under its name."""

from rich.table import Table

from valve_friction_ros.history import KeptValve
from valve_friction_ros.outside_text import printable

__all__ = ["valve_table"]


def valve_table(valve: KeptValve, *columns: str) -> Table:
    """Return an empty table with these columns, titled by tag and name of the valve."""
    tag = f"{valve.tag} " if valve.tag else ""
    return Table(
        *columns,
        box=None,
        header_style="bold",
        title=printable(f"{tag}{valve.name}"),
        title_justify="left",
    )
