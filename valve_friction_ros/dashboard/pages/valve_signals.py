"""The signals of a valve while its page is open: over time, and the stem over the pressure."""

from nicegui import ui

from valve_friction_ros.dashboard.charts import live_chart, live_data, loop_chart, loop_data
from valve_friction_ros.dashboard.heard.live_strip import LiveStrip
from valve_friction_ros.dashboard.pages.parts import retitle, text
from valve_friction_ros.history import ValveHistory

__all__ = ["ValveSignals"]

_COLUMNS = 500
_LOOP = 1200
_EVERY = 5
"""Times that the strip is drawn between two times that the signature is."""


class ValveSignals:
    """Both charts of the signals; only what has changed is sent.

    Parameters
    ----------
    strip : LiveStrip
        The signals.
    """

    def __init__(self, strip: LiveStrip) -> None:
        self._strip = strip
        self._drawn = (0, 0)
        self._shown = self._looped = 0
        self._loop: ui.echart | None = None

    def draw(self) -> None:
        """Draw the signals over time, still without any."""
        self._live = ui.echart(live_chart(self._strip.span)).classes("vf-chart-live")
        self._live.props["aria-label"] = "Pressure and stem of the last 60 seconds"
        self._note = text("p", "No sample has come yet.", "vf-none")

    def draw_signature(self, kept: ValveHistory | None) -> None:
        """Draw the signature of the baseline; that of now follows."""
        healthy = None if kept is None else kept.set_baseline
        record = None if healthy is None else healthy.record
        self._loop = ui.echart(loop_chart(record)).classes("vf-chart-loop")
        self._loop.props["aria-label"] = "Signature: stem over pressure"
        self._drawn, self._looped = (-1, 0), self._shown - _EVERY
        if record is None:
            text("p", "The record of the baseline is not kept.", "vf-none")

    def show(self) -> None:
        """Show what has come since the last time."""
        self._shown += 1
        note = self._strip.note()
        retitle(self._note, note)
        self._note.set_visibility(bool(note))
        revision = self._strip.revision
        if revision == self._drawn:
            return
        self._drawn = revision
        pressure, stem = self._strip.strips(_COLUMNS)
        self._live.run_chart_method("setOption", {"series": live_data(pressure, stem)})
        if self._loop is not None and self._looped + _EVERY <= self._shown:
            self._looped = self._shown
            loop = loop_data(self._strip.loop(_LOOP))
            self._loop.run_chart_method("setOption", {"series": [{}, {"data": loop}]})
