# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What the object of JSON and the table of `identify` say."""

import math

KEYS = {
    *("method", "parameters", "fit", "rms", "sliding_speed", "systematic_misfit", "warnings"),
    *("model_describes", "derivative_window", "evidence", "settings"),
}

PARAMETER_KEYS = {
    *("value", "standard_error", "half_width", "interval", "verdict", "reason", "published"),
    "unit",
}


def column(answer, key):
    """One entry of every parameter by name."""
    return {name: entry[key] for name, entry in answer["parameters"].items()}


def values(answer):
    return column(answer, "value")


def known(answer):
    """The values that are not withheld."""
    return {name: value for name, value in values(answer).items() if value is not None}


def none_for_nan(value):
    return None if math.isnan(value) else value


def row_of(out, name):
    """The row of a parameter in the printed table, without doubled spaces."""
    (row,) = (line for line in out.split("\n\n")[0].splitlines() if line.split()[0] == name)
    return " ".join(row.split())
