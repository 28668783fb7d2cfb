"""The cards of the page *Valve* that show its history."""

from collections.abc import Callable
from datetime import datetime, timezone
from urllib.parse import quote
from zoneinfo import ZoneInfo

from nicegui import ui

from valve_friction_ros.dashboard.pages.parts import table, text
from valve_friction_ros.dashboard.pages.theme import element
from valve_friction_ros.dashboard.plant_rows import number_and_width
from valve_friction_ros.dashboard.times import moment
from valve_friction_ros.dashboard.valve_files import OfferedFile
from valve_friction_ros.health import Baseline
from valve_friction_ros.history import HistoryEntry, ValveHistory
from valve_friction_ros.outside_text import printable

__all__ = ["baseline_words", "draw_alarms", "draw_baselines", "draw_files", "draw_identifications"]

_MOST = 60


def baseline_words(baseline: Baseline | None) -> str:
    """Return a baseline in words."""
    return "none" if baseline is None else str(baseline)


def _friction(entry: HistoryEntry) -> str:
    for name in ("coulomb_friction", "sliding_friction"):
        one = entry.parameters.get(name)
        if one is not None and one.value == one.value:
            return " ".join(number_and_width(one.value, one.half_width)).strip()
    return "–"


def draw_identifications(
    history: ValveHistory | None, zone: ZoneInfo, compare: Callable[[int], str]
) -> None:
    """Draw the identifications, the newest first, each with a link to compare it."""
    if history is None:
        text("p", "No identification is kept of this valve.", "vf-none")
        return
    with element("table", "vf-list"):
        with element("thead"), element("tr"):
            for title, css in (("time", ""), ("level", ""), ("friction, N", "vf-n"),
                               ("ratio", "vf-n"), ("diagnosis", ""), ("", "")):  # fmt: skip
                text("th", title, css).props["scope"] = "col"
        with element("tbody"):
            for entry in reversed(history.entries[-_MOST:]):
                ratio = entry.diagnosis.ratio
                with element("tr"):
                    text("td", moment(entry.time, zone), "vf-when")
                    text("td", "refused" if entry.refusal else entry.diagnosis.level.name)
                    text("td", _friction(entry), "vf-n")
                    text("td", "–" if ratio is None else f"{ratio.value:.2f}", "vf-n")
                    words = entry.refusal or entry.diagnosis.message
                    text("td", printable(words, 300), "vf-words")
                    with element("td"), element("a", "vf-link", href=compare(entry.time)) as link:
                        ui.label("compare")
                        link.props["aria-label"] = f"Compare the one of {moment(entry.time, zone)}"
    if len(history.entries) > _MOST:
        text("p", f"The latest {_MOST} of {len(history.entries)}.", "vf-none")


def draw_baselines(history: ValveHistory | None, zone: ZoneInfo) -> None:
    """Draw each change of the baseline, the newest first."""
    if history is None or not history.baselines:
        text("p", "No baseline was set.", "vf-none")
        return
    table(
        ("time", "from then on", "before"),
        [
            (
                moment(one.time, zone),
                baseline_words(one.in_force),
                baseline_words(one.replaced),
            )
            for one in reversed(history.baselines[-_MOST:])
        ],
    )


def draw_alarms(history: ValveHistory | None, zone: ZoneInfo) -> None:
    """Draw the recorded alarms, the newest first."""
    if history is None or not history.alarms:
        text("p", "No alarm was recorded.", "vf-none")
        return
    table(
        ("time", "level", "diagnosis", "recording"),
        [
            (
                moment(one.time, zone),
                one.level.name,
                printable(one.message, 300),
                printable(one.path.name, 120),
            )
            for one in reversed(history.alarms[-_MOST:])
        ],
    )


def draw_files(files: list[OfferedFile], zone: ZoneInfo) -> None:
    """Draw links to reports and bags."""
    if not files:
        text(
            "p", "No report and no recording is in the folders that the dashboard knows.", "vf-none"
        )
        return
    with element("table", "vf-list"), element("tbody"):
        for one in files:
            when = datetime.fromtimestamp(one.time, timezone.utc).astimezone(zone)
            with element("tr"), element("td", "vf-words"):
                address = f"/files/{quote(one.kind)}/{quote(one.path)}"
                with element("a", "vf-link", href=address, target="_blank", rel="noopener"):
                    ui.label(one.label)
                about = f"{one.kind}, {one.size / 1e6:.2f} MB"
                text("small", f"{about}, {when:%Y-%m-%d %H:%M} {when.tzname()}", "vf-about")
