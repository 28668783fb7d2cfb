"""Parameters of the identifier for a valve in service: changes, command, alerts, usage, alarms."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from valve_friction_ros.alerts import Secrets, Webhook
from valve_friction_ros.health import ValveLimits
from valve_friction_ros.nodes.plumbing.parameters import ParameterSpec
from valve_friction_ros.response import ResponseLimits
from valve_friction_ros.usage import DEFAULT_BAND

__all__ = [
    "AIR_TO",
    "ALARM_FOLDER",
    "ALARM_MEGABYTES",
    "ALARM_PAUSE",
    "ALARM_RECORDING",
    "ALARM_RECORDINGS",
    "COMMAND_UNIT",
    "COUNTING_DEAD_BAND",
    "RESPONSE_LIMITS",
    "REVERSAL_LIMIT",
    "SERVICE_PARAMETERS",
    "TRAVEL",
    "TRAVEL_LIMIT",
    "VALVE_LIMITS",
    "WEBHOOK_PERIOD",
    "WEBHOOK_URL",
    "response_limits",
    "webhook_from",
]

TRAVEL = "travel"
"""Name of a parameter of `VALVE_PARAMETERS`."""
COMMAND_UNIT = ParameterSpec(
    "command_unit",
    "m",
    "Unit of stem_command [-]: m, or % of the travel",
    choices=("m", "%"),
)
RESPONSE_LIMITS = (
    ParameterSpec(
        "deviation_limit",
        0.0,
        "Median distance of the resting stem from its command that warns [% of the travel]; "
        "0: none",
        (0.0, 100.0),
    ),
    ParameterSpec(
        "dead_time_limit",
        0.0,
        "Median time from a step of the command to the first movement that warns [s]; 0: none",
        (0.0, 3600.0),
    ),
    ParameterSpec(
        "t86_limit",
        0.0,
        "Median time from a step of the command to 86.5 % of the move that warns [s]; 0: none",
        (0.0, 3600.0),
    ),
)
WEBHOOK_URL = ParameterSpec(
    "webhook_url",
    "",
    "Address that each change of the level is posted to [-], https, or http to this machine; "
    "empty: that of the environment, VALVE_FRICTION_WEBHOOK_URL, or nowhere. No secret belongs "
    "into it: everybody on the ROS graph can read it. No token is sent there",
    read_only=True,
)
WEBHOOK_PERIOD = ParameterSpec(
    "webhook_period",
    60.0,
    "Least time from one posted change of the level to the next [s]; then the newest level counts",
    (0.0, 86400.0),
)
COUNTING_DEAD_BAND = ParameterSpec(
    "counting_dead_band",
    DEFAULT_BAND,
    "Dead band of travelled distance, reversals and breakaways, as a share of the travel [-]; "
    "raised where the sensor's noise or resolution demands more",
    (1e-6, 0.5),
)
AIR_TO = ParameterSpec(
    "air_to",
    "open",
    "Where the seat is [-]: open, air opens the valve, at position 0; close, at the travel",
    choices=("open", "close"),
)
TRAVEL_LIMIT = ParameterSpec(
    "travel_limit", 0.0, "Travelled distance of the life of a packing [m]; 0: no limit", (0.0, 1e9)
)
REVERSAL_LIMIT = ParameterSpec(
    "reversal_limit", 0.0, "Reversals of the life of a packing [-]; 0: no limit", (0.0, 1e12)
)
USAGE_PARAMETERS = (COUNTING_DEAD_BAND, AIR_TO, TRAVEL_LIMIT, REVERSAL_LIMIT)

ALARM_RECORDING = ParameterSpec(
    "alarm_recording",
    10.0,
    "Time from a rise of the level until the buffer before and after it is saved [s]; 0: never",
    (0.0, 600.0),
)
ALARM_FOLDER = ParameterSpec(
    "alarm_folder",
    "",
    "Folder of these recordings [-]; empty: valve_friction_ros/alarms under ROS_HOME, or under "
    "~/.ros; a relative one is in valve_friction_ros there",
    read_only=True,
)
ALARM_RECORDINGS = ParameterSpec(
    "alarm_recordings",
    20,
    "Recordings of a valve that are kept, the latest [-]",
    (1, 100_000),
    read_only=True,
)
ALARM_MEGABYTES = ParameterSpec(
    "alarm_megabytes",
    200.0,
    "Room that the recordings of a valve may take [MB]",
    (0.001, 1e6),
    read_only=True,
)
ALARM_PAUSE = ParameterSpec(
    "alarm_pause",
    600.0,
    "Time after a recording in which only a higher level is recorded [s]",
    (0.0, 31_557_600.0),
)
ALARM_PARAMETERS = (
    ALARM_RECORDING,
    ALARM_FOLDER,
    ALARM_RECORDINGS,
    ALARM_MEGABYTES,
    ALARM_PAUSE,
)
_CHANGES = {
    "spring_change": "Change of the spring constant, as a share, worth maintenance [-]",
    "spring_failure": "Change of the spring constant, as a share, that is a failure [-]",
    "preload_change": "Shift of the preload over the spring's force in the travel, reported [-]",
    "slip_change": "Growth of the slip jump, as a share of the travel, reported [-]",
    "viscous_factor": "Factor of the viscous friction, up or down, reported [-]",
    "asymmetry_change": "Change of viscous friction up against down, as a share, reported [-]",
    "stop_change": "Shift of a travel stop, as a share of the travel, reported [-]",
    "noise_factor": "Factor of the noise of a sensor, reported [-]",
    "lag_change": "Change of the lag of the stem behind the pressure, reported [s]",
}
VALVE_LIMITS = tuple(
    ParameterSpec(name, value, f"{_CHANGES[name]}, against the baseline", (0.0, 1e3))
    for name, value in asdict(ValveLimits()).items()
)

SERVICE_PARAMETERS = (
    *VALVE_LIMITS,
    COMMAND_UNIT,
    *RESPONSE_LIMITS,
    WEBHOOK_URL,
    WEBHOOK_PERIOD,
    *USAGE_PARAMETERS,
    *ALARM_PARAMETERS,
)


def response_limits(values: Mapping[str, Any]) -> ResponseLimits:
    """Build the limits of the answer to the command."""
    deviation, dead_time, t86 = (values[spec.name] for spec in RESPONSE_LIMITS)
    return ResponseLimits(deviation / 100, dead_time, t86)


def webhook_from(url: str) -> Webhook | None:
    """Return the webhook of the parameter's value, else of the environment; None for none.

    Raises ValueError if its address, or the token in the environment, cannot be used.
    """
    webhook = Webhook.at(url) if url else Webhook.from_environment()
    if webhook is not None:
        Secrets.from_environment()
    return webhook
