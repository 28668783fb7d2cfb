"""All parameters of the identifier, and what is built from them."""

import math
from collections.abc import Mapping
from typing import Any

from valve_friction_ros.health import Baseline, FrictionLimits, MonitorSettings, ValveLimits
from valve_friction_ros.identification import (
    CALIBRATION,
    DEFAULT_METHOD,
    FIXABLE,
    METHODS,
    MOST_UNCERTAIN,
    TIMING_UNCERTAINTY,
    UNITS,
    IdentificationSettings,
    require_valve_units,
)
from valve_friction_ros.nodes.identifier.service_parameters import SERVICE_PARAMETERS, VALVE_LIMITS
from valve_friction_ros.nodes.plumbing.parameters import ParameterSpec, optional
from valve_friction_ros.nodes.plumbing.valve_parameters import JOINT, VALVE_PARAMETERS, valve_from
from valve_friction_ros.records.data_folder import history_file

__all__ = [
    "BASELINE",
    "BASELINE_IN_ALARM",
    "CHANGEABLE",
    "CLOCK_TOLERANCE",
    "HISTORY_DAYS",
    "HISTORY_FILE",
    "HISTORY_URL",
    "IDENTIFICATION_LIMIT",
    "INPUT_TIMEOUT",
    "NUMBER_TOPICS",
    "PARAMETERS",
    "PERIOD",
    "REPORT_FOLDER",
    "SAVE_FOLDER",
    "SAVE_MEGABYTES",
    "VALVE_TAG",
    "baseline_from",
    "monitor_settings",
    "require_valid",
]

_DEFAULTS = IdentificationSettings()
_LIMITS = FrictionLimits()
_UNITS = {**UNITS, "limit_velocity": "m/s"}

VALVE_TAG = ParameterSpec(
    "valve_tag",
    "",
    "Tag of the valve, hardware_id of its diagnostics [-]; empty: the namespace",
    read_only=True,
)
HISTORY_FILE = ParameterSpec(
    "history_file",
    str(history_file()),
    "File in which identifications and baselines are kept [-]; empty: nowhere",
    read_only=True,
)
HISTORY_URL = ParameterSpec(
    "history_url",
    "",
    "PostgreSQL server that the history_file is sent to, postgresql://user@host/database [-]; "
    "empty: that of the environment, VALVE_FRICTION_HISTORY_URL, or none. No password belongs here",
    read_only=True,
)
HISTORY_DAYS = ParameterSpec(
    "history_days",
    1100.0,
    "Time for which they are kept [days]; 0: for ever",
    (0.0, 36525.0),
    read_only=True,
)
INPUT_TIMEOUT = ParameterSpec(
    "input_timeout", 3.0, "Silence of an input after which it is reported [s]", (0.1, 86400.0)
)
CLOCK_TOLERANCE = ParameterSpec(
    "clock_tolerance",
    60.0,
    "Distance of stamps from the clock of the node from which it is reported [s]; 0: none, as for "
    "recordings that are played without /clock",
    (0.0, 1e9),
)
IDENTIFICATION_LIMIT = ParameterSpec(
    "identification_limit",
    600.0,
    "Time after which an identification that has not ended is reported as stuck [s]",
    (1.0, 86400.0),
)
BASELINE = ParameterSpec(
    "baseline_coulomb_friction",
    math.nan,
    "Coulomb friction of the healthy valve [N], above zero; .nan: not known",
)
BASELINE_IN_ALARM = ParameterSpec(
    "baseline_in_alarm",
    False,
    "Whether ~/set_baseline and ~/restore_baseline may change the baseline in WARN or ERROR [-]",
)
SAVE_FOLDER = ParameterSpec(
    "save_folder",
    "",
    "Folder that ~/save writes bags into [-]; empty: valve_friction_ros/saved under ROS_HOME, or "
    "under ~/.ros; a relative one is in valve_friction_ros there",
    read_only=True,
)
SAVE_MEGABYTES = ParameterSpec(
    "save_megabytes",
    1000.0,
    "Room that the bags of ~/save of a valve may take [MB], and as much the pages of ~/report; "
    "when it is full, both refuse",
    (0.001, 1e6),
    read_only=True,
)
REPORT_FOLDER = ParameterSpec(
    "report_folder",
    "",
    "Folder that ~/report writes pages into [-]; empty: valve_friction_ros/reports under ROS_HOME, "
    "or under ~/.ros; a relative one is in valve_friction_ros there",
    read_only=True,
)
NUMBER_TOPICS = ParameterSpec(
    "number_topics",
    True,
    "Whether each number, and the sweep, has a latched topic of its own beside ~/estimate [-]; "
    "`identifiers` of more than 4 valves have none unless told",
    read_only=True,
)
PERIOD = ParameterSpec(
    "period",
    0.0,
    "Time from one scheduled identification to the next [s]; 0: only on demand",
    (0.0, 31_557_600.0),
)

PARAMETERS = (
    *VALVE_PARAMETERS,
    ParameterSpec(
        "window", 60.0, "Length of the record that is kept and identified [s]", (0.1, 86400.0)
    ),
    INPUT_TIMEOUT,
    CLOCK_TOLERANCE,
    IDENTIFICATION_LIMIT,
    ParameterSpec(
        "method",
        DEFAULT_METHOD,
        "Method of identification [-]: best, robust wherever it applies; robust, with the "
        "imperfections of a plant in the fit; refined, with the Karnopp model alone; published, "
        "where refined starts from; signature, for two periods of a slow triangle in the window",
        choices=tuple(METHODS),
    ),
    ParameterSpec(
        "derivative_window",
        0,
        "Length d of the derivative window [samples], odd; 0: 31 for the published estimate, and "
        "chosen from the noise of each record for the refined result",
        (0, 100_001),
    ),
    ParameterSpec(
        "timing_uncertainty",
        math.nan,
        "Standard deviation of the whole lag between the signals [s]: clocks, transmitters, a "
        f"volume before the diaphragm; .nan: {TIMING_UNCERTAINTY:g}, a plant without special care; "
        "0: the signals surely belong together",
    ),
    *(
        ParameterSpec(
            name,
            getattr(_DEFAULTS, name),
            f"Relative standard uncertainty of {what} [-], 0.02 for 2 %: widens every interval",
            (0.0, MOST_UNCERTAIN),
        )
        for name, what in CALIBRATION.items()
    ),
    ParameterSpec(
        "polynomial_order", _DEFAULTS.order, "Order n of the derivative polynomial [-]", (2, 20)
    ),
    ParameterSpec(
        "position_bias",
        math.nan,
        "Bias x̄ of the position [m], for the paper's four-column form; .nan: identify the preload",
    ),
    ParameterSpec(
        "assumed_mass",
        _DEFAULTS.assumed_mass,
        "Mass assumed where a record does not determine it [kg]",
        (1e-6, 1e6),
    ),
    *(
        ParameterSpec(
            f"fixed.{name}",
            math.nan,
            f"Known value of {name} [{_UNITS[name]}], then not identified; .nan: not known",
        )
        for name in FIXABLE
    ),
    BASELINE,
    BASELINE_IN_ALARM,
    ParameterSpec(
        "warn_ratio", _LIMITS.warn_ratio, "Friction over baseline worth maintenance [-]", (1.0, 1e3)
    ),
    ParameterSpec(
        "error_ratio", _LIMITS.error_ratio, "Friction over baseline in excess [-]", (1.0, 1e3)
    ),
    ParameterSpec(
        "low_ratio",
        _LIMITS.low_ratio,
        "Friction over baseline at which the packing may leak [-]",
        (0.0, 1.0),
    ),
    SAVE_FOLDER,
    SAVE_MEGABYTES,
    REPORT_FOLDER,
    HISTORY_DAYS,
    PERIOD,
    *SERVICE_PARAMETERS,
    VALVE_TAG,
    HISTORY_FILE,
    HISTORY_URL,
    JOINT,
    NUMBER_TOPICS,
)

CHANGEABLE = tuple(one for one in PARAMETERS if not one.read_only)
"""Those that can be changed while the node runs: none that is an address, a folder, or room.

Whoever reaches the ROS graph can change them."""


def monitor_settings(values: Mapping[str, Any]) -> MonitorSettings:
    """Build the settings of the monitor from parameter values.

    Raises ValueError if they break a rule; the message names it.
    """
    fixed = {name: optional(values[f"fixed.{name}"]) for name in FIXABLE}
    return MonitorSettings(
        valve=valve_from(values),
        identification=IdentificationSettings(
            derivative_window=values["derivative_window"] or None,
            order=values["polynomial_order"],
            fixed={name: value for name, value in fixed.items() if value is not None},
            position_bias=optional(values["position_bias"]),
            assumed_mass=values["assumed_mass"],
            timing_uncertainty=optional(values["timing_uncertainty"]),
            **{name: values[name] for name in CALIBRATION},
        ),
        method=values["method"],
        limits=FrictionLimits(values["warn_ratio"], values["error_ratio"], values["low_ratio"]),
        window=values["window"],
        valve_limits=ValveLimits(**{one.name: values[one.name] for one in VALVE_LIMITS}),
    )


def baseline_from(values: Mapping[str, Any]) -> Baseline | None:
    """Build the baseline that the parameter gives; raises ValueError for an impossible one."""
    value = optional(values[BASELINE.name])
    return None if value is None else Baseline(value)


def require_valid(values: Mapping[str, Any]) -> None:
    """Raise ValueError, which names the broken rule, if parameter values break one."""
    settings = monitor_settings(values)
    require_valve_units(settings.valve, settings.identification.fixed)
    baseline_from(values)
    for one in CHANGEABLE:
        if one.choices and values[one.name] not in one.choices:
            raise ValueError(
                f"{one.name} must be {' or '.join(one.choices)}, got {values[one.name]!r}"
            )
