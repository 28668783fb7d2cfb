# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Cards of the page *Valve*: parameters, signals, trend and history."""

import json
import time
from collections.abc import Callable, Sequence
from datetime import datetime, timezone
from typing import Any
from zoneinfo import ZoneInfo

from nicegui import ui

from valve_friction_ros.dashboard.charts import (
    DRAG_TO_ZOOM,
    WHOLE_AXIS,
    live_chart,
    live_data,
    loop_chart,
    loop_data,
    trend_chart,
    zoomed,
)
from valve_friction_ros.dashboard.context import OfferedFile
from valve_friction_ros.dashboard.live_state import Quantity, ValveView
from valve_friction_ros.dashboard.live_strip import LiveStrip
from valve_friction_ros.dashboard.pages.alarm_page import RANGES
from valve_friction_ros.dashboard.pages.theme import (
    chip,
    element,
    link,
    table,
    table_head,
    table_row,
    text,
)
from valve_friction_ros.dashboard.plant_rows import FRICTIONS, moment, quantity_texts
from valve_friction_ros.health.alarms import AlarmEvent
from valve_friction_ros.history import HistoryEntry, ValveHistory, drift_text
from valve_friction_ros.outside_text import printable
from valve_friction_ros.streams import utc_day
from valve_friction_ros.wording import capitalised, name_in_words, number_and_width

_VERDICTS = {"identified": "ok", "weak": "warn", "not identifiable": "unknown", "fixed": "unknown"}
_TITLES = (("parameter", ""), ("value", "vf-n"), ("", "vf-width"), ("", ""), ("verdict", ""))


def draw_parameters(view: ValveView) -> None:
    """Draw a table of the parameters, or say why there are none."""
    if not view.parameters:
        text("p", view.reason or "No estimate yet.", "vf-none")
        return
    baseline = {one.name: one for one in view.baseline}
    with element("table", "vf-list vf-parameters"):
        table_head(*_TITLES)
        with element("tbody"):
            for one in view.parameters:
                _draw_parameter(one)
                if one.name in baseline:
                    _draw_baseline(baseline[one.name])


def _draw_parameter(one: Quantity) -> None:
    value, width = quantity_texts(one)
    shown = ((value, "vf-n"), (width, "vf-width"), (one.unit, "vf-unit"))
    with table_row((name_in_words(one.name), ""), *shown), element("td"):
        chip(_VERDICTS.get(one.verdict, "unknown"), one.verdict or "–")
        if one.reason:
            text("small", one.reason, "vf-reason")


def _draw_baseline(one: Quantity) -> None:
    value, width = number_and_width(one.value, one.half_width)
    shown = ((value, "vf-n"), (width, "vf-width"), ("N", "vf-unit"), ("", ""))
    table_row(("baseline", ""), *shown, css="vf-sub")


_STRIP_COLUMNS = 500
_LOOP_POINTS = 1200
_SIGNATURE_EVERY = 5
"""Number of strip updates per update of the signature."""


class ValveSignals:
    """Both charts of the signals; only changes are sent."""

    def __init__(self, strip: LiveStrip) -> None:
        self._strip = strip
        self._drawn = (0, 0)
        self._shown = self._looped = 0
        self._loop: ui.echart | None = None

    def draw(self) -> None:
        """Draw the empty chart of the signals over time."""
        words = "Pressure and stem of the last 60 seconds"
        self._live = _chart(live_chart(self._strip.span), "vf-chart-live", words)
        self._note = text("p", "No samples have been received yet.", "vf-none")

    def draw_signature(self, kept: ValveHistory | None) -> None:
        """Draw the signature of the baseline; the present signature follows."""
        healthy = None if kept is None else kept.set_baseline
        record = None if healthy is None else healthy.record
        self._loop = _chart(loop_chart(record), "vf-chart-loop", "Signature: stem over pressure")
        self._drawn, self._looped = (-1, 0), self._shown - _SIGNATURE_EVERY
        if record is None:
            text("p", "No recording of the baseline is stored.", "vf-none")

    def show(self) -> None:
        """Show the samples that have arrived since the last call."""
        self._shown += 1
        note = self._strip.note()
        self._note.set_text(note)
        self._note.set_visibility(bool(note))
        revision = self._strip.revision
        if revision == self._drawn:
            return
        self._drawn = revision
        pressure, stem = self._strip.strips(_STRIP_COLUMNS)
        self._live.run_chart_method("setOption", {"series": live_data(pressure, stem)})
        if self._loop is not None and self._looped + _SIGNATURE_EVERY <= self._shown:
            self._looped = self._shown
            loop = loop_data(self._strip.loop(_LOOP_POINTS))
            self._loop.run_chart_method("setOption", {"series": [{}, {"data": loop}]})


def draw_trend(
    kept: ValveHistory | None,
    problem: str | None,
    zone: ZoneInfo,
    events: Sequence[AlarmEvent] = (),
) -> None:
    """Draw friction over time with alarm events and trend, or say why there is none."""
    if problem:
        text("p", problem, "vf-none")
    if kept is None:
        if not problem:
            text("p", "The history contains no identification of this valve.", "vf-none")
        return
    buttons: dict[int | None, ui.element] = {}
    with element("div", "vf-filters", role="group", aria_label="Time range"):
        for name, span in {**RANGES, "all": None}.items():
            pressed = str(span is None).lower()
            buttons[span] = text("button", name, "vf-filter", type="button", aria_pressed=pressed)
            buttons[span].on("click", lambda span=span: show(span))

    def press(chosen: ui.element | None) -> None:
        for one in buttons.values():
            one.props["aria-pressed"] = str(one is chosen).lower()

    def show(span: int | None) -> None:
        press(buttons[span])
        chart.run_chart_method("setOption", zoomed(time.time_ns(), span, zone))
        chart.run_chart_method("dispatchAction", WHOLE_AXIS)

    drawn = trend_chart(kept, zone, time.time_ns(), events)
    chart = _chart(drawn, "vf-chart-trend", "Friction over time")
    # Once the chart is drawn, a drag selects a time range, like the toolbox icon.
    chart.on(
        "chart:finished",
        js_handler=f"() => {{ const one = getElement({chart.id}); if (!one.drags) {{"
        f"one.drags = true; one.chart.dispatchAction({json.dumps(DRAG_TO_ZOOM)}) }} }}",
    )
    chart.on("chart:datazoom", lambda: press(None), js_handler="(e) => { if (e.batch) emit() }")
    text("p", _trend_words(kept), "vf-trend-words")


def _chart(options: dict[str, Any], css: str, words: str) -> ui.echart:
    """Draw a chart, presented as a picture to screen readers."""
    made = ui.echart(options).classes(css)
    made.props["role"], made.props["aria-label"] = "img", words
    return made


def _trend_words(kept: ValveHistory) -> str:
    trend = kept.trend
    if trend is None:
        return "No trend yet: it needs estimates from at least four days since the baseline."
    if not trend.is_significant:
        return f"No significant drift of the {trend.what} in {trend.days} days with estimates."
    words = f"{capitalised(trend.what)}: {drift_text(trend)}"
    if trend.crossing is None:
        return f"{words}."
    early, late = map(utc_day, (trend.crossing.earliest, trend.crossing.latest))
    return f"{words} (95 %: {early} to {late})."


_MOST_ROWS = 60
_MOST_IDENTIFICATIONS = 20
"""Largest number of rows. Chosen: 50 identifications take a tenth of a second more."""


def _friction(entry: HistoryEntry) -> str:
    """Write the friction that was compared with the baseline, or another known friction."""
    ratio = entry.diagnosis.ratio
    for name in (*([ratio.of] if ratio else []), *FRICTIONS):
        one = entry.parameters.get(name)
        if one is not None and one.value == one.value:
            words = (*number_and_width(one.value, one.half_width), FRICTIONS[name])
            return " ".join(filter(None, words))
    return "–"


def draw_identifications(
    history: ValveHistory | None, zone: ZoneInfo, compare: Callable[[int], str]
) -> None:
    """Draw the identifications, the newest first, each with a link to its comparison."""
    if history is None:
        text("p", "The history contains no identification of this valve.", "vf-none")
        return
    with element("table", "vf-list"):
        table_head(("time", ""), ("level", ""), ("friction, N", "vf-n"), ("ratio", "vf-n"),
                   ("diagnosis", ""), ("more", ""))  # fmt: skip
        with element("tbody"):
            for entry in reversed(history.entries[-_MOST_IDENTIFICATIONS:]):
                ratio, when = entry.diagnosis.ratio, moment(entry.time, zone)
                row = table_row(
                    (when, "vf-when"),
                    ("refused" if entry.refusal else entry.diagnosis.level.name, ""),
                    (_friction(entry), "vf-n"),
                    ("–" if ratio is None else f"{ratio.value:.2f}", "vf-n"),
                    (printable(entry.refusal or entry.diagnosis.message, 300), "vf-words"),
                )
                with row, element("td"):
                    made = link("compare", compare(entry.time), "vf-link")
                    made.props["aria-label"] = f"Compare the identification of {when}"
    if len(history.entries) > _MOST_IDENTIFICATIONS:
        shown = f"The latest {_MOST_IDENTIFICATIONS} of {len(history.entries)}"
        text("p", f"{shown}; Compare shows the others.", "vf-none")


def draw_baselines(history: ValveHistory | None, zone: ZoneInfo) -> None:
    """Draw each change of the baseline, the newest first."""
    if history is None or not history.baselines:
        text("p", "No baseline has been set yet.", "vf-none")
        return
    table(
        ("time", "new baseline", "previous baseline"),
        (
            (moment(one.time, zone), str(one.in_force or "none"), str(one.replaced or "none"))
            for one in reversed(history.baselines[-_MOST_ROWS:])
        ),
    )


def draw_alarms(history: ValveHistory | None, zone: ZoneInfo) -> None:
    """Draw the recorded alarms, the newest first."""
    if history is None or not history.alarms:
        text("p", "No alarm has been recorded.", "vf-none")
        return
    table(
        ("time", "level", "diagnosis", "recording"),
        (
            (
                moment(a.time, zone),
                a.level.name,
                printable(a.message, 300),
                printable(a.path.name, 120),
            )
            for a in reversed(history.alarms[-_MOST_ROWS:])
        ),
    )


def draw_files(files: list[OfferedFile], zone: ZoneInfo) -> None:
    """Draw links to reports and bags."""
    if not files:
        words = "There are no reports or recordings in the dashboard's folders."
        text("p", words, "vf-none")
        return
    with element("table", "vf-list"), element("tbody"):
        for one in files:
            when = datetime.fromtimestamp(one.time, timezone.utc).astimezone(zone)
            with element("tr"), element("td", "vf-words"):
                link(one.label, one.address, "vf-link", target="_blank", rel="noopener")
                size = f"{one.size / 1e6:.1f} MB" if one.size >= 1e6 else f"{one.size / 1e3:.0f} kB"
                about = f"{one.kind}, {size}"
                text("small", f"{about}, {when:%Y-%m-%d %H:%M} {when.tzname()}", "vf-about")
