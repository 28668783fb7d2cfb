"""What a history tells of one valve: its identifications, its baseline, its trend."""

from dataclasses import dataclass

from valve_friction_ros.monitoring.baseline import Baseline
from valve_friction_ros.monitoring.diagnosis import FrictionLimits
from valve_friction_ros.monitoring.history_entry import HistoryEntry, KeptBaseline, KeptValve
from valve_friction_ros.monitoring.history_file import HistoryFile
from valve_friction_ros.monitoring.trend import Trend, trend_of

__all__ = ["ValveHistory", "current_trend", "valve_histories"]


@dataclass(frozen=True)
class ValveHistory:
    """A stretch of one valve's history.

    Attributes
    ----------
    valve : KeptValve
        The valve.
    entries : tuple of HistoryEntry
        Its identifications, oldest first; at least one.
    set_baseline : KeptBaseline or None
        The last baseline that was set; the trend begins with it.
    trend : Trend or None
        Drift against the baseline and the limits that were in force last.
    """

    valve: KeptValve
    entries: tuple[HistoryEntry, ...]
    set_baseline: KeptBaseline | None
    trend: Trend | None


def valve_histories(
    history: HistoryFile, valves: tuple[KeptValve, ...], since: int, until: int
) -> tuple[ValveHistory, ...]:
    """Read the histories of some valves from `since` to `until`, ns; those without any left out.

    Raises
    ------
    HistoryError
        If the file cannot be read.
    """
    found = []
    for valve in valves:
        entries = history.entries([valve.name], since, until)
        if not entries:
            continue
        kept = history.baseline(valve.name, until)
        begin = since if kept is None else max(since, kept.since)
        points = [entry.point() for entry in entries if entry.time >= begin]
        trend = trend_of(
            [point for point in points if point is not None],
            entries[-1].baseline,
            entries[-1].limits,
        )
        found.append(ValveHistory(valve, entries, kept, trend))
    return tuple(found)


def current_trend(
    history: HistoryFile, valve: str, baseline: Baseline | None, limits: FrictionLimits
) -> Trend | None:
    """Return the trend of a valve since its baseline was last set.

    Raises
    ------
    HistoryError
        If the file cannot be read.
    """
    kept = history.baseline(valve)
    points = history.points(valve, kept.since) if kept else history.points(valve)
    return trend_of(points, baseline, limits)
