# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What is built from the parameters of the identifier."""

import math
from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from valve_friction_ros.health import (
    Baseline,
    FrictionLimits,
    MonitorSettings,
    SurveyLimits,
    ValveLimits,
)
from valve_friction_ros.identification import STATED, require_valve_units
from valve_friction_ros.nodes.plumbing.parameters import valve_from
from valve_friction_ros.settings import (
    IDENTIFICATION,
    NODES,
    VALVE,
    identification_from,
    survey_from,
)

CHANGEABLE = tuple(one for one in NODES["identifier"] if not one.read_only)
"""Those that can be changed while the node runs."""


def monitor_settings(values: Mapping[str, Any]) -> MonitorSettings:
    """Build the settings of the monitor from parameter values.

    Raises ValueError if they break a rule; the message names it.
    """
    given = {one.name: values[one.name] for one in IDENTIFICATION if one.is_given(values[one.name])}
    stated = {name: values[name] for name in STATED if values[name] is not None}
    given["assumed_mass"] = stated.get("mass", values["assumed_mass"])
    return MonitorSettings(
        valve=valve_from(values),
        identification=identification_from(
            given,
            stated=stated,
            assumed=tuple(one.name for one in VALVE if values[one.name] is None),
        ),
        method=values["method"],
        limits=FrictionLimits(
            **{one.name: values[one.name] for one in fields(FrictionLimits) if one.compare},
            survey=SurveyLimits.of_packing(**survey_from(values)),
        ),
        window=values["window"],
        valve_limits=ValveLimits(**{one.name: values[one.name] for one in fields(ValveLimits)}),
    )


def baseline_from(value: float | None) -> Baseline | None:
    """Build the baseline that its parameter gives; raises ValueError for an impossible one."""
    return None if value is None or math.isnan(value) else Baseline(value)


def require_valid(values: Mapping[str, Any]) -> None:
    """Raise ValueError, which names the broken rule, if parameter values break one."""
    settings = monitor_settings(values)
    how = settings.identification
    require_valve_units(settings.valve, {**how.stated, **how.fixed})
    baseline_from(values["baseline_coulomb_friction"])
    for one in CHANGEABLE:
        if one.choices and one.spell(values[one.name]) not in one.choices:
            raise ValueError(
                f"{one.name} must be {' or '.join(one.choices)}, got {values[one.name]!r}"
            )
