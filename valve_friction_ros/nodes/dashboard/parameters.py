"""All parameters of the dashboard."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from valve_friction_ros.dashboard import DashboardOptions
from valve_friction_ros.nodes.plumbing.parameters import ParameterSpec
from valve_friction_ros.records.data_folder import data_folder, history_file

__all__ = ["PARAMETERS", "options_from"]

_USUAL = DashboardOptions()

PARAMETERS = (
    ParameterSpec("host", _USUAL.host, "Address that it listens at [-]", read_only=True),
    ParameterSpec("port", _USUAL.port, "Port that it listens at [-]", (1, 65535), True),
    ParameterSpec(
        "history_file",
        str(history_file()),
        "File of the identifiers' history, which is read [-]; empty: none",
        read_only=True,
    ),
    ParameterSpec(
        "time_zone",
        _USUAL.time_zone,
        "Zone of the times, an IANA name such as Europe/Berlin [-]",
        read_only=True,
    ),
    ParameterSpec(
        "silence",
        _USUAL.silence,
        "Time without a message after which a valve counts as silent [s]",
        (1.5, 86400.0),
        True,
    ),
    ParameterSpec(
        "report_folder",
        "",
        "Folder of the identifiers' reports, which it offers [-]; empty: the usual one",
        read_only=True,
    ),
    ParameterSpec(
        "save_folder",
        "",
        "Folder of the identifiers' bags, which it offers [-]; empty: the usual one",
        read_only=True,
    ),
    ParameterSpec(
        "alarm_folder",
        "",
        "Folder of the recordings of alarms, which it offers [-]; empty: the usual one",
        read_only=True,
    ),
)


def options_from(values: Mapping[str, Any]) -> DashboardOptions:
    """Return the options that parameters give; raises ValueError for impossible ones."""

    def folder(name: str, usual: str) -> Path:
        return Path(values[name]) if values[name] else data_folder() / usual

    kept = values["history_file"]
    return DashboardOptions(
        host=values["host"],
        port=values["port"],
        history_file=Path(kept).expanduser() if kept else None,
        reports=folder("report_folder", "reports").expanduser(),
        bags=folder("save_folder", "saved").expanduser(),
        alarms=folder("alarm_folder", "alarms").expanduser(),
        time_zone=values["time_zone"],
        silence=values["silence"],
    )
