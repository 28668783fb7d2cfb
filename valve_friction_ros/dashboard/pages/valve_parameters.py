"""The parameters of a valve on its page, each with its interval, verdict and baseline."""

from valve_friction_ros.dashboard.heard.status_keys import Quantity
from valve_friction_ros.dashboard.heard.valve_view import ValveView
from valve_friction_ros.dashboard.pages.parts import chip, text
from valve_friction_ros.dashboard.pages.theme import element
from valve_friction_ros.dashboard.plant_rows import number_and_width, quantity_texts

__all__ = ["draw_parameters"]

_VERDICTS = {"identified": "ok", "weak": "warn", "not identifiable": "unknown", "fixed": "unknown"}
_TITLES = (("parameter", ""), ("value", "vf-n"), ("", "vf-width"), ("", ""), ("verdict", ""))


def draw_parameters(view: ValveView) -> None:
    """Draw a table of the parameters, or say why there are none."""
    if not view.parameters:
        text("p", view.reason or "There is no estimate yet.", "vf-none")
        return
    baseline = {one.name: one for one in view.baseline}
    with element("table", "vf-list vf-parameters"):
        with element("thead"), element("tr"):
            for title, css in _TITLES:
                text("th", title, css)
        with element("tbody"):
            for one in view.parameters:
                _draw_parameter(one)
                if one.name in baseline:
                    _draw_baseline(baseline[one.name])


def _draw_parameter(one: Quantity) -> None:
    value, width = quantity_texts(one)
    with element("tr"):
        text("td", one.name.replace("_", " "))
        text("td", value, "vf-n")
        text("td", width, "vf-width")
        text("td", one.unit, "vf-unit")
        with element("td"):
            chip(_VERDICTS.get(one.verdict, "unknown"), one.verdict or "–")
            if one.reason:
                text("small", one.reason, "vf-reason")


def _draw_baseline(one: Quantity) -> None:
    value, width = number_and_width(one.value, one.half_width)
    with element("tr", "vf-sub"):
        text("td", "baseline")
        text("td", value, "vf-n")
        text("td", width, "vf-width")
        text("td", "N", "vf-unit")
        text("td", "")
