"""What `identify-folder` prints at its end."""

from collections.abc import Iterable, Mapping

from rich.table import Table

from valve_friction_ros.commands.output.formatting import OutputConsole
from valve_friction_ros.fleet import REFUSED, Tally, ranked, reaches
from valve_friction_ros.fleet.row import Cell
from valve_friction_ros.health import Level

__all__ = ["print_alarms", "print_tally"]

_SHOWN_REASONS = 10
_SHOWN_ALARMS = 10


def print_tally(counted: Tally) -> None:
    """Print how many valves were identified or refused, and why."""
    console = OutputConsole(highlight=False, markup=False)
    table = Table("Coulomb friction", "valves", box=None, header_style="bold")
    table.columns[1].justify = "right"
    for outcome, count in sorted(counted.outcomes.items(), key=lambda one: one[0] == REFUSED):
        table.add_row(outcome, str(count))
    console.print(table)
    reasons = counted.reasons()
    for reason in reasons[:_SHOWN_REASONS]:
        console.print(
            f"{reason.count:>6} refused: {reason.text} (for example {reason.example})",
            soft_wrap=True,
        )
    if len(reasons) > _SHOWN_REASONS:
        console.print(f"       and for {len(reasons) - _SHOWN_REASONS} more reasons")


def print_alarms(rows: Iterable[Mapping[str, Cell]]) -> None:
    """Print the valves that need attention, the first of them first."""
    console = OutputConsole(highlight=False, markup=False)
    alarms = [row for row in ranked(rows) if reaches(row, Level.WARN)]
    for row in alarms[:_SHOWN_ALARMS]:
        name = " ".join(filter(None, (str(row["recording"]), str(row["valve"]))))
        console.print(f"{row['level']:>6} {name}: {row['message']}", soft_wrap=True)
    if len(alarms) > _SHOWN_ALARMS:
        console.print(f"       and {len(alarms) - _SHOWN_ALARMS} more")
