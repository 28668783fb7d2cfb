"""Parameters of the identifier and what they mean."""

import math
from collections.abc import Mapping
from typing import Any

from valve_friction_ros.health import Baseline, FrictionLimits, MonitorSettings
from valve_friction_ros.identification import (
    DEFAULT_METHOD,
    FIXABLE,
    METHODS,
    IdentificationSettings,
)
from valve_friction_ros.nodes.identifier.keeping import HISTORY_DAYS, HISTORY_FILE
from valve_friction_ros.nodes.identifier.reporting import REPORT_FOLDER
from valve_friction_ros.nodes.identifier.saving import SAVE_FOLDER
from valve_friction_ros.nodes.identifier.schedule import PERIOD
from valve_friction_ros.nodes.plumbing.parameters import ParameterSpec, optional
from valve_friction_ros.nodes.plumbing.valve_parameters import VALVE_PARAMETERS, valve_from

__all__ = ["CHANGEABLE", "FIXED_AT_START", "monitor_settings"]

_DEFAULTS = IdentificationSettings()
_LIMITS = FrictionLimits()

FIXED_AT_START = (
    ParameterSpec(
        "valve_tag",
        "",
        "Tag of the valve, hardware_id of its diagnostics [-]; empty: the namespace",
        read_only=True,
    ),
    HISTORY_FILE,
)

CHANGEABLE = (
    *VALVE_PARAMETERS,
    ParameterSpec(
        "window", 60.0, "Length of the record that is kept and identified [s]", (0.1, 86400.0)
    ),
    ParameterSpec(
        "input_timeout", 3.0, "Silence of an input after which it is reported [s]", (0.1, 86400.0)
    ),
    ParameterSpec(
        "method",
        DEFAULT_METHOD,
        "Method of identification [-]: sweep, for several fast strokes; force_balance, for a valve "
        "signature: two periods of a slow triangle within the window",
        choices=tuple(METHODS),
    ),
    ParameterSpec(
        "derivative_window",
        0,
        "Length d of the derivative window [samples], odd; 0: 31 for the published estimate, and "
        "chosen from the noise of each record for the refined one",
        (0, 100_001),
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
        "Mass assumed where a record does not tell it [kg]",
        (1e-6, 1e6),
    ),
    *(
        ParameterSpec(
            f"fixed.{name}",
            math.nan,
            f"Known value of {name} [SI unit], which is then not identified; .nan: not known",
        )
        for name in FIXABLE
    ),
    ParameterSpec(
        "baseline_coulomb_friction",
        math.nan,
        "Coulomb friction of the healthy valve [N], above zero; .nan: not known",
    ),
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
    REPORT_FOLDER,
    HISTORY_DAYS,
    PERIOD,
)


def monitor_settings(values: Mapping[str, Any]) -> MonitorSettings:
    """Build the settings of the monitor from parameter values.

    Raises
    ------
    ValueError
        If they break a rule; the message names it.
    """
    baseline = optional(values["baseline_coulomb_friction"])
    fixed = {name: optional(values[f"fixed.{name}"]) for name in FIXABLE}
    return MonitorSettings(
        valve=valve_from(values),
        identification=IdentificationSettings(
            derivative_window=values["derivative_window"] or None,
            order=values["polynomial_order"],
            fixed={name: value for name, value in fixed.items() if value is not None},
            position_bias=optional(values["position_bias"]),
            assumed_mass=values["assumed_mass"],
        ),
        method=values["method"],
        limits=FrictionLimits(values["warn_ratio"], values["error_ratio"], values["low_ratio"]),
        baseline=None if baseline is None else Baseline(baseline),
        window=values["window"],
    )
