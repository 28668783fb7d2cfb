"""The history of one valve: its identifications, its baseline, its trend."""

from dataclasses import dataclass, field

from valve_friction_ros.health.baseline import Baseline
from valve_friction_ros.health.friction_monitor import MonitorSettings
from valve_friction_ros.history.alarm_rows import AlarmRecording, alarm_recordings
from valve_friction_ros.history.answer_rows import read_answers
from valve_friction_ros.history.entry import HistoryEntry, KeptBaseline, KeptValve
from valve_friction_ros.history.reader import History
from valve_friction_ros.history.trend import Trend, trend_of
from valve_friction_ros.history.usage_rows import read_usage
from valve_friction_ros.response import ResponseSummary, summarised
from valve_friction_ros.usage import ValveUsage

__all__ = ["ValveHistory", "current_trend", "valve_histories"]


@dataclass(frozen=True)
class ValveHistory:
    """Part of one valve's history.

    Attributes
    ----------
    valve : KeptValve
        The valve.
    entries : tuple of HistoryEntry
        Its identifications, oldest first; at least one.
    set_baseline : KeptBaseline or None
        The last baseline that was set; the trend begins with it.
    trend : Trend or None
        Drift of the results of the last method, against the last baseline and limits. Two methods
        may differ by themselves, so a trend uses the results of one method.
    baselines : tuple of KeptBaseline
        Each change of its baseline, oldest first, without records.
    usage : ValveUsage
        What the valve has done, at any time.
    alarms : tuple of AlarmRecording
        The recordings of its alarms, oldest first.
    response : ResponseSummary
        Its answers to steps of its command, with the travel of the last one.
    """

    valve: KeptValve
    entries: tuple[HistoryEntry, ...]
    set_baseline: KeptBaseline | None
    trend: Trend | None
    baselines: tuple[KeptBaseline, ...] = ()
    usage: ValveUsage = field(default_factory=ValveUsage)
    alarms: tuple[AlarmRecording, ...] = ()
    response: ResponseSummary = field(default_factory=lambda: summarised(()))


def valve_histories(
    history: History, valves: tuple[KeptValve, ...], since: int, until: int
) -> tuple[ValveHistory, ...]:
    """Read the histories of some valves from `since` to `until`, ns; empty histories are left out.

    Raises HistoryError if the file cannot be read.
    """
    found = []
    for valve in valves:
        entries = history.entries([valve.name], since, until)
        if not entries:
            continue
        kept = history.baseline(valve.name, until)
        baselines = history.baselines(valve.name, since, until)
        begin = since if kept is None else max(since, kept.since)
        last = entries[-1]
        same = (one for one in entries if one.time >= begin and one.method == last.method)
        points = [point for one in same if (point := one.point(last.baseline)) is not None]
        trend = trend_of(points, last.baseline, last.limits)
        usage = read_usage(history, valve.name)
        recorded = alarm_recordings(history, valve.name)
        alarms = tuple(one for one in recorded if since <= one.time < until)
        answers = read_answers(history, valve.name)
        response = summarised([one for one in answers if since <= one.stamp < until])
        found.append(ValveHistory(valve, entries, kept, trend, baselines, usage, alarms, response))
    return tuple(found)


def current_trend(
    history: History, valve: str, baseline: Baseline | None, settings: MonitorSettings
) -> Trend | None:
    """Return the trend of a valve since its baseline was last set, by the method in force.

    Raises HistoryError if the file cannot be read.
    """
    kept = history.baseline(valve)
    points = history.points(valve, settings.method_used, kept.since if kept else 0, baseline)
    return trend_of(points, baseline, settings.limits)
