# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""What `describe-valve` asks of an actuator: an option each, and a question where it is missing."""

from collections.abc import Callable
from typing import Any, NamedTuple

from valve_friction_ros.records.units import AREA, LENGTH, MASS, PRESSURE, quantity, span


def _choice(*words: str) -> Callable[[str], str]:
    def chosen(text: str) -> str:
        close = [word for word in words if text and word.startswith(text.strip().lower())]
        if len(close) != 1:
            raise ValueError(f"{text[:40]!r}: choose {' or '.join(words)}")
        return close[0]

    return chosen


class ActuatorQuestion(NamedTuple):
    """What is asked, how an answer is read, and what stands for none; None: it must be answered."""

    name: str
    words: str
    example: str
    read: Callable[[str], Any]
    default: str | None = ""


QUESTIONS = (
    ActuatorQuestion("tag", "tag of the valve", "FV-101", str),
    ActuatorQuestion(
        "area",
        "effective area of the diaphragm or piston",
        "690 cm2, 107 in2",
        lambda text: quantity(text, AREA),
        None,
    ),
    ActuatorQuestion(
        "travel",
        "travel of the stem",
        "28.6 mm, 1.125 in",
        lambda text: quantity(text, LENGTH),
        None,
    ),
    ActuatorQuestion("acting", "acting", "single, double", _choice("single", "double"), "single"),
    ActuatorQuestion(
        "opposing_area",
        "area of the other side, that of the rod",
        "650 cm2",
        lambda text: quantity(text, AREA),
    ),
    ActuatorQuestion(
        "spring_range",
        "spring range (bench set)",
        "0.2..1.0 bar, 3..15 psi",
        lambda text: span(text, PRESSURE),
    ),
    ActuatorQuestion(
        "air_to", "more air on the actuator will", "open, close", _choice("open", "close"), "open"
    ),
    ActuatorQuestion(
        "position",
        "the position is that of the plug (0: closed), or of the stem (rising with the pressure)",
        "plug, stem",
        _choice("plug", "stem"),
        "plug",
    ),
    ActuatorQuestion(
        "sensor", "pressure sensor", "gauge, absolute", _choice("gauge", "absolute"), "gauge"
    ),
    ActuatorQuestion(
        "sensor_range", "range of the sensor", "0..7 bar", lambda text: span(text, PRESSURE)
    ),
    ActuatorQuestion(
        "mass", "mass of the moving parts", "1.6 kg", lambda text: quantity(text, MASS)
    ),
)
