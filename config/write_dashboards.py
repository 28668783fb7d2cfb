# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""Write the layouts of other dashboards for a valve: `python3 config/write_dashboards.py /fv_102`.

Foxglove's need `pip install foxglove-sdk==0.30.3`. The files go into the folder ``--output``.
"""

import argparse
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from pathlib import Path

from foxglove import layouts as fox

_BLUE, _ORANGE, _GREEN = "#0072B2", "#D55E00", "#009E73"
_ACTIONS = {"identify": "Identify", "set_baseline": "Set baseline", "save": "Save recording"}
_TRIGGER_TIMEOUT = 120.0


def _series(path: str, label: str, colour: str) -> fox.PlotSeries:
    return fox.PlotSeries(value=path, label=label, color=colour, timestamp_method="receiveTime")


def _plot(title: str, *series: fox.PlotSeries, seconds: float | None = 60.0) -> fox.PlotPanel:
    config = fox.PlotConfig(paths=list(series), show_legend=True, following_view_width=seconds)
    return fox.PlotPanel(title=title, config=config)


def _split(direction: str, *parts: tuple[float, object]) -> fox.SplitContainer:
    items = [fox.SplitItem(proportion=share, content=content) for share, content in parts]
    return fox.SplitContainer(direction=direction, items=items)


def _latest(valve: str, key: str) -> str:
    return f'{valve}/identifier/estimate.values[:]{{key=="{key}"}}.value'


def plant_layout() -> fox.Layout:
    """Return the layout of all valves: the worst first, one in detail, and the log."""
    summary = fox.DiagnosticsSummaryPanel(
        title="Valves",
        config=fox.DiagnosticsSummaryConfig(
            min_level=0, topic_to_render="/diagnostics", sort_by_level=True, seconds_until_stale=5
        ),
    )
    detail = fox.DiagnosticsDetailPanel(
        title="Valve",
        config=fox.DiagnosticsDetailConfig(topic_to_render="/diagnostics", seconds_until_stale=5),
    )
    right = _split("column", (3, detail), (1, fox.LogPanel(title="Log")))
    return fox.Layout(content=_split("row", (1, summary), (1, right)))


def valve_layout(valve: str) -> fox.Layout:
    """Return the layout of the valve in a namespace: signals, friction, diagnosis, buttons."""
    identifier = f"{valve}/identifier"
    pressure = _series(f"{valve}/actuator_pressure.fluid_pressure", "pressure [Pa]", _BLUE)
    stem = _series(f"{valve}/stem_state.position[0]", "stem [m]", _ORANGE)
    friction = _series(_latest(valve, "coulomb_friction [N]"), "Coulomb friction [N]", _GREEN)
    ratio = _series(_latest(valve, "friction_ratio"), "friction / baseline", _BLUE)
    detail = fox.DiagnosticsDetailPanel(
        title="Diagnosis",
        config=fox.DiagnosticsDetailConfig(
            selected_name=f"{identifier}: friction", topic_to_render="/diagnostics"
        ),
    )
    buttons = [
        (
            1,
            fox.ServiceCallPanel(
                title=words,
                config=fox.ServiceCallConfig(
                    service_name=f"{identifier}/{service}",
                    request_payload="{}",
                    button_text=words,
                    timeout_seconds=_TRIGGER_TIMEOUT,
                ),
            ),
        )
        for service, words in _ACTIONS.items()
    ]
    left = _split(
        "column",
        (1, _plot("Pressure", pressure)),
        (1, _plot("Stem", stem)),
        (1, _plot("Friction", friction, seconds=None)),
        (1, _plot("Friction ratio to baseline", ratio, seconds=None)),
    )
    return fox.Layout(
        content=_split("row", (2, left), (1, _split("column", (3, detail), *buttons)))
    )


def plotjuggler_layout(valve: str, tag: str, joint: str = "stem") -> str:
    """Return a layout of PlotJuggler 3 for the valve in a namespace, with its tag."""
    diagnosed = f"/diagnostics/{tag}/{valve}/identifier: friction"
    tabs = {
        "Signals": [
            {f"{valve}/actuator_pressure/fluid_pressure": _BLUE},
            {f"{valve}/stem_state/{joint}/position": _ORANGE},
        ],
        "Friction": [
            {f"{diagnosed}/coulomb_friction [N]": _GREEN},
            {f"{diagnosed}/friction_ratio": _BLUE, f"{diagnosed}/level": _ORANGE},
        ],
    }
    root = ET.Element("root")
    window = ET.SubElement(root, "tabbed_widget", name="Main Window", parent="main_window")
    for title, plots in tabs.items():
        tab = ET.SubElement(window, "Tab", tab_name=title, containers="1")
        share = ";".join([f"{1 / len(plots):g}"] * len(plots))
        splitter = ET.SubElement(
            ET.SubElement(tab, "Container"),
            "DockSplitter",
            orientation="-",
            sizes=share,
            count=str(len(plots)),
        )
        for curves in plots:
            area = ET.SubElement(splitter, "DockArea", name="...")
            plot = ET.SubElement(
                area, "plot", mode="TimeSeries", style="Lines", flip_x="false", flip_y="false"
            )
            ET.SubElement(plot, "limitY")
            for name, colour in curves.items():
                ET.SubElement(plot, "curve", name=name, color=colour)
    ET.SubElement(window, "currentTabIndex", index="0")
    ET.SubElement(root, "use_relative_time_offset", enabled="1")
    ET.indent(root)
    return ET.tostring(root, encoding="unicode", xml_declaration=True) + "\n"


def main(arguments: Sequence[str] | None = None) -> None:
    """Write the three files."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("valve", nargs="?", default="/fv_101", help="namespace (%(default)s)")
    parser.add_argument("--tag", help="its valve_tag, by default FV-101 of /fv_101")
    parser.add_argument("--joint", default="stem", help="name of its joint (%(default)s)")
    parser.add_argument("--output", type=Path, default=Path(__file__).parent, help="folder")
    options = parser.parse_args(arguments)
    valve = f"/{options.valve.strip('/')}"
    tag = options.tag or valve.rpartition("/")[2].upper().replace("_", "-")
    written = {
        "foxglove_plant.json": f"{plant_layout().to_json()}\n",
        "foxglove_valve.json": f"{valve_layout(valve).to_json()}\n",
        "plotjuggler_valve.xml": plotjuggler_layout(valve, tag, options.joint),
    }
    for name, text in written.items():
        (options.output / name).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
