"""All parameters of the dashboard."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from valve_friction_ros.dashboard import DashboardOptions
from valve_friction_ros.dashboard.access import Access, accounts_from
from valve_friction_ros.history import server_from
from valve_friction_ros.nodes.plumbing.output_folder import folder_of
from valve_friction_ros.nodes.plumbing.parameters import ParameterSpec
from valve_friction_ros.records.data_folder import history_file

__all__ = ["PARAMETERS", "options_from"]

_USUAL = DashboardOptions()

PARAMETERS = (
    ParameterSpec(
        "host",
        _USUAL.access.host,
        "Address that it listens at [-]; any but this machine's own needs accounts",
        read_only=True,
    ),
    ParameterSpec(
        "host_names",
        "",
        "Names that browsers call it by, beside its address, separated by commas [-]",
        read_only=True,
    ),
    ParameterSpec(
        "accounts_file",
        "",
        "File of accounts, by `valve_friction dashboard-account` [-]; empty: the environment's",
        read_only=True,
    ),
    ParameterSpec(
        "certificate_file", "", "Certificate for TLS, in PEM [-]; empty: no TLS", read_only=True
    ),
    ParameterSpec("key_file", "", "Key of the certificate, in PEM [-]", read_only=True),
    ParameterSpec(
        "session_hours",
        _USUAL.access.session_hours,
        "Time after which a log-in ends [h]",
        (0.1, 10000.0),
        True,
    ),
    ParameterSpec(
        "session_file",
        "",
        "File in which log-ins survive a restart [-]; empty: they do not",
        read_only=True,
    ),
    ParameterSpec("port", _USUAL.port, "Port that it listens at [-]", (1, 65535), True),
    ParameterSpec(
        "history_file",
        str(history_file()),
        "File of the identifiers' history, which is read [-]; empty: none",
        read_only=True,
    ),
    ParameterSpec(
        "history_url",
        "",
        "PostgreSQL server of the identifiers' histories, which is read in place of the file [-]; "
        "empty: that of the environment, VALVE_FRICTION_HISTORY_URL. No password belongs here",
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
    """Return the options that parameters give; raises ValueError or OSError for wrong ones."""

    def file(name: str) -> Path | None:
        return Path(values[name]).expanduser() if values[name] else None

    return DashboardOptions(
        access=Access(
            host=values["host"],
            host_names=tuple(filter(None, map(str.strip, values["host_names"].split(",")))),
            accounts=accounts_from(file("accounts_file")),
            certificate=file("certificate_file"),
            key=file("key_file"),
            session_hours=values["session_hours"],
            session_file=file("session_file"),
        ),
        port=values["port"],
        history=server_from(values["history_url"]) or file("history_file"),
        reports=folder_of(values["report_folder"], "reports"),
        bags=folder_of(values["save_folder"], "saved"),
        alarms=folder_of(values["alarm_folder"], "alarms"),
        time_zone=values["time_zone"],
        silence=values["silence"],
    )
