"""The whole valve against its baseline, as a table of a report."""

from valve_friction_ros.health import Change, Measured, valve_changes
from valve_friction_ros.health.valve_changes import DIFFERENCES
from valve_friction_ros.identification import PARAMETER_UNITS, two_digits
from valve_friction_ros.reports.identified_record import IdentifiedRecord
from valve_friction_ros.reports.page import Column, Table

__all__ = ["valve_table"]


def valve_table(record: IdentifiedRecord) -> Table | None:
    """Return each number that result and baseline both have, with its change; None without one."""
    if record.baseline is None:
        return None
    drive = "Pa" if record.recording.driven_by.unit == "kPa" else "N"
    units = {**PARAMETER_UNITS, **DIFFERENCES, "drive_noise": drive, "stem_noise": "m"}
    now, healthy = record.numbers, record.baseline.numbers
    rows = tuple(
        (
            f"{name.replace('_', ' ')} [{units[name]}]",
            _size(healthy[name]),
            _size(now[name]),
            _change(change, is_ratio=name not in DIFFERENCES),
        )
        for name, change in valve_changes(now, healthy).items()
    )
    titles = ("number", "healthy valve (baseline)", "now", "change, 95 % interval")
    return Table(tuple(map(Column, titles)), rows) if rows else None


def _size(one: Measured) -> str:
    return f"{one.value:.5g} ± {two_digits(one.half_width)}"


def _change(change: Change, is_ratio: bool) -> str:
    if is_ratio:
        return f"{change.value:.3g} times, {change.low:.3g} to {change.high:.3g}"
    return f"{change.value:+.3g}, {change.low:+.3g} to {change.high:+.3g}"
