"""What `describe-valve` asks of an actuator: an option each, and a question where it is missing."""

from collections.abc import Callable
from typing import Any, NamedTuple

from valve_friction_ros.records.quantities import AREA, LENGTH, MASS, PRESSURE, quantity, span

__all__ = ["QUESTIONS", "Question"]


def _choice(*words: str) -> Callable[[str], str]:
    def chosen(text: str) -> str:
        close = [word for word in words if text and word.startswith(text.strip().lower())]
        if len(close) != 1:
            raise ValueError(f"{text[:40]!r}: choose {' or '.join(words)}")
        return close[0]

    return chosen


class Question(NamedTuple):
    """What is asked, how an answer is read, and what stands for none; None: it must be answered."""

    name: str
    words: str
    example: str
    read: Callable[[str], Any]
    default: str | None = ""


QUESTIONS = (
    Question("tag", "tag of the valve", "FV-101", str),
    Question(
        "area",
        "effective area of the diaphragm or piston",
        "690 cm2, 107 in2",
        lambda text: quantity(text, AREA),
        None,
    ),
    Question(
        "travel",
        "travel of the stem",
        "28.6 mm, 1.125 in",
        lambda text: quantity(text, LENGTH),
        None,
    ),
    Question("acting", "acting", "single, double", _choice("single", "double"), "single"),
    Question(
        "opposing_area",
        "area of the other side, that of the rod",
        "650 cm2",
        lambda text: quantity(text, AREA),
    ),
    Question(
        "spring_range",
        "spring range (bench set)",
        "0.2..1.0 bar, 3..15 psi",
        lambda text: span(text, PRESSURE),
    ),
    Question(
        "air_to", "more air on the actuator will", "open, close", _choice("open", "close"), "open"
    ),
    Question(
        "position",
        "the position is that of the plug (0: closed), or of the stem (rising with the pressure)",
        "plug, stem",
        _choice("plug", "stem"),
        "plug",
    ),
    Question("sensor", "pressure sensor", "gauge, absolute", _choice("gauge", "absolute"), "gauge"),
    Question("sensor_range", "range of the sensor", "0..7 bar", lambda text: span(text, PRESSURE)),
    Question("mass", "mass of the moving parts", "1.6 kg", lambda text: quantity(text, MASS)),
)
